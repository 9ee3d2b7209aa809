"""Clusters are cut where their members lie side by side, not along what each of them spans itself."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.reduce.split import LEAST_SPAN, NUM_STEPS, cut
from tests.kit.for_each import for_each


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


def test_labels_do_not_depend_on_the_order_of_rows():
    g = np.random.default_rng(1)
    points, spans, weights = g.standard_normal((40, 9)), g.standard_normal((40, 3, 3)), np.linspace(1, 2, 40)
    labels, chosen, order = np.arange(40) % 3, np.array([0, 2]), g.permutation(40)
    spans, found = spans.astype(np.float32), np.empty(40, np.intp)
    found[order] = cut(labels[order], chosen, points[order], weights[order], spans[order], order)
    np.testing.assert_array_equal(found, cut(labels, chosen, points, weights, spans))
