import numpy as np
import pytest

from brushgs.passes.color.squint import Squint, ThreeValues, lab_of, rgb_of_lab
from brushgs.passes.color.values import KNOTS, LEAST_SLOPES, MOST_SLOPE, WARMEST, Values, fit_values
from brushgs.values.frame import Frame
from brushgs.values.sh import base_colors, in_colors
from tests.passes.scenes import random_gaussians

PLAIN = Values()
OPEN = Values((0.7, 0.7, 0.9, 1.3, 1.3, 1.3, 1.3, 1.0, 0.85, 0.7, 0.6), 8.0, 45.0)


def smooth_noise(seed, shape=(60, 96), size=0.08):
    """[H, W] of deviation 1, whose bumps are large enough to be seen by who squints."""
    noise = np.random.default_rng(seed).normal(size=shape)
    steps = [np.arange(count) for count in shape]
    rows, columns = (np.exp(-0.5 * ((step[:, None] - step) / (size * max(shape))) ** 2) for step in steps)
    smooth = rows @ noise @ columns.T
    return (smooth - smooth.mean()) / smooth.std()


def scene(middle=50.0, spread=8.0, *, tilt=0.0, chroma=15.0, seed=0):
    """A picture of soft masses and fine marks on them, and a subject: b* grows by `tilt` per L*."""
    light = middle + spread * smooth_noise(seed) + np.random.default_rng(seed).normal(0, 2, (60, 96))
    light = np.clip(light, 3, 97)
    a, b = chroma * 0.3 + 0 * light, chroma + tilt * (light - middle)
    rgb = np.clip(rgb_of_lab(np.stack([light, a, b], axis=2).reshape(-1, 3)), 0, 1).reshape(60, 96, 3)
    subject = np.zeros((60, 96))
    subject[12:50, 20:76] = 1
    return rgb, subject


def fitted(*views, **options):
    frames, subjects = zip(*views, strict=True)
    return fit_values(frames, subjects, **options)


def after(values, view):
    return Squint.of(values.picture(view[0]), view[1])


def test_colors_are_in_gamut_continuous_and_monotone_in_lightness_alone():
    rgb = np.random.default_rng(0).uniform(size=(3000, 3))
    graded = OPEN.colors(rgb)
    assert 0 <= graded.min() <= graded.max() <= 1
    before, now = lab_of(rgb)[:, 0], lab_of(graded)[:, 0]
    asked = OPEN.lightness(before)
    assert (now <= asked + 0.01).all()
    assert (now >= np.minimum(before, asked) - 0.01).all()
    greys = np.linspace(0, 1, 101)[:, None] * np.ones(3)
    own, shown = lab_of(greys)[:, 0], lab_of(OPEN.without_warmth.colors(greys))[:, 0]
    np.testing.assert_allclose(shown, OPEN.lightness(own), atol=0.01)
    assert (np.diff(shown) > 0).all()
    ramp = np.linspace(0, 1, 4001)[:, None] * (1.0, 0.5, 0.2)
    steps = np.abs(np.diff(OPEN.colors(ramp), axis=0)).max()
    assert steps < 8 * np.abs(np.diff(ramp, axis=0)).max()


def test_the_curve_keeps_black_and_white_and_its_slope_within_bounds():
    light = np.linspace(0, 100, 2001)
    slopes = np.diff(OPEN.lightness(light)) / np.diff(light)
    assert 0.6 - 1e-9 <= slopes.min() <= slopes.max() <= 1.3 + 1e-9
    np.testing.assert_allclose(OPEN.lightness(np.array([0.0, 100, -5, 140])), [0, 100, 0, 100], atol=1e-9)
    np.testing.assert_allclose(OPEN.colors(np.array([[0.0] * 3, [1.0] * 3])), [[0] * 3, [1] * 3], atol=1e-3)


def test_lights_get_warmer_and_darks_cooler_and_the_middle_stays():
    greys = rgb_of_lab(np.array([[85.0, 0, 0], [45.0, 0, 0], [20.0, 0, 0]]))
    values = Values(warmth=8.0, middle=45.0)
    light, middle, dark = lab_of(values.colors(greys))[:, 2]
    assert light > 7 > 0.01 > abs(middle) > -6 > dark
    assert lab_of(values.without_warmth.colors(greys))[:, 2] == pytest.approx(0, abs=0.02)


