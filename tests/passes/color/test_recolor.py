"""Color transfer: mean and covariance become the painting's, highlights stay, nothing else moves."""

import numpy as np
import pytest

from brushgs.passes.color.color_space import Space
from brushgs.passes.color.recolor import Palette, monge_kantorovich, recolor
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.sh import sh_basis
from tests.kit.for_each import for_each
from tests.passes.scenes import colors_of, random_gaussians, replaced, with_colors

SPACES = ("lab", "linear", "srgb")


def scene(num=4000, degree=0, dtype=np.float32):
    """Strokes of one hue more than of others, whose opacities and sizes differ."""
    rng = np.random.default_rng(0)
    base = rng.beta(2, 2, size=(num, 3)) @ np.array([[0.7, 0.1, 0.1], [0.2, 0.6, 0.1], [0.1, 0.2, 0.7]])
    strokes = random_gaussians(num, terms=(degree + 1) ** 2)
    return with_colors(replaced(strokes, sh=0.03 * strokes.sh), base).astype(dtype)


def painting(height=60, width=80):
    """A picture of four paints in uneven shares."""
    rng = np.random.default_rng(1)
    paints = np.array([[0.1, 0.15, 0.45], [0.2, 0.45, 0.75], [0.85, 0.85, 0.5], [0.05, 0.05, 0.2]])
    which = rng.choice(4, size=(height, width), p=(0.3, 0.3, 0.15, 0.25))
    return np.clip(paints[which] + rng.normal(0, 0.02, (height, width, 3)), 0, 1).astype(np.float32)


PALETTE = Palette.of_image(painting())


@for_each("space", SPACES)
@for_each("weights", ["paint", "equal"])
def test_at_full_strength_mean_and_covariance_are_the_paintings(space, weights):
    before, palette = scene(), Palette.of_image(painting(), space=space)
    given = np.ones(len(before)) if weights == "equal" else None
    after = recolor(before, palette, weights=given)
    by = paint_of(before) if given is None else given
    found = Palette.of_colors(colors_of(after), by, space=space)
    np.testing.assert_allclose(found.mean, palette.mean, atol=1e-6)
    np.testing.assert_allclose(found.covariance, palette.covariance, atol=1e-6)


def test_a_large_picture_gives_the_palette_of_its_pixels():
    image = painting(1200, 1000)
    image[:, :, 0] *= np.linspace(0.5, 1, 1200, dtype=np.float32)[:, None]
    found, whole = Palette.of_image(image), Palette.of_colors(image.reshape(-1, 3))
    np.testing.assert_allclose(found.mean, whole.mean, atol=2e-3)
    np.testing.assert_allclose(found.covariance, whole.covariance, atol=2e-4)


def test_strength_goes_evenly_from_the_scene_to_the_painting():
    before, palette = scene(), Palette.of_image(painting(), space="srgb")
    whole, half = recolor(before, palette), recolor(before, palette, 0.5)
    np.testing.assert_allclose(half.sh, 0.5 * (before.sh + whole.sh), atol=1e-5)
    assert recolor(before, palette, 0) is before


def first_order_error(space, size):
    """Median distance of seen colors from the exactly mapped ones, with bands of `size` times the usual."""
    before, palette = scene(degree=3, dtype=np.float64), Palette.of_image(painting(), space=space)
    before = replaced(before, sh=before.sh * np.r_[1, np.full(15, size)][:, None])
    after = recolor(before, palette)
    basis = sh_basis(np.array([[0.36, -0.48, 0.8]]), 3)[0]
    seen_before = colors_of(before) + np.einsum("k,nkc->nc", basis[1:], before.sh[:, 1:])
    seen_after = colors_of(after) + np.einsum("k,nkc->nc", basis[1:], after.sh[:, 1:])
    own = Palette.of_colors(colors_of(before), paint_of(before), space=space)
    matrix = monge_kantorovich(own.covariance, palette.covariance)
    there = Space(space)
    exact = there.back((there.to(seen_before) - own.mean) @ matrix.T + palette.mean)
    return np.median(np.abs(seen_after - exact).max(axis=1))


@for_each("space", SPACES)
def test_view_dependent_colors_follow_the_same_map(space):
    whole, quarter = first_order_error(space, 1.0), first_order_error(space, 0.25)
    if space == "srgb":  # the map is linear: the bands follow it exactly
        assert whole < 1e-12
    else:  # to first order: a quarter of the change leaves a sixteenth of the error
        assert whole < 0.02
        assert whole / quarter == pytest.approx(16, rel=0.15)


def test_of_all_maps_the_one_of_least_motion_is_taken():
    # Equal covariances ask for no motion at all; a scaled one for that scaling.
    covariance = PALETTE.covariance
    np.testing.assert_allclose(monge_kantorovich(covariance, covariance), np.eye(3), atol=1e-9)
    np.testing.assert_allclose(monge_kantorovich(covariance, 4 * covariance), 2 * np.eye(3), atol=1e-9)


@for_each("space", SPACES)
def test_a_scene_of_one_color_takes_the_mean_and_stays_of_one_color(space):
    grey = replaced(scene(), sh=np.full((4000, 1, 3), 0.1, np.float32))
    palette = Palette.of_image(painting(), space=space)
    after = colors_of(recolor(grey, palette))
    assert np.ptp(after, axis=0).max() < 1e-5
    np.testing.assert_allclose(Space(space).to(after[:1])[0], palette.mean, atol=1e-5)


def test_transparent_parts_of_a_painting_do_not_count():
    opaque = painting()
    half = np.concatenate([opaque, np.ones_like(opaque[..., :1])], axis=2)
    half = np.concatenate([half, np.zeros_like(half)], axis=1)
    np.testing.assert_allclose(Palette.of_image(half).mean, Palette.of_image(opaque).mean, atol=1e-6)


@for_each(
    ("call", "sentence"),
    [
        (lambda: recolor(scene(9), PALETTE, 70), "for 70 % write 0.7"),
        (lambda: recolor(scene(9), PALETTE, -0.1), r"strength must be in \[0, 1\]"),
        (lambda: recolor(scene(9), PALETTE, weights=np.ones(3)), "weights must have shape"),
        (lambda: Palette.of_image(np.ones((2, 2, 7))), "1 to 4 channels, got 7"),
        (lambda: Palette.of_image(np.zeros((2, 2, 4))), "a weight above zero, got none"),
        (lambda: Palette.of_image(np.zeros((0, 2, 3))), "a weight above zero, got none"),
        (lambda: Palette.of_image(painting(), space="hsv"), "must be one of lab, linear, srgb, got 'hsv'"),
    ],
)
def test_what_means_nothing_is_refused_in_a_sentence(call, sentence):
    with pytest.raises(ValueError, match=sentence):
        call()
