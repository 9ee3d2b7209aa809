"""Drop floaters, and copies of rows that no picture shows."""

import math
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.options.choices import Clean
from brushgs.passes.reduce.equal_rows import equal_rows
from brushgs.passes.reduce.floaters import STRONG_GAP, SURE_GAP, VISIBLE, measure_detachment
from brushgs.rendering.constants import MIN_ALPHA, MIN_TRANSMITTANCE
from brushgs.values.arrays import Mask
from brushgs.values.gaussians import GAUSSIAN_COLUMNS, Gaussians

# Each of several equal Gaussians stops at least 1/255 of the light of a pixel, and a pixel is finished at
# 1e-4: copies after the first 2345 are never visible.
MOST_COPIES = math.ceil(math.log(MIN_TRANSMITTANCE) / math.log1p(-MIN_ALPHA))
FAINT = 0.1  # scenes are haze if the 99th percentile of opacity is below this


@dataclass(frozen=True, eq=False)
class Level:
    """Floaters beyond a distance from everything solid.

    Attributes:
        rows: [N] mask.
        share: of the scene's painted area, 0 to 1.
        nearest: smallest distance to a body, in radii of the scene; infinite without floaters.
        is_seen: whether they cover enough to be noticed.
    """

    rows: Mask
    share: float
    nearest: float
    is_seen: bool


@dataclass(frozen=True, eq=False)
class FoundFloaters:
    """Floaters of a scene.

    Attributes:
        sure: clearly detached from everything solid.
        strong: these and closer ones, including some thin leaves.
        has_bodies: whether enough of the scene is solid to detect floaters; if not, there are none.
        is_haze: whether the whole scene is faint; then nothing is dropped.
        copies: [N] mask of copies of other rows that no picture shows, see `MOST_COPIES`.
    """

    sure: Level
    strong: Level
    has_bodies: bool
    is_haze: bool
    copies: Mask

    def dropped(self, clean: Clean) -> Mask:
        """[N] mask of the floaters to drop: sure ones only if they are noticeable."""
        match clean:
            case "sure" | "floaters" if self.sure.is_seen:
                return self.sure.rows
            case "strong" if not self.is_haze:
                return self.strong.rows
        return np.zeros(len(self.sure.rows), bool)


def find_floaters(gaussians: Gaussians) -> FoundFloaters:
    """Find floaters; Gaussians at the same place are judged together.

    Args:
        gaussians: N Gaussians, possibly with far outliers.
    """
    first, groups = equal_rows(gaussians.means)
    detached = measure_detachment(gaussians.take(first))
    is_haze = bool(len(gaussians) > 0 and np.percentile(gaussians.opacities, 99) < FAINT)
    has_bodies = detached.has_bodies

    def level(gap: float) -> Level:
        is_far = detached.beyond(gap) & has_bodies
        area, total = float(detached.areas[is_far].sum()), float(detached.areas.sum())
        nearest = float(detached.gaps[is_far].min(initial=np.inf))
        rows: NDArray[np.bool_] = is_far[groups]
        return Level(rows, area / max(total, 1e-300), nearest, area >= VISIBLE and not is_haze)

    return FoundFloaters(
        level(SURE_GAP), level(STRONG_GAP), has_bodies, is_haze, _unseen_copies(gaussians, groups)
    )


def _unseen_copies(gaussians: Gaussians, places: NDArray[np.int64]) -> Mask:
    """[N] mask of equal rows beyond the first `MOST_COPIES`; `places` [N] group equal positions."""
    is_unseen = np.zeros(len(gaussians), bool)
    rows = np.flatnonzero((np.bincount(places) > MOST_COPIES)[places])
    if not len(rows):
        return is_unseen
    some = gaussians.take(rows)
    _, groups = equal_rows(*(getattr(some, name) for name in GAUSSIAN_COLUMNS))
    order = np.argsort(groups, kind="stable")
    counts = np.bincount(groups)
    ranks = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    is_unseen[rows[order[ranks >= MOST_COPIES]]] = True
    return is_unseen


def clean(gaussians: Gaussians, floaters: Clean = "sure") -> Gaussians:
    """Drop floaters, and copies that no picture shows (rows equal to 2345 rows before them); the order stays.

    Args:
        gaussians: N Gaussians.
        floaters: "sure" drops those clearly detached from everything solid, if together they are noticeable;
            "strong" closer ones too, which costs some thin leaves; "off" none. "floaters" is the same as
            "sure" here (in a painting "sure" also drops crumbs below an object).

    Returns:
        The input itself if nothing is dropped.

    Raises:
        ValueError: if `floaters` is none of these.

    Example:
        >>> cleaned = bg.clean(gaussians)
        >>> len(cleaned) <= len(gaussians)
        True
    """
    if floaters not in get_args(Clean):
        raise ValueError(f"clean: floaters must be {', '.join(get_args(Clean))}, got {floaters!r}")
    if floaters == "off":
        return gaussians
    found = find_floaters(gaussians)
    rows = found.dropped(floaters) | found.copies
    return gaussians.take(~rows) if rows.any() else gaussians
