import numpy as np
import pytest
from scipy.spatial import cKDTree

from brushgs.core.native import core as _core
from brushgs.passes.reduce.merge import merge_clusters
from tests.kit.for_each import for_each
from tests.passes.scenes import covariances, random_gaussians, replaced

PLANE = 1.2  # of gaps.hpp


def growth(means, scales, axes, opacities):
    return _core.growth(means, scales, np.ascontiguousarray(axes), opacities, 2)


def discs(means, size, *, opacity=1.0):
    """Columns of discs whose normal is z."""
    num = len(means)
    axes = np.tile(np.eye(3)[:, [2, 0, 1]], (num, 1, 1))
    return means, np.tile([0.1 * size, size, size], (num, 1)), axes, np.full(num, opacity)


def lattice(side=12):
    x, y = np.meshgrid(np.arange(side) * 1.0, np.arange(side) * 1.0)
    return np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1)


def test_strokes_of_a_single_layer_grow_and_those_of_several_do_not():
    places, size = lattice(), 0.34
    found = growth(*discs(places, size))
    assert np.median(found) == pytest.approx(PLANE)
    assert found.min() == pytest.approx(0.75 * PLANE)  # a corner has three neighbors
    layers = np.concatenate([places, places + np.array([0.5, 0.5, 0.1]), places + np.array([0, 0, 0.2])])
    found = growth(*discs(layers, size))
    assert found[:144].max() == found[288:].max() == np.median(found) == 0  # the middle layer has an edge
    for alone in (discs(places, size, opacity=0.3), discs(100 * places, size)):
        assert growth(*alone).max() == 0  # faint, or without neighbors


def test_merging_without_an_overlap_grows_a_layer_and_with_one_does_not():
    flat = random_gaussians(1200)
    places = np.stack([*np.random.default_rng(0).uniform(-1, 1, (2, 1200)), np.zeros(1200)], axis=1)
    flat = replaced(flat, means=places, scales=np.full((1200, 3), 0.04), opacities=np.full(1200, 0.97))
    labels = (np.floor(3 * places[:, 0]) * 10 + np.floor(3 * places[:, 1])).astype(int)
    given, grown = merge_clusters(flat, labels, overlap=1.35), merge_clusters(flat, labels)
    more = np.sqrt(
        np.linalg.det(covariances(grown)[:, :2, :2]) / np.linalg.det(covariances(given)[:, :2, :2])
    )
    assert more.min() > 1.3
    np.testing.assert_array_equal(grown.opacities, given.opacities)


@for_each("num_threads", [1, 3])
def test_neighbours_are_those_of_scipy(num_threads):
    points = np.random.default_rng(0).normal(size=(3000, 3))
    rows = np.empty((3000, 12), dtype=np.int32)
    _core.neighbors(points, rows, num_threads)
    np.testing.assert_array_equal(rows, cKDTree(points).query(points, 13)[1][:, 1:])
