"""How near a picture comes to another, against values that are known."""

import numpy as np
import pytest

from brushgs.measure.likeness import Likeness, compare, flip, psnr, rmse, ssim, unpainted

G = np.random.default_rng(3)
PICTURE = np.clip(G.uniform(0, 1, (40, 50, 3)), 0, 1)
GREY = np.full((40, 50, 3), 0.5)


def test_rmse_is_the_root_of_the_mean_square_and_psnr_in_decibels():
    picture = np.zeros((2, 2, 3), np.float32)
    picture[0, 0] = 1
    assert rmse(picture, np.zeros_like(picture)) == pytest.approx(0.5)
    assert psnr(GREY, GREY + 0.1) == pytest.approx(20)
    assert psnr(GREY, GREY) == np.inf
    for measure in (rmse, psnr):
        with pytest.raises(ValueError, match=f"{measure.__name__}: shapes must agree"):
            measure(picture, picture[1:])


def test_what_takes_longer_is_measured_on_request():
    found = compare(GREY, GREY + 0.1)
    assert (found.ssim, found.flip) == (None, None)
    assert found.rmse == found.largest == pytest.approx(0.1)
    assert found.psnr == pytest.approx(20)
    for dtype in (np.float32, np.float64):
        picture = PICTURE.astype(dtype)
        assert compare(picture, picture, wants_all=True) == Likeness(0.0, 0.0, None, 1.0, 0.0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_ssim_is_that_of_scikit_image(dtype):
    from skimage.metrics import structural_similarity

    other = np.clip(PICTURE + np.random.default_rng(5).normal(0, 0.2, PICTURE.shape), 0, 1).astype(dtype)
    published = {"gaussian_weights": True, "sigma": 1.5, "use_sample_covariance": False, "data_range": 1.0}
    expected = structural_similarity(PICTURE, other.astype(np.float64), channel_axis=-1, **published)
    assert ssim(PICTURE, other) == expected


def test_a_picture_too_small_for_ssim_has_none():
    small = PICTURE[:10]
    with pytest.raises(ValueError, match="both sides must be at least 11 pixels, got 50x10"):
        ssim(small, small)
    found = compare(small, small, wants_all=True)
    assert (found.ssim, found.flip) == (None, 0.0)


def test_flip_is_zero_for_equal_and_nearly_one_for_black_on_white():
    assert flip(PICTURE, PICTURE) == 0
    assert flip(np.zeros_like(GREY), np.ones_like(GREY)) > 0.9
    assert 0 < flip(GREY, GREY + 0.02) < flip(GREY, GREY + 0.2) < 1


def test_flip_is_that_of_display_values_not_of_light_without_bounds():
    """Values beyond the display are seen as its own."""
    assert flip(GREY, np.full_like(GREY, 3.0)) == flip(GREY, np.ones_like(GREY))
    with pytest.raises(ValueError, match="flip: "):
        flip(GREY, GREY[1:])


def test_unpainted_and_spilt_are_shares_of_the_plain_alpha():
    plain, painted = np.zeros((4, 4)), np.zeros((4, 4))
    plain[:2] = 1.0  # 8 pixels
    painted[0] = 0.5  # half of four of them,
    painted[3] = 0.25  # and a quarter of four others
    assert unpainted(painted, plain) == pytest.approx((4 * 0.5 + 4) / 8)
    assert unpainted(plain, plain) == 0
    nothing = np.zeros_like(plain)
    assert unpainted(painted, nothing) == 0
    with pytest.raises(ValueError, match="plain_alpha"):
        unpainted(painted, plain[1:])
