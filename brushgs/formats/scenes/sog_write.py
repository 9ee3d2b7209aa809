"""Gaussians become a SOG scene of version 2: a zip archive of lossless WebP pictures and a `meta.json`.

The layout, its formulas and its source are those of `sog` and `sog_meta`. Rows are sorted along a curve in
space, so that neighbours in a picture are alike, which packs better.
"""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing, scratch_folder
from brushgs.formats.pictures.webp import write_exact
from brushgs.formats.scenes.finite_logs import logs_of, unit_quats
from brushgs.formats.scenes.order import spatial_order
from brushgs.formats.scenes.rounding import fractions_of, rounded
from brushgs.formats.scenes.sog import QUAT_TAG
from brushgs.formats.scenes.sog_codebook import levels_of, nearest_levels, palette_of
from brushgs.formats.scenes.sog_files import META
from brushgs.formats.scenes.sog_meta import MAX_PALETTE, NOTES, PALETTE_ROW, mean_logs
from brushgs.formats.scenes.stored import NOTHING, Stored, content_of
from brushgs.values.gaussians import Gaussians
from brushgs.version import __version__

_WHOLE = 65535  # the largest number of 16 bits
# Gaussians for an entry of the palette, in scenes of up to 131,072: with 16, files are a third smaller and
# pictures 7 to 12 dB farther from the scene.
_ENTRY_ROWS = 2
_LEAST_ENTRIES = 1024
_LEAST_AREA = 1e-6  # of the largest: so that flat ones, whose scale is 0, stay flat
_DATE = (1980, 1, 1, 0, 0, 0)  # of the members: the first that a zip archive can state


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> NDArray[np.int64] | None:
    """Write the pictures and what they mean.

    `known` is what is recorded. The colours of Gaussians whose opacity rounds to 0
    are lost; these are not seen.

    Returns:
        The rows in the order of the file; None if that is recorded.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    order = spatial_order(gaussians)
    rows = gaussians.take(order)
    stored = known.sorted_by(rows, order)
    logs = mean_logs(rows.means)
    low, high = logs.min(axis=0), logs.max(axis=0)
    places = rounded(fractions_of(logs, low, high) * _WHOLE, _WHOLE)
    log_scales, colors = logs_of(rows.scales), rows.sh[:, 0].astype(np.float64)
    # By area: large Gaussians are few, and their errors show most.
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
    if gaussians.antialiased:
        meta["model"] = "antialiased"
    whole = {name: _laid_out(pixels.astype(np.uint8)) for name, pixels in pictures.items()}
    if rows.sh.shape[1] > 1:
        meta["shN"], more = _harmonics(rows)
        whole |= more
    if content := content_of(stored._replace(antialiased=False)):  # which `model` says
        meta[NOTES] = content
    text = json.dumps(meta, separators=(",", ":"), allow_nan=False).encode("ascii")
    _write_archive(path, text, whole)
    return order if stored.order is None else None


def _harmonics(rows: Gaussians) -> tuple[dict[str, Any], dict[str, NDArray[np.uint8]]]:
    """The degrees above 0: a palette, and the entry of each Gaussian."""
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


def _pack_quats(quats: NDArray[np.floating]) -> NDArray[np.int64]:
    """[n, 4] bytes: three components in order, then the tag of the largest of w, x, y, z."""
    units = unit_quats(quats)
    largest = np.abs(units).argmax(axis=1)
    units *= np.where(np.take_along_axis(units, largest[:, None], 1) < 0, -1, 1)  # that one follows, as > 0
    others = units[np.arange(4) != largest[:, None]].reshape(-1, 3)
    return np.column_stack([rounded((others * np.sqrt(0.5) + 0.5) * 255, 255), largest + QUAT_TAG])


def _laid_out(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """[n, channels] -> [height, width, channels] in rows, about a square; sides are multiples of 4."""
    num_rows, channels = pixels.shape
    width = -(-int(np.ceil(np.sqrt(num_rows))) // 4) * 4
    height = -(-num_rows // (4 * width)) * 4
    picture = np.zeros((height * width, channels), np.uint8)
    picture[:num_rows] = pixels
    if channels == 4:
        picture[num_rows:, 3] = 255  # transparent pixels would not pack better
    return picture.reshape(height, width, channels)


def _listed(levels: NDArray[np.float64]) -> list[float]:
    """As the shortest numbers that are the same float32."""
    return [float(str(value)) for value in levels.astype(np.float32)]


def _write_archive(path: str | Path, meta: bytes, pictures: dict[str, NDArray[np.uint8]]) -> None:
    """Members are stored as they are: WebP does not pack further."""
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
