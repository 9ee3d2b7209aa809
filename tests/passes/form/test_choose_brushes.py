"""Brushes are chosen by the shape, the size and the place of a stroke."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.form.choose_brushes import mix_brushes
from brushgs.values.colors import rgb_of_oklab
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, random_gaussians

KIT = bg.BrushKit(long=("flat",), short=("dab",), other=("filbert",), large=("impasto",))
SURFACES = replace(KIT, smooth=("palette_knife",), rough=("dry_brush", "fan"))


def strokes_of(num=600, *, aspects=(1.0, 3.0), seed=0):
    rng = np.random.default_rng(seed)
    widths, shapes = rng.uniform(0.8, 1.2, num), rng.uniform(*aspects, num)
    scales = np.stack([widths / np.sqrt(shapes), 0.01 * widths, widths * np.sqrt(shapes)], axis=1)
    return replace(random_gaussians(num, seed), scales=scales)


def wall(num=400, *, normals=0.0, colors=0.0, sizes=0.0, lightness=0.6, at=0.0):
    """A square of strokes that face z; how much their normals, colors and sizes differ by chance."""
    g = np.random.default_rng(0)
    means = np.stack([at + g.uniform(-1, 1, num), g.uniform(-1, 1, num), np.zeros(num)], axis=1)
    quats = np.concatenate([np.ones((num, 1)), normals * g.normal(size=(num, 3))], axis=1)
    scales = np.array([0.1, 0.06, 0.004]) * np.exp(sizes * g.normal(size=(num, 1)))
    lab = np.array([lightness, 0, 0]) + colors * g.normal(size=(num, 3)) * (1, 0.5, 0.5)
    return gaussians_at(means, scales, np.clip(rgb_of_oklab(lab), 0, 1), quats=quats)


def surfaces():
    """A light wall, a dark one and fur, 400 strokes each."""
    fur = wall(normals=1.0, colors=0.1, sizes=0.5, lightness=0.5, at=10)
    return wall(lightness=0.75) + wall(lightness=0.3, at=5) + fur


def test_variants_are_chosen_evenly_by_place_and_seed():
    strokes = strokes_of(4000, aspects=(2.2, 3.0))
    found, other = (bg.choose_brushes(strokes, KIT, seed=seed).brushes for seed in (0, 1))
    np.testing.assert_allclose(np.bincount(found), [1000] * 4, atol=4 * np.sqrt(1000 * 0.75))
    assert np.mean(found == other) < 0.3


@for_each(
    ("options", "message"),
    [
        *(({"material": material}, "material must be 0 to 1, got") for material in (-0.1, 1.1, np.nan)),
        *(({"seed": seed}, f"seed must be in 0 to 4294967295, got {seed}$") for seed in (-1, 2**32)),
    ],
)
def test_options_out_of_range_are_refused(options, message):
    with pytest.raises(ValueError, match=f"^choose_brushes: {message}"):
        bg.choose_brushes(strokes_of(3), KIT, **options)


ROWS, MORE = np.array([100, 101, 102], np.uint8), np.array([200], np.uint8)


def chosen(*choices, strokes=None, seed=0):
    strokes = bg.choose_brushes(strokes_of(3000), KIT) if strokes is None else strokes
    return mix_brushes(strokes, choices, seed=seed).brushes


def test_a_share_of_the_strokes_takes_other_brushes_evenly():
    strokes = strokes_of(3000)
    before = bg.choose_brushes(strokes, KIT).brushes
    after = chosen((ROWS, 0.4), (MORE, 0.2))
    is_first, is_second = np.isin(after, ROWS), after == 200
    assert np.mean(is_first) == pytest.approx(0.4, abs=0.03)
    assert np.mean(is_second) == pytest.approx(0.2, abs=0.03)
    np.testing.assert_array_equal(after[~is_first & ~is_second], before[~is_first & ~is_second])
    np.testing.assert_allclose(np.bincount(after, minlength=103)[100:103] / is_first.sum(), 1 / 3, atol=0.05)
    assert (chosen((ROWS, 0.4), (MORE, 0.6)) >= 100).all()
    assert (chosen((ROWS, 0.4), (MORE, 0.2), seed=1) != after).any()
    assert mix_brushes(strokes, [(ROWS, 0.0)]) is mix_brushes(strokes, []) is strokes
    assert set(chosen((MORE, 0.5), strokes=strokes)) == {0, 200}  # without brushes they have the first


@for_each(
    ("choices", "message"),
    [
        ([(ROWS, 0.7), (MORE, 0.4)], "at most 1 in all, got 0.4"),
        ([(ROWS, -0.1)], "shares must be 0 to 1"),
        ([(ROWS[:0], 0.1)], "at least one row"),
    ],
)
def test_choices_that_cannot_be_are_refused(choices, message):
    with pytest.raises(ValueError, match=message):
        mix_brushes(strokes_of(10), choices)
