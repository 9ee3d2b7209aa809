"""A palette holds the colors of a painting, in their shares, by names that people use."""

import numpy as np
import pytest

from brushgs.passes.style.color_names import color_name, color_names
from brushgs.passes.style.palette import NUM_SAMPLES, learn_palette
from brushgs.values.colors import rgb_of
from tests.kit.for_each import for_each


def image(parts, noise=0.02):
    """Upright stripes of colors in their shares."""
    row = np.repeat([color for color, _ in parts], [round(100 * share) for _, share in parts], axis=0)
    chance = np.random.default_rng(0).normal(0, noise, (60, len(row), 3))
    return np.clip(row + chance, 0, 1).astype(np.float32)


COLORS = (0.10, 0.20, 0.60), (0.85, 0.80, 0.70), (0.30, 0.50, 0.20), (0.8, 0.1, 0.1)
PARTS = list(zip(COLORS, (0.40, 0.30, 0.25, 0.05), strict=True))


def test_the_colors_of_a_painting_are_found_in_their_shares():
    palette = learn_palette(image(PARTS))
    for rgb, share in PARTS:
        near = [c for c in palette.colors if np.linalg.norm(c.rgb - rgb) < 0.08]
        assert sum(color.share for color in near) == pytest.approx(share, abs=0.03)
    shares = [color.share for color in palette.colors]
    assert shares == sorted(shares, reverse=True)
    assert sum(shares) == pytest.approx(1)
    assert 4 <= len(palette.colors) <= 8


def test_samples_have_the_moments_and_the_tails_of_the_painting():
    pixels = image(PARTS, noise=0.08)
    palette = learn_palette(pixels)
    flat = pixels.reshape(-1, 3).astype(np.float64)
    mean = palette.weights @ palette.samples
    away = palette.samples - mean
    np.testing.assert_allclose(mean, flat.mean(axis=0), atol=0.01)
    np.testing.assert_allclose(away.T @ (away * palette.weights[:, None]), np.cov(flat.T), atol=0.004)
    order = np.argsort(palette.samples[:, 0])
    at = np.cumsum(palette.weights[order])
    for level in (0.02, 0.98):
        found = palette.samples[order][np.searchsorted(at, level), 0]
        assert found == pytest.approx(np.quantile(flat[:, 0], level), abs=0.03)
    assert abs(len(palette.samples) - NUM_SAMPLES) < 100


def test_what_is_transparent_does_not_count():
    pixels = image([((0.1, 0.2, 0.6), 0.5), ((0.9, 0.1, 0.1), 0.5)])
    alpha = np.zeros((*pixels.shape[:2], 1), np.float32)
    alpha[:, :50] = 1
    palette = learn_palette(np.concatenate([pixels, alpha], axis=2))
    assert (palette.samples[:, 2] > 0.4).all()
    nothing = "a pixel that is not transparent, got none"
    for shape, words in (((4, 4, 5), "1 to 4 channels, got 5"), ((4, 4, 4), nothing), ((0, 4, 3), nothing)):
        with pytest.raises(ValueError, match=words):
            learn_palette(np.zeros(shape, np.float32))


@for_each(
    ("code", "name"),
    [
        ("#000000", "black"),
        ("#8a8078", "warm grey"),
        ("#14286a", "deep blue"),
        ("#c98a2b", "ochre"),
        ("#f6e6c0", "cream"),
        ("#7a3fa8", "violet"),
        ("#d01c1c", "bright red"),
        ("#f8e040", "bright yellow"),
    ],
)
def test_colors_have_the_names_that_people_use(code, name):
    assert color_name(np.array(rgb_of(code))) == name
    names = color_names(np.array([[0.05, 0.1, 0.3], [0.08, 0.14, 0.38], [0.1, 0.18, 0.45], [0.1, 0.1, 0.1]]))
    assert len(set(names)) == 4
    assert names[0].startswith("darker")
