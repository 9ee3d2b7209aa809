"""Brushes are chosen by the shape, the size and the place of a stroke."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.form.choose_brushes import mix_brushes
from tests.kit.for_each import for_each
from tests.passes.form.test_material import FUR, wall
from tests.passes.looks_twin import LONG, SHORT
from tests.passes.scenes import random_gaussians

KIT = bg.BrushKit(long=("flat",), short=("dab",), other=("filbert",), large=("impasto",))
NAMES = np.array(KIT.images)


def strokes_of(num=600, *, aspects=(1.0, 3.0), seed=0):
    rng = np.random.default_rng(seed)
    widths, shapes = rng.uniform(0.8, 1.2, num), rng.uniform(*aspects, num)
    scales = np.stack([widths / np.sqrt(shapes), 0.01 * widths, widths * np.sqrt(shapes)], axis=1)
    return replace(random_gaussians(num, seed), scales=scales)


def names_of(strokes, **options):
    return NAMES[bg.choose_brushes(strokes, KIT, **options).brushes]


def kinds_of(names):
    return np.array([name.rsplit("_", 1)[0] if name[-1].isdigit() else name for name in names])


def test_long_short_and_other_strokes_take_their_brushes():
    strokes = strokes_of()
    kinds = kinds_of(names_of(strokes))
    scales = np.sort(strokes.scales.astype(np.float64), axis=1)
    aspects = scales[:, 2] / scales[:, 1]
    expected = np.where(aspects > LONG, "flat", np.where(aspects < SHORT, "dab", "filbert"))
    np.testing.assert_array_equal(kinds, expected)
    assert set(kinds) == {"flat", "dab", "filbert"}


def test_variants_are_chosen_evenly_by_place_and_seed():
    strokes = strokes_of(4000, aspects=(2.2, 3.0))
    names = names_of(strokes)
    counts = [np.count_nonzero(names == name) for name in ("flat", "flat_2", "flat_3", "flat_4")]
    assert sum(counts) == 4000
    np.testing.assert_allclose(counts, 1000, atol=4 * np.sqrt(1000 * 0.75))
    assert np.mean(names_of(strokes, seed=1) == names) < 0.3
    turned = replace(strokes, quats=np.roll(strokes.quats, 1, axis=1), sh=strokes.sh + 0.1)
    np.testing.assert_array_equal(names_of(turned), names)
    assert not bg.choose_brushes(strokes, bg.BrushKit.of("flat")).brushes.any()


SURFACES = replace(KIT, smooth=("palette_knife",), rough=("dry_brush", "fan"))


def surfaces():
    """A light wall, a dark one and fur, 400 strokes each."""
    return wall(lightness=0.75) + wall(lightness=0.3, at=5) + wall(**FUR, lightness=0.5, at=10)


def test_smooth_light_and_rough_surfaces_take_brushes_of_their_own():
    kinds = kinds_of(np.array(SURFACES.images)[bg.choose_brushes(surfaces(), SURFACES, material=1).brushes])
    before = kinds_of(names_of(surfaces()))
    assert np.mean(kinds[:400] == "palette_knife") > 0.95
    np.testing.assert_array_equal(kinds[400:800], before[400:800])
    assert np.isin(kinds[800:], ("dry_brush", "fan")).mean() > 0.95
    assert 0.3 < np.mean(kinds[800:] == "fan") < 0.5  # 2 images beside 3


def test_as_the_share_grows_more_strokes_take_them_and_none_gives_one_back():
    strokes = surfaces()
    before = bg.choose_brushes(strokes, KIT).brushes
    few, many = (bg.choose_brushes(strokes, SURFACES, material=share).brushes for share in (0.4, 0.8))
    took = few != before
    assert 0.3 < took[np.r_[:400, 800:1200]].mean() < 0.5
    np.testing.assert_array_equal(many[took], few[took])
    assert (many != before).sum() > 1.5 * took.sum()
    np.testing.assert_array_equal(bg.choose_brushes(strokes, SURFACES).brushes, before)
    np.testing.assert_array_equal(bg.choose_brushes(strokes, KIT, material=1).brushes, before)
    rough = bg.choose_brushes(strokes, replace(KIT, rough=("fan",)), material=1).brushes
    np.testing.assert_array_equal(rough[:800], before[:800])
    assert np.mean(rough[800:] != before[800:]) > 0.95


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
