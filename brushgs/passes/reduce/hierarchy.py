"""Clusters of clusters: the coarser sets of strokes that a painting can be begun with.

Downward the levels are the rounds in which clusters were cut, see `split`. Upward from the first clusters
each level has a quarter of the next one's, by the same k-means, until there are some dozens: as many as a
painter blocks a picture in with. Every cluster of a level lies wholly in one of the level above.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.reduce.cluster import CONTRIBUTION_POWER, Grouping
from brushgs.passes.reduce.contribution import seen_areas
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.lloyd import lloyd
from brushgs.passes.reduce.pure import keep_pure

FACTOR = 4  # from level to level: a stroke gives way to so many of half its length
FEWEST = 24  # clusters of the coarsest level, about


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """Levels of clusters, the coarsest first; the last are those of the grouping.

    Attributes:
        parents: one array per level but the first: the cluster of the level above that each one lies in.
        num_clusters: of the last level.
        num_merged: how many levels lie above the first clusters, before any was cut.
    """

    parents: tuple[NDArray[np.intp], ...]
    num_clusters: int
    num_merged: int

    @classmethod
    def of(cls, grouping: Grouping, *, seed: int = 0) -> "Hierarchy":
        """The levels of a grouping: none but itself where it is small and nothing was cut."""
        parents = list(grouping.parents)
        into = _down(parents, 0, grouping.num_clusters)
        num_cut = len(parents)
        while (count := int(into.max(initial=0)) + 1) > FACTOR * FEWEST:
            strokes = grouping.merged("cover", into)
            paint = strokes.opacities * seen_areas(strokes)
            weights = np.maximum(paint / max(float(paint.max()), 1e-300), 1e-9) ** CONTRIBUTION_POWER
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
        """The cluster of a level that each cluster of the last one lies in."""
        return _down(list(self.parents), level, self.num_clusters)


def _down(parents: list[NDArray[np.intp]], level: int, num: int) -> NDArray[np.intp]:
    into = np.arange(num)
    for above in reversed(parents[level:]):
        into = above[into]
    return into
