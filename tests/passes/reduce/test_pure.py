from dataclasses import replace

import numpy as np

from brushgs.passes.reduce.cluster import cluster, group
from brushgs.still_life import still_life_camera
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, random_gaussians
from tests.scenes import still_life_of

VIEW = still_life_camera(width=80, height=60)


def in_regions(scene, num):
    """The scene with labels that have nothing to do with places: the hardest case."""
    return replace(scene, regions=np.random.default_rng(0).integers(0, num, len(scene), np.uint8))


def is_pure(labels, regions):
    pairs = np.unique(np.stack([labels, regions]), axis=1)
    return len(np.unique(pairs[0])) == pairs.shape[1]


@for_each("method", ["lloyd", "minibatch"])
@for_each("num_regions", [2, 7])
def test_no_cluster_mixes_regions_and_there_are_no_more_of_them(method, num_regions):
    scene = in_regions(random_gaussians(900, 1), num_regions)
    found = group(scene, 60, method=method)
    assert is_pure(found.labels, scene.regions)
    assert found.num_clusters <= 60
    np.testing.assert_array_equal(np.unique(found.labels), np.arange(found.num_clusters))


def test_clusters_that_views_split_are_pure_too_and_their_strokes_bear_the_region():
    scene = in_regions(still_life_of(1000), 3)
    found = group(scene, 200, views=[VIEW])
    assert found.num_split > 0
    assert is_pure(found.labels, scene.regions)
    strokes = found.merged("cover")
    np.testing.assert_array_equal(strokes.regions[found.labels], scene.regions)
    assert len(strokes) <= 200


def test_each_region_has_a_stroke_where_fewer_are_asked_for():
    scene = in_regions(random_gaussians(300, 2), 5)
    strokes = cluster(scene, 3)
    np.testing.assert_array_equal(np.sort(strokes.regions), np.arange(5))


def test_one_region_clusters_as_none_bit_for_bit():
    scene = still_life_of(1000)
    alone = replace(scene, regions=np.full(len(scene), 4, np.uint8))
    expected, found = (cluster(one, 150, views=[VIEW]) for one in (scene, alone))
    assert set(found.regions) == {4}
    assert_same(found, expected)
