"""An edit is applied to any strokes: exactly, bounded, and by a dial."""

import numpy as np

from brushgs.passes.color.color_map import Blend, difference_slopes, map_colors
from brushgs.passes.color.color_space import Space
from brushgs.passes.style.edit import apply_edit, edit_map, needed_features
from brushgs.passes.style.features import COLOR_FEATURES, stroke_features
from brushgs.values.style import Residual, StyleEdit
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, colors_of, random_gaussians, replaced
from tests.passes.style.test_features import VIEW

WARM = np.array([[1.1, 0.1, 0, 0.05], [0, 0.9, 0.05, 0.0], [0, 0.1, 0.7, -0.1]])


def residual(features=("lightness", "height"), *, has_slopes=True):
    rng, num, size = np.random.default_rng(0), 5, (5, len(features))
    return Residual(
        tuple(features),
        rng.normal(size=size).astype(np.float32),
        0.8,
        rng.normal(size=(num, 4)).astype(np.float32),
        np.full(size[1], 0.4, np.float32),
        np.full(size[1], 0.3, np.float32),
        rng.normal(size=(num, 3, 3)).astype(np.float32) if has_slopes else None,
    )


def test_an_affine_edit_is_that_affine_map_of_all_terms():
    strokes = random_gaussians(50, terms=9)
    after = apply_edit(strokes, StyleEdit(WARM), None)
    np.testing.assert_allclose(colors_of(after), colors_of(strokes) @ WARM[:, :3].T + WARM[:, 3], atol=1e-12)
    np.testing.assert_allclose(after.sh[:, 1:], strokes.sh[:, 1:] @ WARM[:, :3].T, atol=1e-12)
    assert_same(replaced(after, sh=strokes.sh), strokes)


def test_a_residual_is_the_sum_of_its_bumps():
    strokes, some = random_gaussians(20), residual()
    features = stroke_features(strokes, VIEW, ("height",))
    rgb = colors_of(strokes)
    lightness = Space("lab").to(rgb)[:, 0]
    expected = rgb @ WARM[:, :3].T + WARM[:, 3]
    for row in range(20):
        place = (np.array([lightness[row], features.values[row, 0]]) - 0.4) / np.float32(0.3)
        place[1] = np.clip(place[1], some.centers[:, 1].min(), some.centers[:, 1].max())
        for center, weights, slopes in zip(some.centers, some.weights, some.slopes, strict=True):
            bump = np.exp(-0.5 * ((place - center) ** 2).sum() / 0.8**2)
            expected[row] += bump * (weights[:3] + slopes @ rgb[row])
    found = edit_map(StyleEdit(WARM, residual=some)).colors(rgb, features)
    np.testing.assert_allclose(found, expected, atol=1e-6)


@for_each("names", [COLOR_FEATURES, ("height",), ("blue_yellow", "height", "size")])
@for_each("has_slopes", [False, True])
def test_slopes_are_the_derivative_of_the_colors(names, has_slopes):
    strokes = random_gaussians(200)
    rgb = np.random.default_rng(1).uniform(0.05, 0.95, (200, 3))
    one = edit_map(StyleEdit(WARM, residual=residual(names, has_slopes=has_slopes)))
    features = stroke_features(strokes, VIEW)
    found = one.slopes(rgb, one.colors(rgb, features), features)
    np.testing.assert_allclose(found, difference_slopes(one, rgb, features), rtol=1e-3, atol=1e-3)


def test_colors_without_a_stroke_take_what_depends_on_color_alone():
    rgb = np.random.default_rng(0).uniform(size=(10, 3))
    plain = edit_map(StyleEdit(WARM)).colors(rgb)
    of_height = edit_map(StyleEdit(WARM, residual=residual()))
    np.testing.assert_array_equal(of_height.colors(rgb), plain)
    np.testing.assert_array_equal(of_height.slopes(rgb, plain), np.broadcast_to(WARM[:, :3], (10, 3, 3)))
    of_color = edit_map(StyleEdit(WARM, residual=residual(COLOR_FEATURES)))
    assert np.abs(of_color.colors(rgb) - plain).max() > 0.1
    assert needed_features([StyleEdit(WARM, residual=residual(COLOR_FEATURES))]) == ()
    sizes = StyleEdit(WARM, residual=residual(("size", "lightness")))
    assert needed_features([StyleEdit(WARM), sizes, sizes]) == ("size",)


def test_the_dial_is_nothing_at_0_and_linear_in_between():
    strokes = random_gaussians(60, terms=4)
    edit = StyleEdit(WARM, 0.5, residual())
    features = stroke_features(strokes, VIEW, ("height",))
    assert apply_edit(strokes, edit, features, 0.0) is strokes
    dialled = map_colors(strokes, Blend([(edit_map(edit), 0.0)]), features)
    np.testing.assert_allclose(dialled.sh, strokes.sh, atol=1e-12)
    whole = apply_edit(strokes, edit, features)
    for share in (0.25, 0.9):
        part = apply_edit(strokes, edit, features, share)
        np.testing.assert_allclose(part.sh, (1 - share) * strokes.sh + share * whole.sh, atol=1e-9)
        grown = np.log(part.scales / strokes.scales)
        np.testing.assert_allclose(grown, share * np.log(whole.scales / strokes.scales), atol=1e-9)
