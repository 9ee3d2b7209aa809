import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import at_most
from brushgs.passes.groups import Groups
from brushgs.passes.reduce.lloyd import assign, lloyd
from brushgs.passes.reduce.morton import morton_order
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
    "noise": (noise(3000), 200),  # the lists of neighbors are never long enough
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


def nearest_of(points, centers):
    """The slow way: squared distances [N], and the first nearest center of each point [N]."""
    squared = ((points[:, None].astype(np.float64) - centers) ** 2).sum(axis=2)
    return squared.min(axis=1), squared.argmin(axis=1)


def start_of(points, weights, k, seed):
    rng, centers, squared = np.random.default_rng(seed), np.zeros((0, points.shape[1])), np.ones(len(points))
    shares = [0.4, 0.3, 0.3] if k > 32 else np.full(k, 1 / k)
    for target in [*np.rint(np.cumsum(shares) * k).astype(int), *[k] * 8]:
        if not squared.any() or target == len(centers):
            break
        mass, count = np.cumsum(weights * squared), target - len(centers)
        rows = np.searchsorted(mass, (np.arange(count) + rng.random()) * (mass[-1] / count))
        chosen = points[np.minimum(rows, len(points) - 1)]
        first = np.sort(np.unique(chosen, axis=0, return_index=True)[1])
        centers = np.concatenate([centers, chosen[first]])
        squared = nearest_of(points, centers)[0]
    return centers


def lloyd_of(points, weights, k, seed, num_steps, gain):
    """Labels, the number of steps and the inertia, and how many clusters were ever empty."""
    order = morton_order(points[:, :3])
    points, weights = points[order], weights[order]
    centers = start_of(points, weights, k, seed)
    squared, nearest = nearest_of(points, centers)
    before, steps, num_empty = np.inf, 0, 0
    while steps < num_steps and (weights * squared).sum() < (1 - gain) * before:
        errors, used = weights * squared, np.unique(nearest)
        before, steps, num_empty = errors.sum(), steps + 1, num_empty + len(centers) - len(used)
        for label in used:
            centers[label] = np.average(points[nearest == label], axis=0, weights=weights[nearest == label])
        empty = np.setdiff1d(np.arange(len(centers)), used)
        centers[empty] = points[np.argsort(-errors, kind="stable")[: len(empty)]]
        squared, nearest = nearest_of(points, centers)
    labels = np.empty(len(points), int)
    labels[order] = np.unique(nearest, return_inverse=True)[1]
    return labels, steps, (weights * squared).sum(), num_empty


# Of three centers at -3.5, 1 and 2.4 the one in the middle loses its points to both sides.
SQUEEZED = np.array([-3.5, -1.3, -1.31, -1.32, -1.33, -1, 1, 1.75, 1.76, 1.77, 1.78, 2.4], "f4")[:, None]
SMALL = {
    "surface": (surface(1000), 40),
    "large groups": (surface(1000), 3),
    "tiny groups": (surface(300), 120),
    "one dimension": (noise(400, 1), 20),
    "equal points": (np.repeat(noise(40), 10, axis=0), 40),
}


@for_each("name", SMALL)
@for_each("seed", [0, 7])
def test_lloyd_is_its_slow_twin(name, seed):
    points, k = SMALL[name]
    weights = np.random.default_rng(seed).random(len(points)) ** 2 + 1e-3
    found = lloyd(points, weights, k, seed=seed, num_steps=6)
    labels, steps, inertia, _ = lloyd_of(points, weights, k, seed, 6, 1e-3)
    np.testing.assert_array_equal(found.labels, labels)
    assert found.num_clusters == labels.max() + 1
    assert found.num_steps == steps
    np.testing.assert_allclose(found.inertia, inertia, rtol=1e-12, atol=1e-25)


def test_an_empty_cluster_goes_to_the_largest_error():
    labels, steps, _, num_empty = lloyd_of(SQUEEZED, np.ones(12), 3, 1, 20, 1e-9)
    assert num_empty > 0
    found = lloyd(SQUEEZED, np.ones(12), 3, seed=1, gain=1e-9)
    np.testing.assert_array_equal(found.labels, labels)
    assert (found.num_clusters, found.num_steps) == (3, steps)


def test_lloyd_is_the_same_in_any_number_of_threads():
    points = surface(4000)
    with at_most(1):
        expected = lloyd(points, np.ones(4000), 60)
    with at_most(3):
        found = lloyd(points, np.ones(4000), 60)
    np.testing.assert_array_equal(found.labels, expected.labels)
    assert found[1:] == expected[1:]
