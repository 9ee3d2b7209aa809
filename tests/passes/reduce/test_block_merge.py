"""Scenes that are merged in blocks do not depend on the blocks, and paint what the scene paints."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.finest import finest_of
from brushgs.passes.reduce.block_merge import cell_sums, merged_of
from brushgs.passes.reduce.block_moments import gaussians_of, moments_of
from brushgs.passes.reduce.block_table import CellTable
from brushgs.passes.reduce.merge import merge_clusters
from tests.kit.for_each import for_each
from tests.passes.scenes import columns_of, covariances, random_gaussians, replaced

FRAME = np.array([0.1, -0.2, 0.3]), 2.0


def merged(scene, most, block_rows, order=None):
    """The cells and sums of a scene in blocks, and its Gaussians."""
    scene = scene if order is None else scene.take(order)
    table = CellTable(most)
    for start in range(0, len(scene), block_rows):
        table.add(*cell_sums(scene[start : start + block_rows], FRAME))
        assert len(table) <= most
    keys, sums = table.take()
    table.add(keys, sums)
    return keys, sums, merged_of(table, FRAME)


@pytest.mark.parametrize("most", [150, 1000, 4000])
def test_neither_blocks_nor_order_matter(most):
    scene = random_gaussians(4000, size=0.02, terms=4)
    keys, sums, expected = merged(scene, most, 4000)
    assert 0.4 * most < len(expected) <= most
    for block_rows in (40, 777) if most == 1000 else (333,):
        other_keys, other_sums, actual = merged(scene, most, block_rows)
        np.testing.assert_array_equal(other_keys, keys)
        np.testing.assert_allclose(other_sums, sums, rtol=1e-9, atol=1e-9 * np.abs(sums).max())
        np.testing.assert_allclose(actual.means, expected.means, rtol=1e-6, atol=1e-6)
    keys_shuffled, sums_shuffled, _ = merged(scene, most, 500, np.random.default_rng(0).permutation(4000))
    np.testing.assert_array_equal(keys_shuffled, keys)
    np.testing.assert_allclose(sums_shuffled, sums, rtol=1e-9, atol=1e-9 * np.abs(sums).max())


@for_each("seed", range(4))
def test_the_rule_is_that_of_cover_without_overlap(seed):
    scene = random_gaussians(12, seed, terms=4, spread=0.05)
    labels = np.zeros(12, int)
    expected = merge_clusters(scene, labels, overlap=1.0, visible=np.ones(12))
    scene = replace(scene, finest=finest_of(scene))
    sums = moments_of(scene, FRAME[0]).sum(axis=1, keepdims=True)
    actual = gaussians_of(sums, FRAME[0], scene.finest, antialiased=False)
    for name in ("means", "sh"):
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(covariances(actual), covariances(expected), rtol=1e-4)
    assert abs(actual.opacities[0] - expected.opacities[0]) < 0.1  # members count as all alike: 0.06 at worst


def test_blocks_of_other_degrees_are_of_the_highest():
    flat, round_ = random_gaussians(50, 1), random_gaussians(50, 2, terms=9)
    table = CellTable(200)
    for block in (flat, round_):
        table.add(*cell_sums(block, FRAME))
    found = merged_of(table, FRAME, antialiased=True)
    assert (len(found), found.sh_degree, found.antialiased) == (100, 2, True)
    assert np.count_nonzero(found.sh[:, 4:].any(axis=(1, 2))) == 50


def test_what_paints_nothing_is_finite():
    scene = random_gaussians(40, dtype=np.float32)
    scene = replaced(scene, scales=scene.scales * 0, opacities=scene.opacities * 0)
    _, _, found = merged(scene, 8, 7)
    assert 1 <= len(found) <= 8
    assert found.opacities.max() < 1e-6
    huge = replaced(scene, means=scene.means * 1e30, scales=scene.scales + np.float32(3e38))
    for column in (*columns_of(found), *columns_of(merged(huge, 8, 7)[2])):
        assert np.isfinite(column).all()
