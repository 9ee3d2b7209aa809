"""Canvas and paper."""

import numpy as np
import pytest

from brushgs.rendering.relief import canvas_scale
from brushgs.rendering.surface import (
    LINEN_HEIGHT,
    LINEN_TONE,
    PAPER_HEIGHT,
    PAPER_TONE,
    PERIOD,
    WEAVE_DEVIATION,
    WEAVE_MEAN,
    Surface,
    flat,
    linen,
    paper,
)
from tests.kit.for_each import for_each

CANVASES = {"linen": linen, "paper": paper}
HEIGHTS = {"linen": LINEN_HEIGHT, "paper": PAPER_HEIGHT}
TONES = {"linen": LINEN_TONE, "paper": PAPER_TONE}
CREAM = (0.9, 0.85, 0.75)


def canvas(name: str, width: int = 1000, height: int = 750, **options) -> Surface:
    return CANVASES[name](CREAM, height=height, width=width, **options)


def autocorrelation(field: np.ndarray) -> np.ndarray:
    """[H, W] correlation of a field with itself moved by whole pixels, without wrapping, from no move on."""
    field = field - field.mean()
    padded = [2 * n for n in field.shape]
    sums = np.fft.irfft2(np.abs(np.fft.rfft2(field, padded)) ** 2, padded)
    overlap = np.outer(*(n - np.arange(n) for n in field.shape))
    found = sums[: field.shape[0], : field.shape[1]] / overlap
    return np.asarray(found / found[0, 0])


@pytest.mark.parametrize("name", CANVASES)
def test_heights_and_tones_are_as_said(name):
    surface = canvas(name)
    assert surface.rgb.shape == (750, 1000, 3)
    assert surface.height.shape == surface.grain.shape == (750, 1000)
    assert {a.dtype for a in (surface.rgb, surface.height, surface.grain)} == {np.dtype(np.float32)}
    np.testing.assert_allclose(surface.height.std(), HEIGHTS[name], rtol=0.15)
    assert abs(surface.height.mean()) < 0.02 * HEIGHTS[name]
    np.testing.assert_allclose(surface.rgb.mean(axis=(0, 1), dtype=np.float64), CREAM, atol=1e-3)
    np.testing.assert_allclose((surface.rgb[..., 0] / CREAM[0]).std(), TONES[name], rtol=0.15)
    assert surface.grain.min() >= 0
    assert surface.grain.max() <= 1
    assert abs(surface.grain.mean() - 0.5) < 0.03
    assert surface.grain.std() > 0.15
    raised = surface.height > surface.height.std()
    assert surface.grain[raised].min() > surface.grain[~raised].mean()


@pytest.mark.parametrize("name", CANVASES)
def test_a_seed_repeats(name):
    surface, again, other = canvas(name), canvas(name), canvas(name, seed=1)
    np.testing.assert_array_equal(surface.height, again.height)
    np.testing.assert_array_equal(surface.rgb, again.rgb)
    assert abs(np.corrcoef(surface.height.ravel(), other.height.ravel())[0, 1]) < 0.1


@pytest.mark.parametrize("name", CANVASES)
def test_no_tile_recurs(name):
    """Further off than ten threads nothing is like itself again; a tile would be so entirely."""
    # Moved by half the picture at most: beyond, too little is left to tell.
    found = autocorrelation(canvas(name).height)[:375, :500]
    assert np.abs(found[36:, 36:]).max() < 0.2
    # Along a thread it is like itself, but at no distance more than at another.
    for profile in (found[0, 54:], found[54:, 0]):
        assert np.ptp(profile) < 0.25


def test_linen_has_threads_of_the_period():
    found = autocorrelation(canvas("linen").height)
    for profile in (found[0], found[:, 0]):
        twice = round(2 * PERIOD)  # over and under in turn: like itself after two
        assert profile[twice] > 0.2
        assert profile[twice] > profile[twice - 2]
        assert profile[twice] > profile[twice + 2]


