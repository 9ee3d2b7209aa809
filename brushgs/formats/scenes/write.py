"""Write Gaussians to a scene file, whose suffix decides the format; and functions shared by the writers.

Most formats store integers of a few bits, with finite values for infinite logs and logits; compressed files
sort rows so that neighbors in space are adjacent. A written file can be read back to measure its errors.
"""

from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.formats.registry import SCENE_SUFFIXES, find_written, function_of
from brushgs.formats.scenes.read import read_scene
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized
from brushgs.values.sh import C0


def rounded(values: NDArray[Any], largest: int) -> NDArray[np.int64]:
    """Round to integers, halves up, and clip to 0 to `largest`."""
    return np.asarray(np.floor(np.clip(values, 0, largest) + 0.5)).astype(np.int64)


def shares_of(values: NDArray[Any], low: NDArray[Any], high: NDArray[Any]) -> F64:
    """Shares of values between `low` (0) and `high` (1), in float64; 0 where both are equal."""
    extent = high.astype(np.float64) - low
    above = values - low.astype(np.float64)
    return np.asarray(np.divide(above, extent, out=np.zeros(above.shape), where=extent > 0))


_BITS = 21  # per axis: three axes fill 63 bits


def spatial_order(gaussians: Gaussians) -> NDArray[np.int64]:
    """[N] row numbers along a Morton curve; strokes with brushes are sorted by brush first.

    Coordinates are logarithmic in the distance from the middle, so that far centers do not use up the bits.
    """
    means = gaussians.means.astype(np.float64)
    middle, spread = np.median(means, axis=0), np.ptp(np.percentile(means, (5, 95), axis=0), axis=0).max()
    logs = np.arcsinh((means - middle) / (spread or 1.0))
    places = rounded(shares_of(logs, logs.min(axis=0), logs.max(axis=0)) * (2**_BITS - 1), 2**_BITS - 1)
    threads = num_threads_or_default(None)
    order = np.asarray(_core.morton_order(places.astype(np.float64), np.zeros(3), 1.0, threads))
    if gaussians.brushes is None:
        return order
    return order[np.argsort(gaussians.brushes[order], kind="stable")]


def brush_order(gaussians: Gaussians) -> NDArray[np.int64] | None:
    """[N] row numbers sorted by brush, stable; None if there are no brushes."""
    return None if gaussians.brushes is None else np.argsort(gaussians.brushes, kind="stable")


_Order = NDArray[np.int64] | None


def in_order(
    order_of: Callable[[Gaussians], _Order],
) -> Callable[[Callable[[Gaussians, str | Path, Stored], None]], Callable[..., _Order]]:
    """Decorate a writer so that it gets the rows sorted by `order_of`, and notes with that order.

    The decorated writer returns the row numbers in the order of the file; None if the order is unchanged, or
    recorded in the file.
    """

    def decorate(write: Callable[[Gaussians, str | Path, Stored], None]) -> Callable[..., _Order]:
        @wraps(write)
        def write_scene(gaussians: Gaussians, path: str | Path, known: Stored = NOTHING) -> _Order:
            order = order_of(gaussians)
            rows = gaussians if order is None else gaussians.take(order)
            stored = known.sorted_by(rows, order)
            write(rows, path, stored)
            return order if stored.order is None else None

        return write_scene

    return decorate


# Replaces infinite logs and logits: in float32, exp(-104) is 0 and 1 / (1 + exp(-+104)) is 1 or 0.
_INFINITE_LOG = 104.0
_LARGEST_LOG = 88.722  # just below the log of the largest float32, so that its exp is finite