def test_no_strength_returns_the_strokes_themselves_and_half_of_it_lies_between():
    colors = np.random.default_rng(0).uniform(size=(20, 3))
    strokes = in_colors(random_gaussians(20), colors)
    np.testing.assert_allclose(base_colors(OPEN.strokes(strokes).sh), OPEN.colors(colors), atol=1e-6)
    assert OPEN.at(0).strokes(strokes) is strokes
    assert PLAIN.strokes(strokes) is strokes
    light, half = np.array([30.0, 70.0]), OPEN.at(0.5)
    np.testing.assert_allclose(half.lightness(light), (light + OPEN.lightness(light)) / 2)
    assert half.warmth == 4
    assert fitted(scene(spread=5), strength=0.0).are_plain
    with pytest.raises(ValueError, match=r"values must be in \[0, 1\], got 2"):
        OPEN.at(2)


@pytest.mark.parametrize("middle", [35.0, 50.0, 65.0])
def test_a_scene_of_few_values_opens(middle):
    view = scene(middle, 9.0)
    values = fitted(view)
    assert Squint.of(*view).range < 33
    assert 40 <= after(values, view).range <= 46
    assert (np.clip(values.slopes, LEAST_SLOPES - 1e-9, MOST_SLOPE + 1e-9) == values.slopes).all()


def test_what_a_painter_would_not_touch_changes_little():
    subject = np.ones((40, 60))
    noise = np.random.default_rng(0).uniform(size=(40, 60, 1))
    ramp = np.broadcast_to(np.linspace(0.2, 0.8, 60)[None, :, None], (40, 60, 3))
    grey = fit_values([ramp], [subject])
    assert abs(grey.warmth) < 0.1  # a scene without color gets none
    for frame in (np.full((40, 60, 3), 0.5), np.full((40, 60, 3), (0.8, 0.1, 0.1)), np.zeros((40, 60, 3))):
        values = fit_values([frame], [subject])
        np.testing.assert_allclose(values.picture(frame), frame, atol=2e-3)
    flat = 0.5 + 0.02 * noise * np.ones(3)
    np.testing.assert_allclose(fit_values([flat], [subject]).picture(flat), flat, atol=0.03)


def test_a_temperature_that_a_scene_clearly_has_keeps_its_sign():
    warm, cool, cold = (scene(50, 13, tilt=tilt) for tilt in (0.5, -0.15, -0.5))
    assert Squint.of(*warm).warmth.lights > WARMEST + 1
    for view, sign in ((warm, 1), (cold, -1)):
        plain = Frame(view[0] * view[1][..., None], view[1])
        kept = fitted(view, before=[plain]).warmth  # it has enough of its own
        assert kept == pytest.approx(0, abs=0.2)
        found = sign * after(fitted(view), view).warmth.lights  # or by the light
        assert found == pytest.approx(WARMEST, abs=0.3)
    assert fitted(cool).warmth < 0
    assert -12 <= after(fitted(cool), cool).warmth.lights <= -5


def test_three_values_are_medians_of_lights_darks_and_ground():
    light = np.full((40, 60), 70.0)
    light[10:30, 10:30], light[10:30, 30:50] = 20.0, 50.0
    subject = (light < 60).astype(float)
    rgb = np.clip(rgb_of_lab(np.stack([light, 0 * light, 0 * light], axis=2).reshape(-1, 3)), 0, 1)
    found = Squint.of(rgb.reshape(40, 60, 3), subject).three_values
    np.testing.assert_allclose(found, (50, 20, 70), atol=0.01)
    assert Squint.of(rgb.reshape(40, 60, 3), 0 * subject + 1).three_values.ground is None
    nothing = ThreeValues(None, None, pytest.approx(70, abs=0.01))
    assert Squint.of(rgb.reshape(40, 60, 3), 0 * subject).three_values == nothing


def test_no_frames_and_no_subject_give_plain_values_and_wrong_ones_are_refused():
    rgb, subject = scene(spread=5)
    one = np.zeros((60, 96))
    one[3, 3] = 1
    for frames, subjects in (([], []), ([rgb], [0 * subject]), ([rgb], [one])):
        assert fit_values(frames, subjects).are_plain
    assert np.isfinite(fit_values([rgb[:4, :5]], [subject[:4, :5] + 1]).slopes).all()
    assert np.isfinite(fit_values([9 * rgb - 4], [subject]).slopes).all()
    rest = [1.0] * (len(KNOTS) - 2)
    for call, message in (
        (lambda: fit_values([rgb], []), "one subject per frame, got 0 and 1"),
        (lambda: fit_values([rgb], [subject[:-1]]), "subject must have shape"),
        (lambda: Values((1.0, 1.0)), "there must be 11 slopes, got 2"),
        (lambda: Values((1.7, 1.0, *rest)), r"slopes must be 0\.5 to 1\.6"),
        (lambda: Values((1.0, 1.2, *rest)), "must lead from 0 to 100, got 102 at its end"),
        (lambda: Squint.of(np.zeros((0, 4, 3)), np.zeros((0, 4))), "must have pixels"),
    ):
        with pytest.raises(ValueError, match=message):
            call()
