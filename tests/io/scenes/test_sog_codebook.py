"""Codebooks: the few values that stand for many."""

import numpy as np
import pytest

from brushgs.formats.scenes.sog_write import levels_of, nearest_levels, palette_of


def test_few_values_are_levels_themselves() -> None:
    values = np.array([[3.0, -1, 3], [7.5, -1, -104]], np.float32)
    levels = levels_of(values)
    assert levels.shape == (256,)
    np.testing.assert_array_equal(levels[nearest_levels(values, levels)], values)


def test_even_values_get_even_levels() -> None:
    values = np.linspace(0, 1, 100_000)
    levels = levels_of(values)
    # The best levels are the middles of 256 equal parts: mean squared error of one part is width^2 / 12.
    error = np.square(levels[nearest_levels(values, levels)] - values).mean()
    assert error == pytest.approx((1 / 256) ** 2 / 12, rel=1e-2)


def test_levels_lie_where_values_are_dense_and_reach_the_rare_ones() -> None:
    rng = np.random.default_rng(0)
    values = np.concatenate([rng.normal(size=20_000), [-60.0, 80.0]])
    levels = levels_of(values)
    assert (np.abs(levels) < 3).sum() > 200
    np.testing.assert_allclose(levels[nearest_levels(values[-2:], levels)], values[-2:])


def test_values_of_weight_are_nearer_to_their_levels() -> None:
    values = np.random.default_rng(0).uniform(0, 10, 50_000)
    errors = [
        np.abs(levels[nearest_levels(values, levels)] - values)[values > 9].mean()
        for levels in (levels_of(values), levels_of(values, np.exp(2 * (values - 10))))
    ]
    assert errors[1] < 0.3 * errors[0]


def test_a_palette_of_few_rows_holds_them() -> None:
    rows = np.random.default_rng(0).normal(size=(50, 9)).astype(np.float32)[np.arange(1000) % 50]
    entries, labels = palette_of(rows, 64)
    assert len(entries) == 50
    np.testing.assert_array_equal(entries[labels], rows)


def test_a_palette_of_clusters_finds_them() -> None:
    rng = np.random.default_rng(0)
    centers = rng.normal(size=(300, 9)) * 10
    rows = (centers[rng.integers(0, 300, 6000)] + rng.normal(size=(6000, 9)) * 0.01).astype(np.float32)
    entries, labels = palette_of(rows, 1500)
    assert len(entries) <= 1500
    assert np.abs(entries[labels] - rows).max() < 0.1


def test_a_palette_does_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = np.random.default_rng(0).normal(size=(5000, 24)).astype(np.float32)
    found = []
    for number in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", number)
        monkeypatch.setattr(
            "brushgs.formats.scenes.sog_write.num_threads_or_default", lambda _, n=number: int(n)
        )
        found.append(palette_of(rows, 2500))
    for first, second in zip(*found, strict=True):
        np.testing.assert_array_equal(first, second)
    assert np.square(found[0][0][found[0][1]] - rows).mean() < 0.7 * rows.var()
