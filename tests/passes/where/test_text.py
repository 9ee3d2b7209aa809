"""Words are found in scenes: the vote by a model that is known, since no weights are here to be judged."""

import numpy as np
import pytest

from brushgs.passes.where import text
from brushgs.passes.where.text import WordFinder
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.kit.regions import iou
from tests.passes.scenes import gaussians_at, on_sphere

COLORS = {"blue": (0.1, 0.2, 0.9), "red": (0.9, 0.1, 0.1), "green": (0.1, 0.7, 0.1)}


class ColorEncoder:
    """In place of a model: a patch is its mean color, a word the color it names; what is no color is grey.

    A color less its grey is its direction; the fourth number is what all have in common.
    """

    side, patch = 14, 4

    def of_words(self, words):
        return self._unit(np.array([COLORS.get(word, (0.5, 0.5, 0.5)) for word in words]))

    def of_windows(self, windows):
        size = self.side * self.patch
        assert (windows.shape[1:], windows.dtype) == ((size, size, 3), np.float32)
        assert 0 <= windows.min() <= windows.max() <= 1
        blocks = windows.reshape(-1, self.side, self.patch, self.side, self.patch, 3).astype(np.float64)
        return self._unit(blocks.mean(axis=(2, 4)))

    def _unit(self, colors):
        away = colors - colors.mean(axis=-1, keepdims=True)
        vectors = np.concatenate([away, np.full((*colors.shape[:-1], 1), 0.15)], axis=-1)
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def balls(num=1500):
    """A blue, a red and a green ball of flat grey-free colors in a row, dense shells; [N] which is which."""
    which = np.repeat(np.arange(3), num)
    means = np.tile(on_sphere(num), (3, 1)) + np.outer(which - 1, (2.6, 0, 0))
    return gaussians_at(means, 0.06, np.array(list(COLORS.values()))[which], opacity=0.95), which


def around(radius, num=4):
    angles = np.arange(num) * 2 * np.pi / num
    eyes = [(radius * np.sin(angle), -1.0, -radius * np.cos(angle)) for angle in angles]
    return [Camera.look_at(eye, (0, 0, 0), width=200, height=200, fov_y=0.7) for eye in eyes]


@pytest.fixture(scope="module")
def finder_of_balls():
    gaussians, which = balls()
    return WordFinder(ColorEncoder(), gaussians, around(9.0)), which


@for_each(("word", "which_is"), [("blue", 0), ("red", 1), ("green", 2)])
def test_a_word_selects_what_it_names_and_one_that_fits_no_thing_nothing(finder_of_balls, word, which_is):
    finder, which = finder_of_balls
    assert iou(finder.relevance(word) >= 0.5, which == which_is) > 0.97
    assert not (finder.relevance("grey") > 0.5).any()


def test_what_no_view_shows_is_as_what_lies_next_to_it():
    gaussians, _ = balls()
    hidden = gaussians_at([[-2.6, 0, 0], [0.1, 0, 0], [2.6, 0, 0.0]], 1e-3, opacity=0.02)
    finder = WordFinder(ColorEncoder(), gaussians + hidden, around(9.0, 2))
    np.testing.assert_array_equal(finder.relevance("red")[-3:] >= 0.5, [False, True, False])
    away = [Camera.look_at((0, 0, 20), (0, 0, 40), width=64, height=64, fov_y=0.5)]
    np.testing.assert_array_equal(WordFinder(ColorEncoder(), gaussians, away).relevance("red"), 0)


def test_patches_lie_over_the_whole_of_pictures_of_any_shape():
    encoder = ColorEncoder()
    ramp = np.zeros((60, 150, 3), np.float32)
    ramp[..., 0] = np.linspace(0, 1, 150)
    ramp[..., 1] = np.linspace(0, 1, 60)[:, None]
    for scale, grid in zip(text.SCALES, text.patch_grids(encoder, ramp), strict=True):
        assert grid.shape == (round(14 * scale), round(35 * scale), 4)
        redness = grid[..., 0] - grid[..., 1]
        assert (np.diff(redness, axis=1).mean(axis=0) > 0).all()
        assert (np.diff(redness, axis=0).mean(axis=1) < 0).all()
