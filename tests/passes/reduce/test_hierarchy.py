"""Clusters of clusters: each lies wholly in one of the level above, from some dozens on."""

from itertools import pairwise

import numpy as np
import pytest

from brushgs.cameras.around import small_view
from brushgs.cameras.framing import frame_scene
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.hierarchy import FACTOR, FEWEST, Hierarchy
from tests.scenes import still_life_of

SCENE = still_life_of(4000)


@pytest.fixture(scope="module")
def grouping():
    return group(SCENE, 800, views=[small_view(frame_scene(SCENE, width=160, height=120))])


def test_each_cluster_lies_wholly_in_one_of_the_level_above(grouping):
    tree = Hierarchy.of(grouping)
    counts = [int(tree.groups(level).max()) + 1 for level in range(len(tree))]
    assert counts[-1] == grouping.num_clusters == len(tree.groups(len(tree) - 1))
    assert (np.diff(counts) > 0).all()
    for level, parents in enumerate(tree.parents):
        assert np.array_equal(np.unique(parents), np.arange(counts[level]))
        assert np.array_equal(parents[tree.groups(level + 1)], tree.groups(level))


def test_levels_above_the_first_clusters_have_a_quarter_of_the_next(grouping):
    tree = Hierarchy.of(grouping)
    counts = [int(tree.groups(level).max()) + 1 for level in range(tree.num_merged + 1)]
    assert counts[-1] == grouping.num_clusters - grouping.num_split
    assert FEWEST <= counts[0] <= FACTOR * FEWEST
    assert all(few <= many // FACTOR for few, many in pairwise(counts))


def test_rounds_of_splitting_are_levels(grouping):
    tree = Hierarchy.of(grouping)
    assert len(grouping.parents) == len(tree.parents) - tree.num_merged > 1
    cut = [len(parents) - int(parents.max()) - 1 for parents in grouping.parents]
    assert sum(cut) == grouping.num_split
    assert all(np.bincount(parents).max() == 2 for parents in grouping.parents)


def test_a_coarser_level_is_merged_of_the_same_gaussians(grouping):
    tree = Hierarchy.of(grouping)
    coarse = grouping.merged("cover", tree.groups(0))
    assert len(coarse) == int(tree.groups(0).max()) + 1
    low, high = SCENE.means.min(axis=0) - 1e-4, SCENE.means.max(axis=0) + 1e-4
    assert ((coarse.means > low) & (coarse.means < high)).all()


def test_few_clusters_that_were_never_cut_are_the_only_level():
    tree = Hierarchy.of(group(SCENE, 50))
    assert (len(tree), tree.num_merged) == (1, 0)
    assert np.array_equal(tree.groups(0), np.arange(tree.num_clusters))
