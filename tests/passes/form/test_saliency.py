"""What stands out: a face, a spot of color, not a floater, and little where all is alike."""

import numpy as np
import pytest

from brushgs.passes.form.saliency import saliency
from brushgs.passes.reduce.focus import AUTO_STRENGTH, auto_focus
from brushgs.values.camera import FirstView
from brushgs.values.sh import in_colors
from tests.passes.scenes import gaussians_at, grid

GREY, SKIN = (0.45, 0.45, 0.45), (0.80, 0.55, 0.43)


def wall(spots=(), *, size=60):
    """A wall in the plane z = 0 from -1 to 1, grey but for round spots (x, y, radius, color)."""
    means, colors = grid(size), np.tile(GREY, (size * size, 1))
    for at_x, at_y, radius, color in spots:
        colors[np.hypot(means[:, 0] - at_x, means[:, 1] - at_y) <= radius] = color
    return gaussians_at(means, 0.02, colors)


def framed(gaussians, eye=None):
    corners = np.stack([gaussians.means.min(axis=0), gaussians.means.max(axis=0)]).astype(np.float64)
    return FirstView(corners, np.array([0.0, -1.0, 0.0]), 0.0, 0.0, eye=eye)


def near(gaussians, x, y, radius=0.07):
    return np.hypot(gaussians.means[:, 0] - x, gaussians.means[:, 1] - y) <= radius


@pytest.mark.parametrize("eye", [None, np.array([0.0, 0.0, -2.0])])
def test_skin_on_a_grey_wall_stands_out_and_the_wall_does_not(eye):
    scene = wall([(0.2, -0.2, 0.15, SKIN)])
    found = saliency(scene, framed(scene, eye))
    assert found[near(scene, 0.2, -0.2)].min() > 0.8
    assert found[~near(scene, 0.2, -0.2, 0.5)].max() < 0.05
    factors = auto_focus(scene, framed(scene, eye))
    np.testing.assert_allclose(factors, 1 + (AUTO_STRENGTH - 1) * found)


def test_neither_a_wall_in_warm_light_nor_noise_stands_out():
    scene = wall()
    assert saliency(in_colors(scene, np.full((3600, 3), (0.68, 0.53, 0.47))), framed(scene)).max() < 0.05
    noisy = np.array(GREY) + np.random.default_rng(0).normal(0, 0.04, (3600, 3))
    assert (saliency(in_colors(scene, noisy), framed(scene)) > 0.3).mean() < 0.05
