import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.color.broken_color import CHROMA, LIGHTNESS
from brushgs.passes.form.coverage import nearest_others
from brushgs.values.colors import oklab_of, rgb_of_oklab
from tests.kit.for_each import for_each
from tests.passes.color import broken_color_twin as twin
from tests.passes.color.broken_color_twin import ACROSS, ALONG
from tests.passes.scenes import (
    assert_same,
    colors_of,
    random_gaussians,
    replaced,
    strange_strokes,
    with_colors,
)


def colored(num, rgb):
    return with_colors(random_gaussians(num), np.broadcast_to(rgb, (num, 3)))


def shifts_of(strokes, **options):
    return oklab_of(colors_of(bg.break_colors(strokes, **options))) - oklab_of(colors_of(strokes))


def test_shifts_have_the_deviations_asked_for_and_keep_local_means():
    strokes = replaced(
        colored(4000, [0.5, 0.45, 0.4]), scales=np.ones((4000, 3)), opacities=np.full(4000, 0.7)
    )
    shifts = shifts_of(strokes)
    # Less the mean of nine, 8/9 of the variance.
    expected = np.sqrt(8 / 9) * np.array([LIGHTNESS, CHROMA, CHROMA])
    np.testing.assert_allclose(shifts.std(axis=0), expected, rtol=0.06)
    assert np.abs(shifts.mean(axis=0)).max() < 3e-4
    around = nearest_others(strokes.means, 16)
    assert shifts[around].mean(axis=1).std(axis=0)[0] < 0.8 * LIGHTNESS / 4  # of independent shifts: 1/4
    assert np.corrcoef(shifts.T)[0, 1:] == pytest.approx(0, abs=0.06)
    only = shifts_of(strokes, lightness=0)
    assert np.abs(only[:, 0]).max() < 1e-9
    assert only[:, 1].std() > 0.8 * CHROMA


def test_shifts_are_a_hash_of_place_and_seed():
    strokes = colored(300, [0.5, 0.4, 0.6])
    assert_same(bg.break_colors(strokes), bg.break_colors(strokes))
    assert np.abs(np.corrcoef(shifts_of(strokes)[:, 0], shifts_of(strokes, seed=1)[:, 0])[0, 1]) < 0.2
    assert bg.break_colors(strokes, 0, 0) is strokes
    empty = strokes.take(slice(0))
    assert bg.break_colors(empty) is empty


def test_shifts_that_follow_the_color_grow_with_its_chroma_and_lie_along_it():
    deviations, leaning = [], []
    for chroma in (0.01, 0.03, 0.06, 0.12):
        lab = np.array([0.6, 0.6 * chroma, 0.8 * chroma])
        shifts = shifts_of(colored(2000, rgb_of_oklab(lab[None])), follows=1)
        along, across = shifts[:, 1:] @ (0.6, 0.8), shifts[:, 1:] @ (-0.8, 0.6)
        deviations.append(np.hypot(along.std(), across.std()))
        leaning.append(along.std() / across.std())
        assert np.abs(along).max() < chroma  # no hue turns round
    assert (np.diff(deviations) > 0).all()
    assert deviations[0] < 0.1 * CHROMA
    whole = np.hypot(*shifts_of(colored(2000, rgb_of_oklab(lab[None])))[:, 1:].std(axis=0))
    np.testing.assert_allclose(deviations[-1], whole, rtol=0.06)
    np.testing.assert_allclose(leaning, ALONG / ACROSS, rtol=0.1)


@for_each("rgb", [(0, 0, 0), (1, 1, 1), (1, 0, 0), (-0.3, 0.5, 1.4), (0, 1, 1)])
def test_pure_colors_stay_and_nothing_is_clipped(rgb):
    strokes = colored(200, rgb)
    np.testing.assert_allclose(colors_of(bg.break_colors(strokes, 0.1, 0.1)), colors_of(strokes), atol=2e-3)


@for_each(
    ("options", "error"),
    [
        *(({"lightness": value}, ValueError) for value in (-0.1, np.nan)),
        *(({"follows": value}, ValueError) for value in (-0.1, 1.1, np.nan)),
        ({"chroma": 0.6}, ValueError),
        ({"seed": -1}, ValueError),
        ({"seed": 0.5}, TypeError),
    ],
)
def test_options_out_of_range(options, error):
    with pytest.raises(error):
        bg.break_colors(random_gaussians(3), **options)


@for_each("name", strange_strokes())
@for_each("dtype", [np.float32, np.float64])
@for_each("follows", [0.0, 0.6])
def test_broken_colors_are_those_of_the_twin(name, dtype, follows):
    strokes = strange_strokes()[name].astype(dtype)
    if not len(strokes):
        return
    broken = bg.break_colors(strokes, 0.05, 0.03, follows=follows, seed=7)
    before, after = twin.base_colors(strokes, 0.05, 0.03, follows, 7)
    np.testing.assert_array_equal(broken.sh[:, 1:], strokes.sh[:, 1:])
    # Where both directions just fit, rounding decides about the last of the bisections, 1/256 of a shift.
    off = np.abs(colors_of(broken) - after).max(axis=1) > 1e-6
    assert off.mean() <= 0.05
    assert (np.abs(colors_of(broken) - after) <= np.abs(after - before).max() / 100 + 1e-6).all()
