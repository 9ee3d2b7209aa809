from itertools import pairwise

import numpy as np
import pytest

from brushgs.passes.reduce.halving import halve


def cloud(num):
    chance = np.random.default_rng(1)
    return chance.normal(size=(num, 9)).astype(np.float32), chance.uniform(0.1, 1, num)


def test_there_are_as_many_cells_as_asked_for_each_in_use_and_within_one_of_before():
    points, weights = cloud(3000)
    counts = [1, 2, 3, 50, 700, 3000]
    partitions = halve(points, weights, counts)
    for count, labels in zip(counts, partitions, strict=True):
        assert np.array_equal(np.unique(labels), np.arange(count))
    for coarse, fine in pairwise(partitions):
        assert all(len(np.unique(coarse[fine == cell])) == 1 for cell in range(fine.max() + 1))


def test_equal_points_stay_together():
    points = np.repeat(np.arange(3, dtype=np.float32), 4)[:, None]
    (labels,) = halve(points, np.ones(12), [10])
    assert labels.max() == 2
    assert (labels.reshape(3, 4) == labels.reshape(3, 4)[:, :1]).all()


def test_counts_must_ascend_and_shapes_agree():
    points, weights = cloud(10)
    for counts in ([0], [3, 2], [-1]):
        with pytest.raises(ValueError, match="counts must ascend from 1"):
            halve(points, weights, counts)
    with pytest.raises(ValueError, match="halve: weights must have shape"):
        halve(points, weights[:9], [2])
