"""Each Gaussian takes the mean of the pixels that it makes up."""

import numpy as np
import pytest

from brushgs.passes.color.picture_votes import votes
from brushgs.rendering.visibility import visible_areas
from tests.passes.test_seen import FRONT, cameras, squares
from tests.scenes import still_life_of


def test_a_picture_marks_what_it_shows_and_nothing_behind_it():
    scene = squares()
    mask = np.zeros((90, 120, 1))
    mask[:, 60:] = 1.0
    sums, weights = votes(scene, FRONT, [mask])
    means = sums[:, 0] / np.maximum(weights, 1e-12)
    front = np.arange(len(scene)) < len(scene) // 2
    is_right = scene.means[:, 0] > 0.1
    assert means[front & is_right].min() > 0.99
    assert means[front & (scene.means[:, 0] < -0.1)].max() < 0.01
    assert weights[~front].sum() < 0.02 * weights[front].sum()


def test_weights_are_the_pixels_that_are_made_up_summed_over_views():
    scene, views = still_life_of(3000), cameras(3)
    _, weights = votes(scene, views, [np.zeros((90, 120, 1))] * 3)
    expected = sum(visible_areas(scene, view) for view in views)
    np.testing.assert_allclose(weights, expected, rtol=1e-6)


def test_an_affine_map_of_pictures_is_that_map_of_the_votes():
    scene, views = still_life_of(2000).astype(np.float64), cameras(2)
    pictures = [np.random.default_rng(n).uniform(size=(90, 120, 3)) for n in range(2)]
    matrix, offset = np.array([[0.5, 0.2, 0.1], [0, 1, 0], [0.3, 0, 0.6]]), np.array([0.1, 0, -0.2])
    before, weights = votes(scene, views, pictures)
    after, _ = votes(scene, views, [p @ matrix.T + offset for p in pictures])
    np.testing.assert_allclose(after, before @ matrix.T + weights[:, None] * offset, atol=1e-9)


def test_what_does_not_fit_is_refused():
    scene = squares()
    with pytest.raises(ValueError, match="at least one view"):
        votes(scene, [], [])
    with pytest.raises(ValueError, match="one picture a camera, got 2 for 1"):
        votes(scene, FRONT, [np.ones((90, 120, 1))] * 2)
    with pytest.raises(ValueError, match=r"pictures must have shape \[90, 120, 1\], got \[9, 12, 1\]"):
        votes(scene, FRONT, [np.ones((9, 12, 1))])
