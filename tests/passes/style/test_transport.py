"""The paint of a scene takes the colors of a painting by a smooth map, and structure stays."""

import numpy as np
import pytest

from brushgs.passes.color.color_map import Affine
from brushgs.passes.style.palette import learn_palette
from brushgs.passes.style.transport import SLOPES, palette_map
from brushgs.values.colors import LUMINANCE
from tests.kit.for_each import for_each

GRID = np.stack(np.meshgrid(*[np.linspace(0, 1, 9)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def cloud(middles, count=500, spread=0.04, seed=0):
    rng = np.random.default_rng(seed)
    return np.clip(np.concatenate([rng.normal(m, spread, (count, 3)) for m in middles]), 0, 1)


SCENE = cloud([(0.25, 0.2, 0.15), (0.5, 0.5, 0.45), (0.7, 0.75, 0.8)])
PAINTING = cloud([(0.1, 0.15, 0.4), (0.3, 0.45, 0.7), (0.9, 0.8, 0.4)], seed=1)


def distance(one, other):
    """Sliced Wasserstein distance."""
    directions = np.random.default_rng(9).normal(size=(3, 64))
    directions /= np.linalg.norm(directions, axis=0)
    first, second = (np.quantile(x @ directions, (np.arange(256) + 0.5) / 256, 0) for x in (one, other))
    return np.sqrt(((first - second) ** 2).mean())


def fitted(scene=SCENE, painting=PAINTING, weights=None):
    palette = learn_palette(np.asarray(painting, np.float32)[:, None])
    return palette_map(palette, scene, np.ones(len(scene)) if weights is None else weights)


def test_the_distance_to_the_painting_falls_by_four_fifths():
    after = fitted().colors(SCENE)
    assert distance(after, PAINTING) < 0.2 * distance(SCENE, PAINTING)
    of_first = fitted(weights=np.where(np.arange(len(SCENE)) < 500, 1.0, 0.0)).colors(SCENE[:500])
    assert np.linalg.norm(of_first.mean(axis=0) - PAINTING.mean(axis=0)) < 0.05
    with pytest.raises(ValueError, match="palette_map: weights must have shape"):
        fitted(weights=np.ones(3))


def test_luma_depends_on_luma_alone_and_rises():
    one = fitted()
    after = one.colors(GRID) @ LUMINANCE
    order = np.argsort(GRID @ LUMINANCE)
    rises, runs = np.diff(after[order]), np.diff((GRID @ LUMINANCE)[order])
    far = runs > 1e-9
    slopes = rises[far] / runs[far]
    assert 0.9 * SLOPES[0] < slopes.min() <= slopes.max() < 1.1 * SLOPES[1]
    np.testing.assert_allclose(rises[~far], 0, atol=1e-8)


def test_derivatives_are_those_of_the_map():
    one, some = fitted(), np.concatenate([GRID, GRID * 1.4 - 0.2])
    slopes = one.slopes(some, one.colors(some))
    for channel, step in enumerate(1e-6 * np.eye(3)):
        found = (one.colors(some + step) - one.colors(some - step)) / 2e-6
        np.testing.assert_allclose(slopes[:, :, channel], found, atol=1e-4)


BLACK_AND_WHITE = np.repeat([[0.0, 0, 0], [1, 1, 1]], 50, axis=0)
GREY, NOISE = np.full((400, 3), 0.4), cloud([(0.5, 0.5, 0.5)], spread=0.002)


@for_each("scene", [GREY, np.array([[0.2, 0.5, 0.9]]), BLACK_AND_WHITE, NOISE, SCENE])
@for_each("painting", [GREY + 0.3, np.array([[0.9, 0.1, 0.1]]), BLACK_AND_WHITE, PAINTING])
def test_extremes_give_no_confetti(scene, painting):
    one = fitted(scene, painting)
    after = one.colors(GRID)
    assert np.isfinite(one.slopes(GRID, after)).all()
    assert np.linalg.norm(one.slopes(scene, one.colors(scene)), ord=2, axis=(1, 2)).max() < 12
    assert np.abs(after).max() < 4
    # The middle of the paint gets near the middle of the painting.
    assert np.linalg.norm(one.colors(scene).mean(axis=0) - painting.mean(axis=0)) < 0.12


def test_no_paint_changes_nothing():
    one = fitted(np.zeros((0, 3)))
    assert isinstance(one, Affine)
    np.testing.assert_array_equal(one.colors(GRID), GRID)
    np.testing.assert_array_equal(fitted(weights=np.zeros(len(SCENE))).colors(GRID), GRID)
