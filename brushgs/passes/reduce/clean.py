"""Drop floaters, and copies of rows that no picture shows."""

from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.options.choices import Clean
from brushgs.passes.form.coverage import shape_arguments
from brushgs.passes.reduce.equal_rows import equal_rows
from brushgs.values.arrays import Mask
from brushgs.values.gaussians import GAUSSIAN_COLUMNS, Gaussians

FAINT = _core.FAINT_SCENE  # scenes are haze if the 99th percentile of opacity is below this


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
        copies: [N] mask of copies of other rows that no picture shows.
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
    """Find floaters, see `floaters.hpp` of the core; Gaussians at the same place are judged together.

    Args:
        gaussians: N Gaussians, possibly with far outliers.
    """
    first, groups = equal_rows(gaussians.means)
    sure, strong, has_bodies, is_haze = _core.find_floaters(
        **shape_arguments(gaussians), first=first, groups=groups
    )
    copies = _unseen_copies(gaussians, groups)
    return FoundFloaters(_level(*sure), _level(*strong), has_bodies, is_haze, copies)


def _level(rows: NDArray[np.uint8], share: float, nearest: float, is_seen: bool) -> Level:
    return Level(rows.view(bool), share, nearest, is_seen)


def _unseen_copies(gaussians: Gaussians, places: NDArray[np.int64]) -> Mask:
    """[N] mask of rows that repeat others until no picture shows them; `places` [N] group equal positions."""
    if not _core.late_copies(places).any():
        return np.zeros(len(gaussians), bool)
    _, groups = equal_rows(*(getattr(gaussians, name) for name in GAUSSIAN_COLUMNS))
    return np.asarray(_core.late_copies(groups).view(bool))


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
