from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.passes.reduce.cluster import choose_method, cluster, group
from brushgs.passes.reduce.features import cluster_features
from brushgs.passes.reduce.morton import morton_order
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians, replaced

METHODS = ["lloyd", "minibatch"]


def partition(labels):
    """The groups of rows, whatever their names."""
    return {tuple(np.flatnonzero(labels == label)) for label in np.unique(labels)}


def islands(num=8, each=25, seed=0):
    """Groups of Gaussians that lie far apart."""
    scene = random_gaussians(num * each, seed, size=0.01)
    corners = np.array(list(np.ndindex(2, 2, 2)))[np.arange(num * each) % num]
    return replaced(scene, means=10.0 * corners + 0.01 * scene.means, sh=np.zeros_like(scene.sh))


@settings(deadline=None, max_examples=40)
@given(
    st.integers(0, 120),
    st.integers(1, 130),
    st.integers(0, 99),
    st.sampled_from(["balanced", "paper"]),
    st.sampled_from(["cover", "paper"]),
)
def test_at_most_k_strokes_come_back_and_k_of_n_or_more_give_the_input(n, k, seed, features, merge):
    scene = replace(random_gaussians(n, seed), antialiased=bool(seed % 2))
    strokes = cluster(scene, k, features=features, merge=merge, method="lloyd", seed=seed)
    assert min(n, 1) <= len(strokes) <= k
    assert strokes.antialiased == scene.antialiased
    if k >= n:
        assert strokes is scene


@for_each("method", METHODS)
def test_islands_are_found_and_labels_are_dense(method):
    found = group(islands(), 8, method=method)
    assert partition(found.labels) == partition(np.arange(200) % 8)
    np.testing.assert_array_equal(np.unique(found.labels), np.arange(found.num_clusters))
    assert (found.method, found.reason) == (method, "asked for")
    assert found.num_steps >= 1
    assert found.inertia > 0
    assert group(random_gaussians(50), 5).reason == choose_method(50, 5)[1]
    assert choose_method(300_000, 7000)[0] == "lloyd"
    assert "43 points a cluster" in choose_method(300_000, 7000)[1]


def test_strays_at_the_end_of_the_world_do_not_take_the_clusters():
    scene = random_gaussians(3000, dtype=np.float32, size=0.02)
    strays = 2e7 * np.random.default_rng(0).choice([-1, 1], (20, 3))
    scene = replaced(scene, means=np.concatenate([strays.astype(np.float32), scene.means[20:]]))
    strokes = cluster(scene, 100)
    near = np.abs(strokes.means).max(axis=1) < 10
    assert near.sum() >= 80
    assert strokes.scales[near].max() < 2


def test_published_features_are_raw():
    scene = random_gaussians(100)
    expected = np.hstack([scene.means, scene.scales, base_colors(scene.sh)])
    np.testing.assert_allclose(cluster_features(scene, "paper"), expected, rtol=1e-6)


def morton_code(cell):
    """The bits of three whole numbers, interleaved: the slow way."""
    return sum((int(cell[axis]) >> bit & 1) << (3 * bit + axis) for bit in range(21) for axis in range(3))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_morton_order_is_that_of_interleaved_bits(dtype):
    points = np.random.default_rng(0).normal(size=(500, 3)).astype(dtype)
    points = np.concatenate([points, points[:50] + dtype(1e-6), points[:20]])  # share bits, or are equal
    low = points.min(axis=0).astype(np.float64)
    cells = ((points - low) * ((2**21 - 1) / float((points.max(axis=0) - low).max()))).astype(np.int64)
    codes = np.array([morton_code(cell) for cell in cells])
    np.testing.assert_array_equal(morton_order(points), np.argsort(codes, kind="stable"))


@for_each(
    ("options", "error", "message"),
    [
        ({"num_strokes": 0}, ValueError, "cluster: num_strokes must be >= 1, got 0"),
        ({"num_strokes": 2.5}, TypeError, "cluster: num_strokes must be an integer, got float"),
        ({"seed": -1}, ValueError, "cluster: seed must be in 0 to 4294967295, got -1"),
        ({"seed": 2**32}, ValueError, "cluster: seed must be in 0 to 4294967295, got 4294967296"),
        ({"seed": "a"}, TypeError, "cluster: seed must be an integer, got str"),
        ({"features": "raw"}, ValueError, "cluster: features must be one of balanced, paper, got 'raw'"),
        ({"merge": "mean"}, ValueError, "cluster: merge must be one of cover, paper, got 'mean'"),
        ({"method": "kd"}, ValueError, "cluster: method must be one of auto, lloyd, minibatch, got 'kd'"),
    ],
)
def test_bad_arguments_are_refused_by_name(options, error, message):
    with pytest.raises(error, match=message):
        cluster(random_gaussians(9), **({"num_strokes": 3} | options))


@pytest.mark.parametrize("method", METHODS)
def test_what_moves_otherwise_is_in_another_cluster(method):
    is_second = np.arange(400) % 2 == 1
    motion = np.zeros((400, 7), np.float32)
    motion[is_second, 3] = 20
    labels = group(random_gaussians(400), 10, method=method, motion=motion).labels
    assert not set(labels[is_second]) & set(labels[~is_second])