@pytest.mark.parametrize("name", CANVASES)
def test_a_small_picture_previews_a_large_one(name):
    large, small = canvas(name, 2000, 1500).height, canvas(name).height
    halved = large.reshape(750, 2, 1000, 2).mean(axis=(1, 3)) / 2
    assert np.corrcoef(halved.ravel(), small.ravel())[0, 1] > 0.95
    np.testing.assert_allclose(halved.std(), small.std(), rtol=0.2)


@for_each("name", CANVASES)
@for_each(("width", "height"), [(750, 1000), (1600, 1200), (1920, 1080), (700, 1600)])
def test_a_picture_of_another_shape_shows_the_same_from_its_upper_left_corner(name, width, height):
    """A place on the canvas has its height in a picture of any size, to what pixels resolve."""
    usual, other = canvas(name), canvas(name, width, height)
    scale = canvas_scale(width, height)
    rows, columns = (np.arange(40, round(600 / 1.6)), np.arange(40, round(700 / 1.6)))
    y, x = np.meshgrid((rows + 0.5) * scale - 0.5, (columns + 0.5) * scale - 0.5, indexing="ij")
    below, right = y.astype(int), x.astype(int)
    dy, dx = y - below, x - right
    field = other.height / scale
    shown = (1 - dy) * ((1 - dx) * field[below, right] + dx * field[below, right + 1]) + dy * (
        (1 - dx) * field[below + 1, right] + dx * field[below + 1, right + 1]
    )
    expected = usual.height[np.ix_(rows, columns)]
    assert np.corrcoef(shown.ravel(), expected.ravel())[0, 1] > 0.95


def test_the_weave_as_drawn_has_the_measured_mean_and_deviation():
    """To twice what single canvases stray, over the root of their number."""
    weaves = [canvas("linen", seed=seed).height / LINEN_HEIGHT for seed in range(100, 116)]
    mean, square = (np.mean([(w.astype(np.float64) ** power).mean() for w in weaves]) for power in (1, 2))
    assert abs(mean) * WEAVE_DEVIATION < 2 * 0.0076 / 4
    assert abs(np.sqrt(square) - 1) * WEAVE_DEVIATION < 2 * 0.0025 / 4 + 1e-4
    assert 0.9 < WEAVE_MEAN < 1.1


@for_each(("width", "height"), [(1, 1), (3, 500), (16, 12), (320, 180), (3840, 2160)])
@for_each("name", CANVASES)
def test_any_size_has_a_surface(name, width, height):
    surface = canvas(name, width, height)
    assert surface.rgb.shape == (height, width, 3)
    for array in (surface.rgb, surface.height, surface.grain):
        assert np.isfinite(array).all()


def test_threads_too_narrow_for_pixels_fade():
    """Of 3.6 pixels at 1000 x 750 there are 1.15 at 320 x 240: they would make patterns of their own."""
    assert not canvas("linen", 320, 240).height.any()
    assert canvas("linen", 640, 480).height.std() > 0


@pytest.mark.parametrize("name", CANVASES)
def test_strength_scales_height_and_tone(name):
    surface, strong = canvas(name, 200, 150), canvas(name, 200, 150, strength=3.0)
    np.testing.assert_allclose(strong.height, 3 * surface.height, rtol=1e-5, atol=1e-7)
    np.testing.assert_allclose(
        strong.rgb - np.float32(CREAM), 3 * (surface.rgb - np.float32(CREAM)), atol=1e-5
    )
    np.testing.assert_array_equal(strong.grain, surface.grain)


def test_a_flat_board_has_nothing_but_its_colour():
    picture = np.random.default_rng(0).uniform(0, 1, (5, 7, 3)).astype(np.float32)
    board = flat(picture, height=5, width=7)
    np.testing.assert_array_equal(board.rgb, picture)
    assert not board.height.any()
    np.testing.assert_array_equal(board.grain, 1)


def test_colours_of_another_size_are_refused():
    with pytest.raises(ValueError, match=r"color must have shape \[3\] or \[5, 7, 3\], got \[7, 5, 3\]"):
        flat(np.zeros((7, 5, 3)), height=5, width=7)
