"""A scene without its floaters, and without rows that repeat others so often that no picture shows them."""

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

# Of Gaussians that are equal, each that is painted at a pixel stops 1/255 of the light there or more, and a
# pixel is finished at a ten thousandth of it: what comes after 2345 of them is never seen.
MOST_COPIES = math.ceil(math.log(MIN_TRANSMITTANCE) / math.log1p(-MIN_ALPHA))
FAINT = 0.1  # 99th percentile of the opacities below which a scene is haze throughout


@dataclass(frozen=True, eq=False)
class Level:
    """The floaters that are at least so far from everything solid.

    Attributes:
        rows: [N] mask.
        share: their part of the painted area of the scene, 0 to 1.
        nearest: smallest distance to a body, in radii of the scene; infinite where there are none.
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
        strong: these and nearer ones, some thin leaves among them.
        has_bodies: whether enough of the scene is solid to tell floaters from it; if not, there are none.
        is_haze: whether the scene is faint as a whole; then nothing is dropped.
        copies: [N] mask of rows that repeat others, and that no picture shows, see `MOST_COPIES`.
    """

    sure: Level
    strong: Level
    has_bodies: bool
    is_haze: bool
    copies: Mask

    def dropped(self, clean: Clean) -> Mask:
        """[N] mask of the floaters that cleaning drops: sure ones only where they are seen."""
        match clean:
            case "sure" | "floaters" if self.sure.is_seen:
                return self.sure.rows
            case "strong" if not self.is_haze:
                return self.strong.rows
        return np.zeros(len(self.sure.rows), bool)


def find_floaters(gaussians: Gaussians) -> FoundFloaters:
    """Find Gaussians that float in the air; those at the same place are judged together.

    Args:
        gaussians: N Gaussians; far outliers do no harm.
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
    """[N] mask of equal rows beyond `MOST_COPIES` of a group; places [N] are the groups of equal places."""
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
    """The scene without its floaters and without copies that no picture shows, in the same order.

    A row is such a copy where it is equal to 2345 rows before it.

    Args:
        gaussians: N Gaussians.
        floaters: "sure" drops those that are clearly detached from everything solid, if together they can be
            seen; "strong" nearer ones too, which costs some thin leaves; "off" drops nothing. "floaters" is
            "sure": a painting drops what hangs below an object too, and there it is without that.

    Returns:
        The same object where nothing is dropped.

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
