"""Marks that are cut out of a painting with their colors, and which strokes take which of them."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.of_style import mark_texture
from brushgs.passes.style.choose_marks import Choice, choose_marks
from brushgs.passes.style.marks import learn_marks
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.sh import base_colors, in_colors
from brushgs.values.style import MarkDictionary
from tests.kit.mark_paintings import paint
from tests.passes.scenes import random_gaussians


@pytest.fixture(scope="module")
def marks():
    return learn_marks(paint("swirls", size=(480, 360)), 48)


def test_marks_have_the_colors_of_the_painting(marks):
    found = marks.dictionary
    assert 40 <= len(found) <= 48
    painted = oklab_of(paint("swirls", size=(480, 360)).reshape(-1, 3)[::50].astype(np.float64))
    away = np.linalg.norm(found.colors[:, None] - painted, axis=2).min(axis=1)
    assert np.quantile(away, 0.9) < 0.05
    assert found.shares.sum() == pytest.approx(1, abs=0.01)
    assert (np.diff(found.shares) <= 0).all()
    coverage = found.texels[..., 3].astype(float)  # paint is in the middle, and its residual has no mean
    rows, columns = coverage.shape[1:]
    assert coverage[:, rows // 2, columns // 2].mean() > 150
    assert coverage[:, [0, 0, -1, -1], [0, -1, 0, -1]].max() < 60
    weights = coverage / coverage.sum(axis=(1, 2), keepdims=True)
    assert np.abs((found.residuals * weights[..., None]).sum(axis=(1, 2))).max() < 0.01


def test_a_mark_laid_in_its_own_color_is_the_mark(marks):
    texels = marks.dictionary.texels.copy()
    texels[..., :3] = 128 + (texels[..., :3].astype(int) - 128) // 4  # so calm that no contrast is added
    found = replace(marks.dictionary, texels=texels)
    texture = mark_texture(found, 0, "one", 0.0)
    rgb = texture.tint.mean + (texture.tint.texels - 128.0) * texture.tint.step
    expected = rgb_of_oklab((found.colors[0] + found.residuals[0]).reshape(-1, 3).astype(float))
    away = np.abs(rgb - np.clip(expected, 0, 1).reshape(rgb.shape))[texture.coverage > 0]
    assert away.max() < 0.5 * texture.tint.step + 1e-6
    assert texture.height is not None
    assert not texture.has_bristles


def dictionary(colors, steps=0):
    """Marks of these colors; their lightness differs by so many steps up and down."""
    texels = np.full((len(colors), 4, 8, 4), 128, np.uint8)
    up = np.reshape(steps, (-1, 1, 1)).astype(np.uint8)
    texels[:, :, ::2, 0] += up
    texels[:, :, 1::2, 0] -= up
    lab = oklab_of(np.array(colors, np.float64))
    return MarkDictionary(lab.astype(np.float32), np.full(len(colors), 1 / len(colors), np.float32), texels)


def test_strokes_take_marks_of_their_color():
    strokes = random_gaussians(300, seed=2)
    colors = np.random.default_rng(0).random((40, 3))
    choice = [Choice(dictionary(colors), np.arange(40, dtype=np.uint8), 1.0)]
    chosen = choose_marks(strokes, choice)
    rgb = np.clip(base_colors(strokes.sh), 0, 1)
    away = np.linalg.norm(oklab_of(rgb)[:, None] - oklab_of(colors), axis=2)
    ranks = (away < away[np.arange(300), chosen.brushes][:, None]).sum(axis=1)
    assert np.median(ranks) <= 5


def half_calm(num=400):
    """Strokes in two places of one mean color: in the first they hardly differ, in the other much."""
    strokes, g = random_gaussians(num, seed=3), np.random.default_rng(0)
    is_calm = np.arange(num) < num // 2
    means = g.normal(0, 1, (num, 3)) + np.where(is_calm, -10, 10)[:, None]
    rgb = np.clip(0.5 + g.normal(0, 1, (num, 1)) * np.where(is_calm, 0.01, 0.1)[:, None], 0, 1)
    return in_colors(replace(strokes, means=means.astype(strokes.means.dtype)), np.tile(rgb, 3)), is_calm


def test_calm_places_take_calm_marks_and_busy_ones_busy_marks():
    strokes, is_calm = half_calm()
    steps = np.repeat((1, 30), 20)
    chosen = choose_marks(strokes, [Choice(dictionary(np.full((40, 3), 0.5), steps), np.arange(40), 1.0)])
    assert (steps[chosen.brushes[is_calm]] == 1).mean() > 0.95
    light = oklab_of(base_colors(strokes.sh))[:, 0], oklab_of(base_colors(chosen.sh))[:, 0]
    assert light[1][is_calm].std() < 0.7 * light[0][is_calm].std()
    np.testing.assert_allclose(light[1][~is_calm], light[0][~is_calm], atol=1e-5)


def test_marks_leave_contrast_to_the_detail_of_a_subject():
    strokes, is_calm = half_calm()
    steps = np.repeat((1, 12), 20)
    choice = Choice(dictionary(np.full((40, 3), 0.5), steps), np.arange(40), 1.0, yields=1.0)
    chosen = steps[choose_marks(strokes, [choice]).brushes]
    assert (chosen[~is_calm] == 1).mean() > 0.9
    assert (steps[choose_marks(strokes, [choice._replace(yields=0.0)]).brushes][~is_calm] == 12).mean() > 0.6


def test_as_a_share_grows_strokes_take_marks_and_none_gives_them_back():
    strokes = replace(random_gaussians(300, seed=2), brushes=np.zeros(300, np.uint8))
    marks = dictionary(np.random.default_rng(0).random((9, 3)))
    rows = np.arange(1, 10, dtype=np.uint8)
    none, some, most = (choose_marks(strokes, [Choice(marks, rows, share)]) for share in (0.0, 0.3, 0.8))
    assert none is strokes
    taken = some.brushes > 0
    assert 0.2 < taken.mean() < 0.4
    np.testing.assert_array_equal(most.brushes[taken], some.brushes[taken])
