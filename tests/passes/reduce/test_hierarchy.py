"""Clusters of clusters: each lies wholly in one of the level above, from some dozens on."""

from itertools import pairwise

import numpy as np

from brushgs.cameras.around import small_view
from brushgs.cameras.framing import frame_scene
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.hierarchy import FACTOR, FEWEST, Hierarchy
from tests.scenes import still_life_of

SCENE = still_life_of(4000)


def test_each_cluster_lies_wholly_in_one_of_the_level_above():
    grouping = group(SCENE, 800, views=[small_view(frame_scene(SCENE, width=160, height=120))])
    tree = Hierarchy.of(grouping)
    counts = [int(tree.groups(level).max()) + 1 for level in range(len(tree))]
    assert counts[-1] == grouping.num_clusters == len(tree.groups(len(tree) - 1))
    for level, parents in enumerate(tree.parents):
        assert np.array_equal(np.unique(parents), np.arange(counts[level]))
        assert np.array_equal(parents[tree.groups(level + 1)], tree.groups(level))
    merged = counts[: tree.num_merged + 1]  # levels above the first clusters have a quarter of the next
    assert merged[-1] == grouping.num_clusters - grouping.num_split
    assert FEWEST <= merged[0] <= FACTOR * FEWEST
    assert all(few <= many // FACTOR for few, many in pairwise(merged))
    assert len(grouping.parents) == len(tree.parents) - tree.num_merged > 1  # rounds of splitting are levels
    assert sum(len(parents) - int(parents.max()) - 1 for parents in grouping.parents) == grouping.num_split
    assert all(np.bincount(parents).max() == 2 for parents in grouping.parents)
    coarse = grouping.merged("cover", tree.groups(0))
    assert len(coarse) == counts[0]
    low, high = SCENE.means.min(axis=0) - 1e-4, SCENE.means.max(axis=0) + 1e-4
    assert ((coarse.means > low) & (coarse.means < high)).all()


def test_few_clusters_that_were_never_cut_are_the_only_level():
    tree = Hierarchy.of(group(SCENE, 50))
    assert (len(tree), tree.num_merged) == (1, 0)
    assert np.array_equal(tree.groups(0), np.arange(tree.num_clusters))
