import numpy as np
import pytest

from brushgs.core.threads import at_most
from brushgs.options.choices import COLORS
from brushgs.passes.color.color_space import oklab_planes
from brushgs.values.colors import flatten, oklab_of, rgb_of, split_alpha
from tests.kit.for_each import for_each

PIXELS = np.random.default_rng(0).random((3, 5, 4), dtype=np.float32)


@for_each(("channels", "has_alpha"), [(1, False), (2, True), (3, False), (4, True)])
def test_pixels_are_color_and_alpha(channels, has_alpha):
    pixels = PIXELS[..., :channels]
    rgb, alpha = split_alpha(pixels)
    assert rgb.shape == (3, 5, 3)
    np.testing.assert_array_equal(rgb, pixels[..., :3] if channels >= 3 else pixels[..., [0, 0, 0]])
    assert (alpha is not None) is has_alpha
    if has_alpha:
        np.testing.assert_array_equal(alpha, pixels[..., -1])


@pytest.mark.parametrize("background", [1.0, np.array([0.2, 0.4, 0.6], np.float32)])
def test_a_flat_picture_is_the_mean_of_paint_and_background_weighed_by_alpha(background):
    flat = flatten(PIXELS, background)
    assert flat.dtype == np.float32
    expected = PIXELS[..., :3] * PIXELS[..., 3:] + background * (1 - PIXELS[..., 3:])
    np.testing.assert_allclose(flat, expected, rtol=1e-6)
    np.testing.assert_array_equal(flatten(PIXELS[..., :3], background), PIXELS[..., :3])


@for_each(
    ("text", "expected"),
    [
        ("white", (255, 255, 255)),
        ("Black", (0, 0, 0)),
        ("gray", (128, 128, 128)),
        ("LightGrey", (211, 211, 211)),
        ("toned", (201, 181, 151)),
        ("#1a2B3c", (26, 43, 60)),
    ],
)
def test_a_color_is_given_by_name_or_code(text, expected):
    assert rgb_of(text) == tuple(value / 255 for value in expected)


def test_every_name_is_a_color_and_grey_is_gray():
    for name in COLORS:
        assert rgb_of(name) == rgb_of(name.replace("gray", "grey"))


@for_each("text", ["redish", "#12345", "#gggggg", "", "transparent", "#1234567"])
def test_what_is_no_color_is_refused_with_those_known(text):
    with pytest.raises(ValueError, match=r"a color must be '#rrggbb' or one of white, black, gray, .* got"):
        rgb_of(text)


def test_oklab_by_tables_is_that_of_the_formula_for_any_number_of_threads():
    picture = np.random.default_rng(0).uniform(-0.1, 1.1, (90, 111, 3)).astype(np.float32)
    with at_most(1):
        planes = oklab_planes(picture)
    with at_most(3):
        np.testing.assert_array_equal(oklab_planes(picture), planes)
    expected = oklab_of(np.clip(picture, 0, 1).reshape(-1, 3).astype(np.float64)).T.reshape(planes.shape)
    np.testing.assert_allclose(planes, expected, atol=0.002)
    assert oklab_planes(picture[:0]).shape == (3, 0, 111)
