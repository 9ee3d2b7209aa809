"""Read the moments of a clip on demand, keep at most two in memory, and interpolate between them.

Undrawable rows of a moment stay, with opacity 0, so that the others keep their row numbers.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from brushgs.formats.scenes.columns import Columns, Dropped, Encoding, find_faults
from brushgs.values.arrays import Mask
from brushgs.values.correspondence import between
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class Kept:
    """All rows of a moment."""

    # [N]; undrawable rows have opacity 0 and lie at the mean position of the others
    gaussians: Gaussians
    is_broken: Mask | None = None  # [N] True for undrawable rows; None if there are none

    @property
    def is_whole(self) -> bool:
        """Whether there are rows, and all can be drawn."""
        return len(self.gaussians) > 0 and self.is_broken is None

    def without_broken(self) -> Gaussians:
        """The rows that can be drawn."""
        return self.gaussians if self.is_broken is None else self.gaussians.take(~self.is_broken)

    def placed_like(self, other: Gaussians) -> Gaussians:
        """All rows. Undrawable rows (or every row of an empty moment) take their pose from `other`, with
        opacity 0.

        Args:
            other: as many Gaussians; if the number differs, rows keep their pose.
        """
        if len(self.gaussians) == 0:
            return replace(other, opacities=np.zeros_like(other.opacities))
        if self.is_broken is None or len(other) != len(self.gaussians):
            return self.gaussians
        placed: dict[str, Any] = {
            name: np.where(self.is_broken[:, None], getattr(other, name), getattr(self.gaussians, name))
            for name in ("means", "quats", "scales")
        }
        return replace(self.gaussians, **placed)


NO_ROWS = Kept(Columns.empty(0, 1).gaussians())


def keep_rows(rows: Columns, encoding: Encoding, *, antialiased: bool) -> tuple[Kept, Dropped]:
    """All rows of a moment, and a count of those that cannot be drawn.

    `rows` are raw, as returned by `read_columns`, and are overwritten; `antialiased` as in `Gaussians`.
    """
    with np.errstate(all="ignore"):
        rows.standardize(encoding)
        is_sound, dropped = find_faults(rows, 0, rows.sh.shape[1] - 1)
        is_broken = None if is_sound is None else ~is_sound
        if is_broken is not None:
            sound = rows.means[~is_broken].astype(np.float64)
            rows.means[is_broken] = sound.mean(axis=0) if len(sound) else 0
            rows.quats[is_broken] = 1, 0, 0, 0
            rows.scales[is_broken] = -np.inf
            rows.opacities[is_broken] = -np.inf
            rows.sh[is_broken] = 0
        rows.activate(is_logit=True)
    return Kept(rows.gaussians(antialiased=antialiased), is_broken), dropped


NUM_IN_MEMORY = 2  # moments, beside the one interpolated between them
EXACT = 1e-6  # share of the time between two moments; a time nearer than this to a moment is that moment


class Moments:
    """The moments of a scene by number: an LRU cache that reads on demand and keeps the last two."""

    def __init__(self, read: Callable[[int], Kept]) -> None:
        self._read = read
        self._kept: OrderedDict[int, Kept] = OrderedDict()

    def __getitem__(self, index: int) -> Kept:
        if index not in self._kept:
            while len(self._kept) >= NUM_IN_MEMORY:
                self._kept.popitem(last=False)
            self._kept[index] = self._read(index)
        self._kept.move_to_end(index)
        return self._kept[index]

    def at(self, position: float, first: int = 0) -> Gaussians:
        """All rows at a moment or interpolated between two: 2.5 is halfway from the third to the fourth.

        Rows must correspond. Undrawable rows, and those of an empty moment, have opacity 0 and take their
        pose from the other moment, or from `first`, the index of a moment with Gaussians.
        """
        if abs(position - round(position)) < EXACT:
            kept = self[round(position)]
            return kept.gaussians if kept.is_whole else kept.placed_like(self[first].gaussians)
        before = int(position)
        one, other = self[before], self[before + 1]
        if not len(one.gaussians) and not len(other.gaussians):
            return one.placed_like(self[first].gaussians)
        placed = one.placed_like(other.gaussians), other.placed_like(one.gaussians)
        return between(*placed, position - before)

    def __getstate__(self) -> dict[str, Any]:
        """Pickle without the cached moments: scenes are sent to other processes."""
        return vars(self) | {"_kept": OrderedDict()}
