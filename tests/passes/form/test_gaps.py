import numpy as np
import pytest
from scipy.spatial import cKDTree

from brushgs.core.native import core as _core
from brushgs.passes.reduce.merge import merge_clusters
from tests.kit.for_each import for_each
from tests.passes.scenes import covariances, gaussians_at, grid

PLANE = 1.2  # of gaps.hpp


def growth(means, *, opacity=1.0):
    """Of discs of size 0.34 whose normal is z."""
    axes = np.tile(np.eye(3)[:, [2, 0, 1]], (len(means), 1, 1))
    sizes = np.tile([0.034, 0.34, 0.34], (len(means), 1))
    return _core.growth(means, sizes, np.ascontiguousarray(axes), np.full(len(means), opacity), 2)


def test_strokes_of_a_single_layer_grow_and_those_of_several_do_not():
    places = grid(12, 5.5)
    found = growth(places)
    assert np.median(found) == pytest.approx(PLANE)
    assert found.min() == pytest.approx(0.75 * PLANE)  # a corner has three neighbors
    layers = np.concatenate([places, places + np.array([0.5, 0.5, 0.1]), places + np.array([0, 0, 0.2])])
    found = growth(layers)
    assert found[:144].max() == found[288:].max() == np.median(found) == 0  # the middle layer has an edge
    assert growth(places, opacity=0.3).max() == growth(100 * places).max() == 0  # faint, or apart


def test_merging_without_an_overlap_grows_a_layer_and_with_one_does_not():
    places = np.random.default_rng(0).uniform(-1, 1, (1200, 3)) * (1, 1, 0)
    flat = gaussians_at(places, 0.04, opacity=0.97)
    labels = (np.floor(3 * places[:, 0]) * 10 + np.floor(3 * places[:, 1])).astype(int)
    given, grown = merge_clusters(flat, labels, overlap=1.35), merge_clusters(flat, labels)
    areas = [np.sqrt(np.linalg.det(covariances(one)[:, :2, :2])) for one in (given, grown)]
    assert (areas[1] / areas[0]).min() > 1.3
    np.testing.assert_array_equal(grown.opacities, given.opacities)


@for_each("num_threads", [1, 3])
def test_neighbours_are_those_of_scipy(num_threads):
    points = np.random.default_rng(0).normal(size=(3000, 3))
    rows = np.empty((3000, 12), dtype=np.int32)
    _core.neighbors(points, rows, num_threads)
    np.testing.assert_array_equal(rows, cKDTree(points).query(points, 13)[1][:, 1:])
