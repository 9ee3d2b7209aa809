"""The strokes of a painting and the coarser strokes before them, level by level.

Each level is a complete painting: each of its clusters is merged and goes through the same passes as the
strokes of the finished painting. A cluster that is never cut is its finished stroke from its first level on.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from brushgs.passes.reduce.cluster import Grouping
from brushgs.passes.reduce.hierarchy import Hierarchy
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.values.arrays import Mask, Rows
from brushgs.values.gaussians import Gaussians

NONE = -1  # in place of a row


@dataclass(frozen=True, eq=False)
class Layers:
    """Strokes of all levels, N, and which strokes replace which.

    Attributes:
        strokes: those of the finished painting, then those that are painted over.
        num_finished: number of strokes of the finished painting.
        levels: rows of the strokes of each level, coarsest first; the last level is the finished painting.
        level_of: [N] level at which a stroke appears.
        parents: [N] the row that a stroke replaces, together with others; `NONE` if it replaces none.
        broods: [N] equal for strokes that appear together.
        num_merged: number of levels coarser than the first clusters of the scene.
    """

    strokes: Gaussians
    num_finished: int
    levels: tuple[Rows, ...]
    level_of: Rows
    parents: Rows
    broods: Rows
    num_merged: int

    @classmethod
    def flat(cls, strokes: Gaussians) -> "Layers":
        """Strokes without coarser ones."""
        rows = np.arange(len(strokes))
        return cls(strokes, len(rows), (rows,), np.zeros_like(rows), np.full_like(rows, NONE), rows, 0)

    @classmethod
    def of(
        cls,
        strokes: Gaussians,
        grouping: Grouping,
        maker: StrokeMaker,
        finish: Callable[[Gaussians], Gaussians],
    ) -> "Layers":
        """Strokes of a scene with all coarser strokes.

        Args:
            strokes: of the finished painting, made by `maker` and then changed by `finish`.
            grouping: of the scene, as `maker` returned it.
            maker: makes the coarser ones.
            finish: later changes to strokes, such as a palette.
        """
        tree = Hierarchy.of(grouping, seed=maker.cluster.seed)
        finished, clusters = maker.of_groups(grouping, most=len(strokes))
        if len(finished) != len(strokes) or len(clusters) != len(strokes):
            return cls.flat(strokes)  # a pass has dropped unknown rows
        at_end = np.full(grouping.num_clusters, NONE)
        at_end[clusters] = np.arange(len(strokes))
        growing = _Growing(strokes, at_end)
        for level in range(len(tree)):
            into, above = tree.groups(level), tree.parents[level - 1] if level else None
            num = int(into.max(initial=-1)) + 1
            if growing.needs_coarser(into, above, num):
                coarser, groups = maker.of_groups(grouping, into, most=num)
                growing.add(into, above, num, finish(coarser), groups)
            else:
                growing.add(into, above, num)
        return growing.layers(tree.num_merged)


class _Growing:
    """Builds layers, from the coarsest level to the last."""

    def __init__(self, strokes: Gaussians, at_end: Rows) -> None:
        self._parts, self._at_end = [strokes], at_end
        self._num_finished = self._num = len(strokes)
        self._levels: list[Rows] = []  # the row of each cluster of a level
        self._came: list[tuple[Rows, int, Rows, Rows]] = []  # rows, their level, parents and broods
        self._num_broods = 0

    def needs_coarser(self, into: Rows, above: Rows | None, num: int) -> bool:
        return bool((~self._is_whole(into, num) & self._is_new(above, num)).any())

    def add(
        self,
        into: Rows,
        above: Rows | None,
        num: int,
        coarser: Gaussians | None = None,
        groups: Rows | None = None,
    ) -> None:
        """Add a level: `into` as `Hierarchy.groups`, `above` as its parents, coarser strokes of groups."""
        is_whole, is_new = self._is_whole(into, num), self._is_new(above, num)
        rows = np.full(num, NONE)
        rows[into] = np.where(is_whole[into], self._at_end, NONE)
        if above is not None:
            rows[~is_new] = self._levels[-1][above[~is_new]]
        if coarser is not None and groups is not None:
            made = is_new[groups] & ~is_whole[groups]
            rows[groups[made]] = self._num + np.arange(np.count_nonzero(made))
            self._parts.append(coarser.take(made))
            self._num += int(np.count_nonzero(made))
        drawn = np.flatnonzero(is_new & (rows != NONE))
        if above is None:
            parents, broods, num_broods = np.full(len(drawn), NONE), np.arange(len(drawn)), len(drawn)
        else:
            parents, broods, num_broods = self._levels[-1][above[drawn]], above[drawn], len(self._levels[-1])
        self._came.append((rows[drawn], len(self._levels), parents, broods + self._num_broods))
        self._num_broods += num_broods
        self._levels.append(rows)

    def layers(self, num_merged: int) -> Layers:
        level_of, parents, broods = (np.full(self._num, NONE) for _ in range(3))
        for rows, level, replaced, together in self._came:
            level_of[rows], parents[rows], broods[rows] = level, replaced, together
        levels = tuple(rows[rows != NONE] for rows in self._levels)
        strokes = Gaussians.joined(self._parts)
        return Layers(strokes, self._num_finished, levels, level_of, parents, broods, num_merged)

    def _is_whole(self, into: Rows, num: int) -> Mask:
        """Mask of the clusters of a level that are never cut."""
        return np.asarray(np.bincount(into, minlength=num) == 1)

    def _is_new(self, above: Rows | None, num: int) -> Mask:
        """Mask of the clusters that were not clusters in the level above."""
        if above is None:
            return np.ones(num, bool)
        return np.asarray((np.bincount(above) > 1)[above])
