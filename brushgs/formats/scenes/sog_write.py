"""Write Gaussians as a SOG scene of version 2: a zip archive of lossless WebP pictures and a `meta.json`.

`sog` and `sog_meta` describe the layout, its formulas and its source. Rows are sorted along a space-filling
curve, so that neighboring pixels are similar and compress better.

Codebooks are computed by k-means. For single numbers it is Lloyd's method on sorted values, which is
deterministic. For rows of numbers it has two levels, because 65,536 centroids of a million rows at once would
take hours on a CPU: first some hundreds of groups, then centroids within each group, as many as its number of
rows and their squared distances require.
"""

import json
import warnings
import zipfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.formats.files import replacing, scratch_folder
from brushgs.formats.pictures.still import write_exact
from brushgs.formats.scenes.sog import QUAT_TAG
from brushgs.formats.scenes.sog_meta import MAX_PALETTE, META, NOTES, PALETTE_ROW, mean_logs
from brushgs.formats.scenes.stored import Stored, content_of
from brushgs.formats.scenes.write import in_order, logs_of, rounded, shares_of, smallest_three, spatial_order
from brushgs.values.arrays import F32, F64, U8, Array
from brushgs.values.gaussians import Gaussians
from brushgs.version import __version__

if TYPE_CHECKING:
    from sklearn.cluster import KMeans


NUM_LEVELS = 256  # the values of a byte
_ROUNDS = 60  # iterations of Lloyd's method
# In the first iterations, the least useful levels move to where the error is largest: removing a level makes
# its error about 16 times as large, and adding a second level reduces an error to a quarter.
_MOVING_ROUNDS, _MOVED, _WORTH = 40, 16, 24
_GROUP_ROWS, _MAX_GROUPS = 1024, 256  # rows of a group, or more if there would be too many groups
_FIRST_ROWS = 1 << 16  # rows from which groups are made
_ROW_ROUNDS = 3  # with one entry per two rows, 12 iterations gain 0.1 dB
_SEED = 20261122


def levels_of(values: Array, weights: Array | None = None) -> F64:
    """[256] ascending levels that minimise the squared error to the values; of fewer, the last is repeated.

    `weights`, >= 0 and of the shape of the values, weight the squared errors.
    """
    order = np.argsort(values, axis=None, kind="stable")
    ordered = values.reshape(-1)[order].astype(np.float64)
    mass = np.ones(len(ordered)) if weights is None else weights.reshape(-1)[order].astype(np.float64)
    distinct = np.unique(ordered)
    if len(distinct) <= NUM_LEVELS:
        return np.pad(distinct, (0, NUM_LEVELS - len(distinct)), mode="edge")
    columns = mass, mass * ordered, mass * np.square(ordered)
    masses, sums, squares = (np.concatenate([[0.0], np.cumsum(column)]) for column in columns)
    levels = distinct[np.linspace(0, len(distinct) - 1, NUM_LEVELS).round().astype(np.int64)]
    for number in range(_ROUNDS):
        ends = np.searchsorted(ordered, [-np.inf, *(levels[1:] + levels[:-1]) / 2, np.inf])
        held, total = np.diff(masses[ends]), np.diff(sums[ends])
        is_held = held > 0
        levels[is_held] = total[is_held] / held[is_held]
        if number < _MOVING_ROUNDS:
            errors = np.maximum(np.diff(squares[ends]) - levels * total, 0)
            errors[~is_held] = -1
            by_error = np.argsort(errors, kind="stable")
            idle, busy = by_error[:_MOVED], by_error[: -_MOVED - 1 : -1]
            is_worth = errors[busy] > _WORTH * np.maximum(errors[idle], 0)
            idle, busy = idle[is_worth], busy[is_worth]
            lowest, highest = ordered[ends[busy]], ordered[ends[busy + 1] - 1]
            is_high = highest - levels[busy] > levels[busy] - lowest
            levels[idle] = (levels[busy] + np.where(is_high, highest, lowest)) / 2
        levels = np.sort(np.clip(levels, ordered[0], ordered[-1]))
    return levels


def nearest_levels(values: Array, levels: F64) -> U8:
    """The index of the nearest of ascending levels for each value."""
    borders = (levels[1:] + levels[:-1]) / 2
    return np.searchsorted(borders, values.astype(np.float64)).astype(np.uint8)


