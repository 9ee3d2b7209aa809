import numpy as np
import pytest

from brushgs.colors import flatten, split_alpha

PIXELS = np.random.default_rng(0).random((3, 5, 4), dtype=np.float32)


@pytest.mark.parametrize(("channels", "has_alpha"), [(1, False), (2, True), (3, False), (4, True)])
def test_pixels_are_colour_and_alpha(channels, has_alpha):
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
