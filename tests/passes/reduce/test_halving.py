from itertools import pairwise

import numpy as np
import pytest

from brushgs.passes.reduce.halving import halve


def cloud(num=3000, dims=9, seed=1):
    chance = np.random.default_rng(seed)
    return chance.normal(size=(num, dims)).astype(np.float32), chance.uniform(0.1, 1, num)


def inertia_of(points, weights, labels):
    mass = np.bincount(labels, weights)
    total = 0.0
    for column in points.astype(float).T:
        means = np.bincount(labels, weights * column) / mass
        total += float((weights * (column - means[labels]) ** 2).sum())
    return total


def test_there_are_as_many_cells_as_asked_for_each_in_use():
    points, weights = cloud()
    counts = [1, 2, 3, 50, 700, 3000]
    for count, labels in zip(counts, halve(points, weights, counts), strict=True):
        assert np.array_equal(np.unique(labels), np.arange(count))


def test_partitions_are_nested():
    points, weights = cloud()
    partitions = halve(points, weights, [5, 40, 41, 900])
    for coarse, fine in pairwise(partitions):
        for cell in range(fine.max() + 1):
            assert len(np.unique(coarse[fine == cell])) == 1


def test_more_cells_never_fit_worse():
    points, weights = cloud()
    errors = [inertia_of(points, weights, labels) for labels in halve(points, weights, [1, 4, 16, 64, 256])]
    assert all(finer < coarser for coarser, finer in pairwise(errors))


def test_separate_heaps_are_separated():
    chance = np.random.default_rng(0)
    heap = np.repeat(np.arange(8), 50)
    corners = np.stack([heap >> axis & 1 for axis in range(3)], axis=1)
    points = (100 * corners + chance.normal(size=(400, 3))).astype(np.float32)
    (labels,) = halve(points, np.ones(400), [8])
    assert len(set(zip(heap, labels, strict=True))) == 8


def test_equal_points_stay_together():
    points = np.repeat(np.arange(3, dtype=np.float32), 4)[:, None]
    (labels,) = halve(points, np.ones(12), [10])
    assert labels.max() == 2
    assert (labels.reshape(3, 4) == labels.reshape(3, 4)[:, :1]).all()


def test_far_from_the_origin_cells_are_the_same():
    points, weights = cloud(dims=3)
    points = np.round(points * 64) / 64
    near, far = (halve(points + shift, weights, [64])[0] for shift in (np.float32(0), np.float32(4096)))
    assert (near == far).mean() > 0.99


@pytest.mark.parametrize("counts", [[0], [3, 2], [-1]])
def test_counts_must_ascend(counts):
    with pytest.raises(ValueError, match="counts must ascend from 1"):
        halve(*cloud(10), counts)


def test_shapes_must_agree():
    points, weights = cloud(10)
    with pytest.raises(ValueError, match="halve: weights must have shape"):
        halve(points, weights[:9], [2])
