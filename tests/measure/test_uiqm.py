import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view

from brushgs.measure.uiqm import colorfulness, contrast, sharpness, uiqm


def test_a_gray_picture_has_nothing():
    assert uiqm(np.full((30, 40, 3), 0.4)) == pytest.approx(0, abs=1e-12)
    assert uiqm(np.zeros((30, 40, 3))) == 0


def test_colorfulness_of_two_colors_by_hand():
    """Half red (200, 0, 0), half blue (0, 0, 200): rg is 200 or 0, yb 100 or -200."""
    values = np.zeros((20, 20, 3))
    values[:10, :, 0] = values[10:, :, 2] = 200
    expected = -0.0268 * np.hypot(100, -50) + 0.1586 * np.sqrt(100**2 + 150**2)
    assert colorfulness(values) == pytest.approx(expected)


def test_a_tenth_of_the_values_at_either_end_does_not_move_the_mean():
    values = np.full((10, 10, 3), 100.0)
    values[0, :, 0] = 250.0  # the tenth of largest rg
    spread = 0.1 * 150**2 + 0.1 * 75**2
    assert colorfulness(values) == pytest.approx(0.1586 * np.sqrt(spread))


def test_contrast_by_hand():
    """Every block has 51 and 204: q = 153 / 255."""
    values = 51.0 + 153 * (np.indices((20, 30)).sum(axis=0) % 2)[..., None] * np.ones(3)
    assert contrast(values) == pytest.approx(-0.6 * np.log(0.6))
    assert contrast(values[:17]) == pytest.approx(-0.6 * np.log(0.6))  # 7 rows are left over


def test_all_parts_against_windows_of_pixels():
    picture = np.random.default_rng(3).uniform(0.1, 0.9, (43, 57, 3))
    kernel = np.outer((-1, 0, 1), (1, 2, 1))
    values = 255 * picture
    windows = sliding_window_view(np.pad(values, ((1, 1), (1, 1), (0, 0)), mode="symmetric"), (3, 3), (0, 1))
    down, right = (np.einsum("yxcij,ij->yxc", windows, one) for one in (kernel, kernel.T))
    edges = np.hypot(down, right) * values
    blocks = [np.s_[y : y + 10, x : x + 10] for y in range(0, 40, 10) for x in range(0, 50, 10)]  # whole ones
    ratios = [2 * np.log(edges[block].max(axis=(0, 1)) / edges[block].min(axis=(0, 1))) for block in blocks]
    assert sharpness(values) == pytest.approx(np.mean(ratios, axis=0) @ (0.299, 0.587, 0.114))
    least, most = (np.array([end(values[block]) for block in blocks]) for end in (np.min, np.max))
    q = (most - least) / (most + least)
    assert contrast(values) == pytest.approx(np.mean(-q * np.log(q)))
    parts = 0.0282 * colorfulness(values) + 0.2953 * sharpness(values) + 3.5753 * contrast(values)
    assert uiqm(picture) == pytest.approx(parts)


def test_small_pictures_are_refused():
    with pytest.raises(ValueError, match="at least 10 pixels, got 40x9"):
        uiqm(np.zeros((9, 40, 3)))
    with pytest.raises(ValueError, match="picture"):
        uiqm(np.zeros((20, 40)))