def logs_of(values: Array) -> F64:
    """Natural logarithms of values >= 0, clipped to finite values."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(values, dtype=np.float64), -_INFINITE_LOG, _LARGEST_LOG))


def logits_of(values: Array) -> F64:
    """log(p / (1 - p)) of values 0 to 1, clipped to finite values."""
    wide = values.astype(np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(wide) - np.log1p(-wide), -_INFINITE_LOG, _INFINITE_LOG))


def finite_scales(scales: Array) -> F32:
    """Scales as float32, clipped so that their logarithms are finite, for formats with linear scales."""
    return np.minimum(scales, np.exp(_LARGEST_LOG)).astype(np.float32)


def smallest_three(quats: Array) -> tuple[NDArray[np.int64], F64]:
    """[n] index of the largest component of each quaternion, and the others [n, 3], signed to make it > 0."""
    units = normalized(quats)
    largest = np.abs(units).argmax(axis=1)
    units *= np.where(np.take_along_axis(units, largest[:, None], 1) < 0, -1, 1)
    return largest, units[np.arange(4) != largest[:, None]].reshape(-1, 3)


_MIDDLE = 1, 99  # percentiles of the centers, so that a few far ones do not enlarge the extent
_FLAT = 1e-6  # standard deviations below this share of the extent are treated as equal
_SMALLEST = 1e-37  # the same limit if the extent is 0, world units
_VISIBLE = 0.5 / 255  # smaller opacities round to 0 in most formats, so color and shape are not seen


class Losses(NamedTuple):
    """Errors of a written file; each pair is the median and the largest error."""

    extent: float  # diagonal of the box of 98 % of the centers along each axis, world units
    means: tuple[float, float]  # distance between centers, world units
    scales: tuple[float, float]  # ratio of the larger standard deviation to the smaller, minus 1
    quats: tuple[float, float]  # angle between rotations, degrees
    opacities: tuple[float, float]  # difference, 0 to 1
    colors: tuple[float, float]  # difference of the channels of degree 0, levels of 255
    harmonics: tuple[float, float]  # of higher degrees, root mean square over directions, levels of 255

    def counts(self) -> dict[str, float]:
        """Values for a report: "extent", "means_error" (median), "means_error_most" and so on."""
        found = {"extent": self.extent}
        for name, (median, most) in zip(self._fields[1:], self[1:], strict=True):
            found |= {f"{name}_error": median, f"{name}_error_most": most}
        return {name: float(f"{value:.4g}") for name, value in found.items()}

    def words(self) -> list[str]:
        """Lines of text with the median and the largest error of each kind of number."""
        share = [f"{value / self.extent:.1e}" if self.extent else "0" for value in self.means]
        lines = [
            f"centers are off by {_pair(self.means)} units, {share[0]} (at most {share[1]}) of the extent",
            f"sizes are off by {_pair(self.scales, 100)} %, rotations by {_pair(self.quats)} degrees",
            f"opacities are off by {_pair(self.opacities, 255)}, colors by {_pair(self.colors)} of 255",
        ]
        if self.harmonics[1]:
            lines.append(f"colors that change with the view are off by {_pair(self.harmonics)} levels of 255")
        return lines


def measure_losses(given: Gaussians, path: str | Path, order: NDArray[np.integer] | None = None) -> Losses:
    """Read a file and compare it with the Gaussians that were written.

    `order` is the row numbers in the order of the file, None if unchanged. Raises SceneError if the file
    cannot be read.
    """
    found = read_scene(Path(path))[0]
    given = given if order is None else given.take(order)
    assert len(found) == len(given), "every row that is written can be drawn"
    seen = given.opacities >= _VISIBLE
    means = given.means.astype(np.float64)
    extent = float(np.linalg.norm(np.ptp(np.percentile(means, _MIDDLE, axis=0), axis=0)))
    smallest = max(_FLAT * extent, _SMALLEST)
    logs = [np.log(np.maximum(some.scales.astype(np.float64), smallest)) for some in (given, found)]
    cosines = np.abs((normalized(given.quats) * normalized(found.quats)).sum(axis=1))
    colors = (found.sh[:, 0] - given.sh[:, 0].astype(np.float64)) * (C0 * 255)
    with np.errstate(over="ignore"):
        return Losses(
            extent=extent,
            means=_ends(np.linalg.norm(found.means - means, axis=1)),
            scales=_ends(np.expm1(np.abs(logs[1] - logs[0]))[seen]),
            quats=_ends(np.degrees(2 * np.arccos(np.minimum(cosines, 1)))[seen]),
            opacities=_ends(np.abs(found.opacities - given.opacities.astype(np.float64))),
            colors=_ends(np.abs(colors)[seen]),
            harmonics=_ends(_harmonics(given, found)[seen]),
        )


def _harmonics(given: Gaussians, found: Gaussians) -> F64:
    """[N] root-mean-square error over directions, from squared coefficients, as the basis is orthonormal."""
    rest = np.zeros((len(given), max(given.sh.shape[1], found.sh.shape[1]), 3))
    rest[:, : found.sh.shape[1]] += found.sh
    rest[:, : given.sh.shape[1]] -= given.sh
    return np.asarray(255 * np.sqrt(np.square(rest[:, 1:]).sum(axis=1).mean(axis=1) / (4 * np.pi)))


def _ends(errors: F64) -> tuple[float, float]:
    """Median and largest error; 0 if there are none."""
    return (float(np.median(errors)), float(errors.max())) if errors.size else (0.0, 0.0)


def _pair(pair: tuple[float, float], factor: float = 1) -> str:
    return f"{pair[0] * factor:.2g} (at most {pair[1] * factor:.2g})"


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    *,
    is_strokes: bool = False,
    scene: str | None = None,
    first_view: FirstView | None = None,
    brushes: Sequence[str] = (),
    measures: bool = False,
) -> Losses | None:
    """Write Gaussians to a scene file, which appears when it is complete.

    Args:
        gaussians: N >= 1 Gaussians.
        path: the suffix decides the format, see `SCENE_SUFFIXES`.
        is_strokes: whether to record that the Gaussians are strokes: painting keeps all of them by default.
        scene: name of the scene that the strokes were made of, to record.
        first_view: first view of that scene, to record, so that strokes are seen by the same cameras.
        brushes: names or paths of the brushes, to record; `gaussians.brushes` are indices into them.
        measures: whether to read the file back and measure its errors, if its format rounds numbers.

    Returns:
        The errors of rounding if they were measured, else None.

    Raises:
        ValueError: if no format has the suffix, there are no Gaussians, or a value does not fit the format.
        SceneError: if the file cannot be written.
    """
    scene_format = find_written("scene", path)
    if scene_format is None:
        known = ", ".join(SCENE_SUFFIXES)
        raise ValueError(f"save: Gaussians must go to a {known} file, got {str(path)!r}; change the suffix")
    _check(gaussians, brushes)
    named = () if gaussians.brushes is None else tuple(brushes)
    stored = Stored(scene, first_view, named, is_strokes=is_strokes, antialiased=gaussians.antialiased)
    order = function_of(scene_format.write)(gaussians, path, stored)
    return measure_losses(gaussians, path, order) if measures and scene_format.rounds else None


def _check(gaussians: Gaussians, brushes: Sequence[str]) -> None:
    """Raise ValueError for Gaussians that no format can hold."""
    if not len(gaussians):
        rule = "gaussians must have at least one row, got 0"
        raise ValueError(f"save: {rule}; an empty scene cannot be read back")
    for name in ("means", "quats", "scales", "sh"):
        if np.abs(getattr(gaussians, name)).max() > np.finfo(np.float32).max:
            raise ValueError(f"save: {name} must fit float32, got larger values; shrink the scene first")
    if gaussians.brushes is not None and brushes and (row := int(gaussians.brushes.max())) >= len(brushes):
        rule = f"brushes must be rows of the {len(brushes)} that are named, got {row}"
        raise ValueError(f"save: {rule}; choose them anew")
