"""Moments that are read one by one, of which at most two are in memory, and those between them."""

from collections import OrderedDict
from collections.abc import Callable
from typing import Any

from brushgs.formats.moving.between import between
from brushgs.formats.moving.kept_rows import Kept
from brushgs.values.gaussians import Gaussians

NUM_IN_MEMORY = 2  # moments; one more is that between them


class Moments:
    """The moments of a scene by number; each is read when it is asked for, and the last two are kept."""

    def __init__(self, read: Callable[[int], Kept]) -> None:
        self._read = read
        self._kept: OrderedDict[int, Kept] = OrderedDict()

    def __getitem__(self, index: int) -> Kept:
        if index in self._kept:
            self._kept.move_to_end(index)
            return self._kept[index]
        while len(self._kept) >= NUM_IN_MEMORY:
            self._kept.popitem(last=False)
        self._kept[index] = self._read(index)
        return self._kept[index]

    def at(self, position: float, first: int = 0) -> Gaussians:
        """All rows at a moment or between two, where rows correspond.

        Those that cannot be drawn, and those of a moment without Gaussians, have no opacity, and lie where
        they do in the other moment, or in the first.

        Args:
            position: number of the moment; 2.5 is halfway from the third to the fourth.
            first: a moment with Gaussians.
        """
        before = int(position)
        if position == before:
            kept = self[before]
            return kept.gaussians if kept.is_whole else kept.placed_like(self[first].gaussians)
        one, other = self[before], self[before + 1]
        if not len(one.gaussians) and not len(other.gaussians):
            return one.placed_like(self[first].gaussians)
        placed = one.placed_like(other.gaussians), other.placed_like(one.gaussians)
        return between(*placed, position - before)

    def __getstate__(self) -> dict[str, Any]:
        """For pickle, since scenes cross processes: without what is in memory."""
        return vars(self) | {"_kept": OrderedDict()}
