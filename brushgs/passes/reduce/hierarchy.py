"""Clusters of clusters: coarser sets of strokes for the beginning of a painting.

Below the first clusters the levels are the rounds of splitting, see `split`. Above them each level has a
quarter of the clusters of the next, by the same k-means, down to a few dozen, the number for blocking in a
picture. Every cluster lies completely in one cluster of the level above.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.passes.reduce.cluster import Grouping
from brushgs.passes.reduce.contribution import seen_areas
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.lloyd import lloyd
from brushgs.passes.reduce.pure import keep_pure

FACTOR = 4  # from level to level: a stroke is replaced by this many of half its length
FEWEST = 24  # clusters of the coarsest level, about


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels of clusters, coarsest first; the last level is the grouping.

    Attributes:
        parents: one array per level except the first: the parent of each cluster in the level above.
        num_clusters: of the last level.
        num_merged: number of levels above the first clusters, before any was cut.
    """

    parents: tuple[NDArray[np.intp], ...]
    num_clusters: int
    num_merged: int

    @classmethod
    def of(cls, grouping: Grouping, *, seed: int = 0) -> "Hierarchy":
        """The levels of a grouping: only itself if it is small and nothing was cut."""
        parents = list(grouping.parents)
        into = _down(parents, 0, grouping.num_clusters)
        num_cut = len(parents)
        while (count := int(into.max(initial=0)) + 1) > FACTOR * FEWEST:
            strokes = grouping.merged("cover", into)
            paint = strokes.opacities * seen_areas(strokes)
            weights = np.maximum(paint / max(float(paint.max()), 1e-300), 1e-9) ** _core.CONTRIBUTION_POWER
            points = cluster_features(strokes)
            found = lloyd(points, weights, count // FACTOR, seed=seed)
            found = keep_pure(found, points, weights, strokes, count // FACTOR)
            if found.num_clusters >= count:
                break
            above = found.labels.astype(np.intp)
            parents.insert(0, above)
            into = above[into]
        return cls(tuple(parents), grouping.num_clusters, len(parents) - num_cut)

    def __len__(self) -> int:
        return len(self.parents) + 1

    def groups(self, level: int) -> NDArray[np.intp]:
        """The cluster of a level for each cluster of the last level."""
        return _down(list(self.parents), level, self.num_clusters)


def _down(parents: list[NDArray[np.intp]], level: int, num: int) -> NDArray[np.intp]:
    into = np.arange(num)
    for above in reversed(parents[level:]):
        into = above[into]
    return into
