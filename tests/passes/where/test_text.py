"""Words are found in scenes: the vote by a model that is known, since no weights are here to be judged."""

import importlib

import numpy as np
import pytest

from brushgs.first_view import find_first_view
from brushgs.passes.where import text
from brushgs.passes.where.text import CANONICAL, WordFinder
from brushgs.still_life.cast import cast_of, joined
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0, base_colors
from tests.passes.scenes import random_gaussians, replaced
from tests.scenes import still_life_of

bodies = importlib.import_module("brushgs.still_life.bodies")  # its name is that of a function, too

COLORS = {"blue": (0.1, 0.2, 0.9), "red": (0.9, 0.1, 0.1), "green": (0.1, 0.7, 0.1)}


class ColorEncoder:
    """In place of a model: a patch is its mean colour, a word the colour it names; what is no colour is grey.

    A colour less its grey is its direction; the fourth number is what all have in common.
    """

    side, patch = 14, 4

    def __init__(self):
        self.windows_seen = 0

    def of_words(self, words):
        return self._unit(np.array([COLORS.get(word, (0.5, 0.5, 0.5)) for word in words]))

    def of_windows(self, windows):
        size = self.side * self.patch
        assert windows.shape[1:] == (size, size, 3)
        assert windows.dtype == np.float32
        assert windows.min() >= 0
        assert windows.max() <= 1
        self.windows_seen += len(windows)
        blocks = windows.reshape(-1, self.side, self.patch, self.side, self.patch, 3).astype(np.float64)
        return self._unit(blocks.mean(axis=(2, 4)))

    def _unit(self, colors):
        away = colors - colors.mean(axis=-1, keepdims=True)
        vectors = np.concatenate([away, np.full((*colors.shape[:-1], 1), 0.15)], axis=-1)
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def balls(num=1500, seed=3):
    """A blue, a red and a green ball of flat grey-free colours in a row, dense shells; [N] which is which."""
    rng = np.random.default_rng(seed)
    away = rng.normal(size=(3 * num, 3))
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    which = np.repeat(np.arange(3), num)
    means = away + np.array([[-2.6, 0, 0], [0, 0, 0], [2.6, 0, 0]])[which]
    sh = ((np.array(list(COLORS.values()))[which] - 0.5) / C0)[:, None]
    return Gaussians(
        means,
        np.tile([1.0, 0, 0, 0], (3 * num, 1)),
        np.full((3 * num, 3), 0.06),
        np.full(3 * num, 0.95),
        sh,
    ), which


def around(radius, num=4, height=-1.0, target=(0, 0, 0), side=200):
    angles = np.arange(num) * 2 * np.pi / num
    return [
        Camera.look_at(
            (radius * np.sin(a) + target[0], height + target[1], -radius * np.cos(a) + target[2]),
            target,
            width=side,
            height=side,
            fov_y=0.7,
        )
        for a in angles
    ]


def overlap(found, truth):
    return np.count_nonzero(found & truth) / np.count_nonzero(found | truth)


@pytest.fixture(scope="module")
def finder_of_balls():
    gaussians, which = balls()
    return WordFinder(ColorEncoder(), gaussians, around(9.0)), which


@pytest.mark.parametrize(("word", "which_is"), [("blue", 0), ("red", 1), ("green", 2)])
def test_a_word_selects_the_thing_it_names(finder_of_balls, word, which_is):
    finder, which = finder_of_balls
    assert overlap(finder.relevance(word) >= 0.5, which == which_is) > 0.97


def test_a_word_that_fits_nothing_better_than_any_phrase_selects_nothing(finder_of_balls):
    finder, _ = finder_of_balls
    assert not (finder.relevance("grey") > 0.5).any()


def blue_jug(num):
    """The still life with its jug in the blue that the model knows, in light and shade; [N] whether jug."""
    rng = np.random.default_rng(0)
    parts = list(bodies.bodies(num, rng))
    cast = joined([cast_of(body, number, rng) for number, body in enumerate(parts)])
    gaussians = still_life_of(num)
    body_of = cast.surface.bodies[cast.opacities > 1 / 255]
    is_jug = (body_of == 3) | (body_of == 4)  # belly and handle
    light = base_colors(gaussians.sh).mean(axis=1, keepdims=True)
    sh = gaussians.sh[:, :1].copy()
    sh[is_jug, 0] = ((0.4 + 2 * light[is_jug]) * COLORS["blue"] - 0.5) / C0
    return replaced(gaussians, sh=sh), is_jug


def test_the_jug_of_the_still_life_is_found_by_its_colour(monkeypatch):
    gaussians, is_jug = blue_jug(12_000)
    monkeypatch.setattr(ColorEncoder, "side", 24)  # as the larger CLIP at 336 pixels; with 14 patches 0.80
    monkeypatch.setattr("brushgs.passes.where.clip.ClipEncoder", lambda folder: ColorEncoder())
    found = text.word_finder(gaussians, "no folder", find_first_view(gaussians)).relevance("blue") >= 0.5
    assert overlap(found, is_jug) > 0.83  # 0.85: patches are coarse, and some of the jug no view shows


def test_what_no_view_shows_is_as_what_lies_next_to_it():
    gaussians, _ = balls()
    inside = random_gaussians(3, size=0.01)
    hidden = Gaussians(
        np.array([[-2.6, 0, 0], [0.1, 0, 0], [2.6, 0, 0.0]]),
        inside.quats,
        np.full((3, 3), 1e-3),
        np.full(3, 0.02),
        np.zeros((3, 1, 3)),
    )
    both = Gaussians.joined([gaussians, hidden])
    finder = WordFinder(ColorEncoder(), both, around(9.0, 2))
    np.testing.assert_array_equal(finder.relevance("red")[-3:] >= 0.5, [False, True, False])


def test_a_scene_that_no_view_shows_fits_nothing():
    gaussians, _ = balls(50)
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


def test_the_phrases_that_fit_anything_are_asked_beside_the_words(monkeypatch):
    asked = []

    class Listening(ColorEncoder):
        def of_words(self, words):
            asked.extend(words)
            return super().of_words(words)

    WordFinder(Listening(), balls(50)[0], around(9.0, 1)).relevance("red")
    assert asked == ["red", *CANONICAL]


def test_the_ring_of_views_begins_with_the_first_view(monkeypatch):
    gaussians, _ = balls(50)
    corners = np.array(np.meshgrid(*[[-3.6, 3.6], [-1, 1], [-1, 1]])).reshape(3, -1).T
    view = FirstView(points=corners, up=np.array([0, -1.0, 0]), azimuth=0.3, elevation=0.1)
    seen = {}

    def listen(encoder, gaussians, cameras, **_):
        seen["cameras"] = cameras

    monkeypatch.setattr(text, "WordFinder", listen)
    monkeypatch.setattr("brushgs.passes.where.clip.ClipEncoder", lambda folder: ColorEncoder())
    text.word_finder(gaussians, "no folder", view)
    assert len(seen["cameras"]) == 10
    assert {(c.width, c.height) for c in seen["cameras"]} == {(346, 346)}