def palette_of(rows: F32, most: int) -> tuple[F32, NDArray[np.int64]]:
    """At most `most` centroids [entries, columns] of rows [N, columns], and the entry of each row.

    Minimises squared errors. The result does not depend on the number of threads.
    """
    distinct, labels = np.unique(rows, axis=0, return_inverse=True)
    if len(distinct) <= most:
        return distinct, labels.reshape(-1)
    with _one_thread_each():
        return _palette_of_groups(rows, most)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Run k-means on one thread, as its sums depend on the number; ignore warnings of few distinct rows."""
    try:
        from sklearn.exceptions import ConvergenceWarning
        from threadpoolctl import threadpool_limits  # of scikit-learn
    except ImportError:
        fact = "a .sog of spherical harmonics needs scikit-learn"
        raise ValueError(f"{fact}; pip install 'brushgs[kmeans]', or write .spz") from None

    with threadpool_limits(1), warnings.catch_warnings():  # in all threads
        warnings.simplefilter("ignore", ConvergenceWarning)
        yield


def _palette_of_groups(rows: F32, most: int) -> tuple[F32, NDArray[np.int64]]:
    """`palette_of` for more distinct rows than entries."""
    groups = _groups(rows)
    shares = _shares(rows, groups, most)
    labels, start = np.empty(len(rows), np.int64), 0
    with ThreadPoolExecutor(num_threads_or_default(None)) as pool:
        found = list(pool.map(lambda group, share: _cluster(rows[group], share), groups, shares))
    for group, (centroids, inside) in zip(groups, found, strict=True):
        labels[group] = inside + start
        start += len(centroids)
    return np.concatenate([centroids for centroids, _ in found]), labels


def _groups(rows: F32) -> list[NDArray[np.int64]]:
    """Row numbers of groups of similar rows."""
    num_groups = min(-(-len(rows) // _GROUP_ROWS), _MAX_GROUPS)
    if num_groups == 1:
        return [np.arange(len(rows))]
    step = max(1, len(rows) // _FIRST_ROWS)
    model = _k_means(num_groups).fit(rows[::step])
    labels = model.predict(rows)
    groups = [np.flatnonzero(labels == index) for index in range(num_groups)]
    return [group for group in groups if len(group)]


def _shares(rows: F32, groups: list[NDArray[np.int64]], most: int) -> list[int]:
    """The number of entries of each group, >= 1 each and at most `most` in total."""
    spreads = np.array([rows[group].astype(np.float64).var(axis=0).sum() * len(group) for group in groups])
    # The squared error of k entries falls slowly, as k^(-2 / columns): weight rows and spread equally.
    weights = np.sqrt(spreads * [len(group) for group in groups])
    room = most - len(groups)
    shares = np.floor(weights / max(weights.sum(), 1e-300) * room).astype(int)
    return [int(1 + min(share, len(group) - 1)) for share, group in zip(shares, groups, strict=True)]


def _cluster(rows: F32, num_entries: int) -> tuple[F32, NDArray[np.int64]]:
    """At most `num_entries` centroids of one group, and the centroid of each row."""
    distinct, labels = np.unique(rows, axis=0, return_inverse=True)
    if len(distinct) <= num_entries:
        return distinct, labels.reshape(-1)
    model = _k_means(num_entries).fit(rows)
    return model.cluster_centers_.astype(np.float32), model.labels_.astype(np.int64)


def _k_means(num_clusters: int) -> "KMeans":
    # The k-means of `passes.reduce.lloyd` takes at most 16 columns, and these are up to 45.
    from sklearn.cluster import KMeans

    return KMeans(num_clusters, init="random", n_init=1, max_iter=_ROW_ROUNDS, tol=0, random_state=_SEED)


_WHOLE = 65535  # largest 16-bit number
# Gaussians per entry of the palette, in scenes of up to 131,072: with 16, files are a third smaller and
# pictures 7 to 12 dB worse.
_ENTRY_ROWS = 2
_LEAST_ENTRIES = 1024
_LEAST_AREA = 1e-6  # least weight, relative to the largest area: keeps the scale 0 of flat Gaussians
_DATE = (1980, 1, 1, 0, 0, 0)  # of members: the earliest date in a zip archive


@in_order(spatial_order)
def write_scene(rows: Gaussians, path: str | Path, stored: Stored) -> None:
    """Write the pictures and the meta. Gaussians whose opacity rounds to 0 lose their colors, unseen.

    Raises:
        ValueError: if the names of brushes are too long, or the palette of spherical harmonics needs
            scikit-learn, which is not installed.
        SceneError: if the file cannot be written.
    """
    logs = mean_logs(rows.means)
    low, high = logs.min(axis=0), logs.max(axis=0)
    places = rounded(shares_of(logs, low, high) * _WHOLE, _WHOLE)
    log_scales, colors = logs_of(rows.scales), rows.sh[:, 0].astype(np.float64)
    # Weight by area, since large Gaussians are few and their errors are most visible.
    areas = np.exp(2 * (log_scales - log_scales.max()))
    scale_levels = levels_of(log_scales, np.maximum(areas, _LEAST_AREA))
    color_levels = levels_of(colors)
    alphas = rounded(rows.opacities * 255.0, 255)
    pictures = {
        "means_l.webp": places & 255,
        "means_u.webp": places >> 8,
        "quats.webp": _pack_quats(rows.quats),
        "scales.webp": nearest_levels(log_scales, scale_levels),
        "sh0.webp": np.column_stack([nearest_levels(colors, color_levels), alphas]),
    }
    meta: dict[str, Any] = {
        "version": 2,
        "asset": {"generator": f"brushgs {__version__}"},
        "count": len(rows),
        "means": {"mins": low.tolist(), "maxs": high.tolist(), "files": ["means_l.webp", "means_u.webp"]},
        "scales": {"codebook": _listed(scale_levels), "files": ["scales.webp"]},
        "quats": {"files": ["quats.webp"]},
        "sh0": {"codebook": _listed(color_levels), "files": ["sh0.webp"]},
    }
    if rows.antialiased:
        meta["model"] = "antialiased"
    whole = {name: _laid_out(pixels.astype(np.uint8)) for name, pixels in pictures.items()}
    if rows.sh.shape[1] > 1:
        meta["shN"], more = _harmonics(rows)
        whole |= more
    if content := content_of(stored._replace(antialiased=False)):  # `model` states it
        meta[NOTES] = content
    text = json.dumps(meta, separators=(",", ":"), allow_nan=False).encode("ascii")
    _write_archive(path, text, whole)


def _harmonics(rows: Gaussians) -> tuple[dict[str, Any], dict[str, U8]]:
    """Meta and pictures of the degrees above 0: a palette, and the entry of each Gaussian."""
    num_rest = rows.sh.shape[1] - 1
    flat = rows.sh[:, 1:].astype(np.float32).reshape(len(rows), -1)
    entries, labels = palette_of(flat, min(MAX_PALETTE, max(_LEAST_ENTRIES, len(rows) // _ENTRY_ROWS)))
    levels = levels_of(entries)
    stored = nearest_levels(entries, levels).reshape(-1, num_rest, 3)
    num_lines = -(-len(entries) // PALETTE_ROW)
    centroids = np.zeros((num_lines * PALETTE_ROW, num_rest, 3), np.uint8)
    centroids[: len(stored)] = stored
    words = np.column_stack([labels & 255, labels >> 8, np.zeros_like(labels)]).astype(np.uint8)
    meta = {
        "count": len(entries),
        "bands": rows.sh_degree,
        "codebook": _listed(levels),
        "files": ["shN_centroids.webp", "shN_labels.webp"],
    }
    picture = centroids.reshape(num_lines, PALETTE_ROW * num_rest, 3)
    return meta, {"shN_centroids.webp": picture, "shN_labels.webp": _laid_out(words)}


def _pack_quats(quats: Array) -> NDArray[np.int64]:
    """[n, 4] bytes: three components in order, then the tag of the largest of w, x, y, z."""
    largest, others = smallest_three(quats)
    return np.column_stack([rounded((others * np.sqrt(0.5) + 0.5) * 255, 255), largest + QUAT_TAG])


def _laid_out(pixels: U8) -> U8:
    """Arrange [n, channels] in rows as [height, width, channels], nearly square, sides multiples of 4."""
    num_rows, channels = pixels.shape
    width = -(-int(np.ceil(np.sqrt(num_rows))) // 4) * 4
    height = -(-num_rows // (4 * width)) * 4
    picture = np.zeros((height * width, channels), np.uint8)
    picture[:num_rows] = pixels
    if channels == 4:
        picture[num_rows:, 3] = 255  # transparent pixels would not compress better
    return picture.reshape(height, width, channels)


def _listed(levels: F64) -> list[float]:
    """The levels as the shortest decimal numbers of the same float32 values."""
    return [float(str(value)) for value in levels.astype(np.float32)]


def _write_archive(path: str | Path, meta: bytes, pictures: dict[str, U8]) -> None:
    """Write the archive without compression, since WebP does not compress further."""
    with (
        replacing(path) as temporary,
        scratch_folder() as folder,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive,
    ):
        for name, picture in pictures.items():
            file = folder / name
            write_exact(picture, file)
            archive.writestr(zipfile.ZipInfo(name, _DATE), file.read_bytes())
        archive.writestr(zipfile.ZipInfo(META, _DATE), meta)
