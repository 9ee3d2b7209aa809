import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.groups import Groups
from brushgs.passes.reduce.lloyd import assign
from tests.kit.for_each import for_each


def surface(num, seed=0):
    """Points [num, 9] near a surface, along a curve in memory, as clustering sees them."""
    rng = np.random.default_rng(seed)
    place = rng.random((num, 2))
    place = place[np.lexsort((place[:, 1], np.floor(20 * place[:, 0])))]
    noise = 0.01 * rng.normal(size=(num, 9))
    return (np.concatenate([place, np.sin(4 * place @ rng.normal(size=(2, 7)))], axis=1) + noise).astype("f4")


def noise(num, width=9, seed=0):
    return np.random.default_rng(seed).normal(size=(num, width)).astype(np.float32)


WORKLOADS = {
    "surface": (surface(4000), 60),
    "large groups": (surface(4000), 3),
    "one group": (surface(500), 1),
    "tiny groups": (surface(1000), 400),
    "noise": (noise(3000), 200),  # the lists of neighbours are never long enough
    "one dimension": (noise(2000, 1), 50),
    "sixteen dimensions": (noise(2000, 16), 50),
    "equal points": (np.repeat(noise(40), 50, axis=0), 40),
}


@for_each("name", WORKLOADS)
@for_each("moved", [0.0, 0.02, 5.0])
@for_each("num_threads", [1, 3])
def test_centres_that_moved_are_found_again_bit_for_bit(name, moved, num_threads):
    points, k = WORKLOADS[name]
    rng = np.random.default_rng(1)
    before = points[rng.choice(len(points), k, replace=False)].astype(np.float64)
    members = Groups.of(assign(points, before)[1], k)
    centers = before + moved * rng.normal(size=before.shape)
    distances, nearest = _core.nearest_again(points, centers, members.rows, members.begins, num_threads)
    expected = assign(points, centers)
    np.testing.assert_array_equal(distances, expected[0])
    np.testing.assert_array_equal(nearest, expected[1])


def test_of_equally_near_centres_the_first_is_found_again():
    points = np.repeat(np.arange(6, dtype=np.float32)[:, None], 20, axis=0)
    centers = np.array([[1.0], [3.0], [1.0], [5.0], [3.0]])
    members = Groups.of(np.arange(120) % 5, 5)
    nearest = _core.nearest_again(points, centers, members.rows, members.begins, 2)[1]
    np.testing.assert_array_equal(nearest.reshape(6, 20)[:, 0], [0, 0, 0, 1, 1, 3])
    np.testing.assert_array_equal(nearest, assign(points, centers)[1])


@for_each("name", [name for name in WORKLOADS if name != "one group"])
@for_each("num_first", [1, 20])
@for_each("num_threads", [1, 3])
def test_what_is_nearer_replaces_what_was_nearest(name, num_first, num_threads):
    points, k = WORKLOADS[name]
    first = min(num_first, k - 1)
    rng = np.random.default_rng(2)
    centers = points[rng.choice(len(points), k, replace=False)].astype(np.float64)
    old, added = centers[:first], centers[first:]
    distances, nearest = assign(points, old)
    members = Groups.of(nearest, first)
    _core.nearer(points, old, members.rows, members.begins, added, first, distances, nearest, num_threads)
    expected = assign(points, centers)
    np.testing.assert_array_equal(distances, expected[0])
    np.testing.assert_array_equal(nearest, expected[1])
