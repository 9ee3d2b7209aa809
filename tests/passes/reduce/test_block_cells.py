"""Cells of a scene: where a Gaussian is, how large, and of what color."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.reduce.block_cells import COLOR_BITS, MOST_DEPTH, SIDE, cell_keys, coarser
from brushgs.passes.reduce.contribution import projected_areas
from tests.passes.scenes import random_gaussians, replaced

FRAME = np.zeros(3), 1.0
depths = st.integers(0, MOST_DEPTH)


def keys_of(scene):
    return cell_keys(scene, projected_areas(scene.scales), FRAME)


@given(depths, depths, depths, st.integers(0, 7), st.integers(0, 2**MOST_DEPTH - 1))
def test_a_coarser_cell_is_the_beginning_of_the_number(depth, first, second, color, corner):
    cell = 1 << depth | corner >> (MOST_DEPTH - depth)
    key = np.array([cell << COLOR_BITS | color])
    wanted = cell >> max(depth - first, 0)
    assert coarser(key, first) == [wanted << COLOR_BITS | color]
    assert coarser(coarser(key, first), second) == coarser(key, min(first, second))


def test_a_cell_holds_only_gaussians_of_its_own_size_and_color():
    scene = random_gaussians(5000, spread=0.05, size=0.005)
    scene = replaced(scene, scales=scene.scales[:, :1].repeat(3, axis=1))
    is_light = scene.sh[:, 0] >= 0
    keys = keys_of(scene)
    order = np.argsort(keys, kind="stable")
    same = np.flatnonzero(np.diff(keys[order]) == 0)
    one, other = order[same], order[same + 1]
    assert len(same) > 50
    factors = scene.scales[one, 0] / scene.scales[other, 0]
    assert 0.5 < factors.min() <= factors.max() < 2
    np.testing.assert_array_equal(is_light[one], is_light[other])
    # A cell is at most twice as long as its Gaussians ask for.
    apart = np.abs(scene.means[one] - scene.means[other]).max(axis=1)
    assert np.all(apart < 2 * SIDE * np.maximum(scene.scales[one, 0], scene.scales[other, 0]) * 1.0001)


def test_everything_that_is_finite_has_a_cell():
    scene = random_gaussians(6)
    means = np.array([[0, 0, 0], [1e30, 0, 0], [-1e30, 1e30, 1e30], [2, 2, 2], [-2, -2, -2], [0, 0, 1e-30]])
    scales = np.array([[0, 0, 0], [1e30, 1, 1], [1e-30, 0, 0], [1, 0, 0], [3e38, 3e38, 3e38], [1, 1, 1.0]])
    cells = keys_of(replaced(scene, means=means, scales=scales)) >> COLOR_BITS
    assert 1 <= cells.min() <= cells.max() < 2 << MOST_DEPTH
