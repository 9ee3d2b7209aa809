"""Clusters are cut where their members lie side by side, not along what each of them spans itself."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.reduce.features import cluster_features, spans_of
from brushgs.passes.reduce.split import LEAST_SPAN, NUM_STEPS, cut
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians, replaced


def lines(length, *, turned=(1, 0, 0, 0)):
    """40 Gaussians in two rows, 2 wide and 1 apart, whose own axis along the rows is so long."""
    g = np.random.default_rng(0)
    along, row = g.uniform(-1, 1, 40), np.repeat((-0.5, 0.5), 20)
    means = np.stack([along, row, np.zeros(40)], axis=1)
    scales = np.tile((length, 0.05, 0.05), (40, 1))
    quats = np.tile(np.array(turned, float), (40, 1))
    return replaced(random_gaussians(40), means=means, scales=scales, quats=quats, sh=np.zeros((40, 1, 3)))


def halves(scene):
    points = cluster_features(scene)
    return cut(np.zeros(40, np.intp), np.array([0]), points, np.ones(40), spans_of(scene, points))


@for_each("unit", [2.0**-60, 1.0, 2.0**60])
def test_a_cut_parts_what_lies_side_by_side(unit):
    def scaled(scene):
        return replaced(scene, means=scene.means * unit, scales=scene.scales * unit)

    short, long, across = (
        halves(scaled(scene)) for scene in (lines(0.05), lines(1.0), lines(1.0, turned=(1, 0, 0, 1)))
    )
    is_upper = np.repeat((False, True), 20)
    assert 10 <= np.count_nonzero(short == short[0]) <= 30  # the rows are cut across: that way is longest
    assert 0 < np.count_nonzero((short == short[0]) & is_upper) < 20
    np.testing.assert_array_equal(long == long[0], ~is_upper)
    assert 0 < np.count_nonzero((across == across[0]) & is_upper) < 20


def test_members_at_one_place_are_cut_by_color_and_stay_finite():
    scene = lines(1.0)
    sh = np.repeat((-0.5, 0.5), 20)[:, None, None] * np.ones((40, 1, 3))
    labels = halves(replaced(scene, means=np.zeros((40, 3)), sh=sh))
    np.testing.assert_array_equal(labels == labels[0], np.repeat((True, False), 20))


def defined_halves(points, weights, spans):
    """One cluster in two as `cut` defines it, in NumPy: True for the half without the first point."""
    points, shares = points.astype(float), weights / weights.sum()
    away = points - shares @ points
    if spans is not None:
        between = np.einsum("n,ni,nj->ij", shares, away[:, :3], away[:, :3])
        metric = np.einsum("n,nik,njk->ij", shares, spans, spans, dtype=float)
        variances, ways = np.linalg.eigh(metric + LEAST_SPAN * np.trace(between) / 3 * np.eye(3))
        factors = ways @ np.diag(np.maximum(variances, 1e-12 * variances[-1]) ** -0.5) @ ways.T
        factors *= np.sqrt(np.trace(between) / np.trace(factors @ between @ factors.T))
        away[:, :3] = away[:, :3] @ factors.T
    is_second = away @ np.linalg.eigh(np.einsum("n,ni,nj->ij", shares, away, away))[1][:, -1] > 0
    for _ in range(NUM_STEPS):
        middles = [np.average(away[half], axis=0, weights=weights[half]) for half in (~is_second, is_second)]
        first, second = (((away - middle) ** 2).sum(axis=1) for middle in middles)
        is_second = second < first
    return is_second ^ is_second[0]


@given(
    num=st.integers(2, 400),
    num_features=st.sampled_from([9, 16]),
    dtype=st.sampled_from([np.float32, np.float64]),
    has_spans=st.booleans(),
    seed=st.integers(0, 10**6),
)
def test_halves_are_those_of_the_definition(num, num_features, dtype, has_spans, seed):
    g = np.random.default_rng(seed)
    labels = g.integers(0, 3, num)
    labels[:2] = 1
    points = g.standard_normal((num, num_features)).astype(dtype)
    spans = g.standard_normal((num, 3, 3)).astype(np.float32) if has_spans else None
    weights = g.uniform(0.01, 1, num)
    after = cut(labels, np.array([1]), points, weights, spans)
    own = labels == 1
    halves = defined_halves(points[own], weights[own], None if spans is None else spans[own])
    np.testing.assert_array_equal(after[own] == after.max(), halves)
    assert len(np.unique(after[~own])) == len(np.unique(labels[~own]))


@for_each("extreme", [0.0, 1e-30, 1e30, np.nan])
def test_extreme_members_are_parted_or_stay_together(extreme):
    points = np.zeros((6, 9), np.float32)
    points[3:] = extreme
    spans = np.full((6, 3, 3), extreme, np.float32)
    labels = cut(np.zeros(6, np.intp), np.array([0]), points, np.full(6, 1e-30), spans)
    assert labels[0] == 0
    assert set(labels) <= {0, 1}
    if extreme in (1e-30, 1e30):
        np.testing.assert_array_equal(labels, [0, 0, 0, 1, 1, 1])
