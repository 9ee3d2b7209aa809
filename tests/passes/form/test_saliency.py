"""What stands out: a face, a spot of colour, not a floater, and little where all is alike."""

import numpy as np
import pytest

from brushgs.passes.form.saliency import saliency
from brushgs.passes.reduce.focus import AUTO_STRENGTH, auto_focus
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

GREY, SKIN, BLUE = (0.45, 0.45, 0.45), (0.80, 0.55, 0.43), (0.10, 0.20, 0.85)


def dots(means, colors, scale=0.02):
    """Round Gaussians of these colours at places."""
    num = len(means)
    return Gaussians(
        np.asarray(means, np.float64),
        np.tile([1.0, 0, 0, 0], (num, 1)),
        np.full((num, 3), scale),
        np.full(num, 0.9),
        (np.broadcast_to(np.asarray(colors, np.float64), (num, 3))[:, None] - 0.5) / C0,
    )


def wall(spots=(), *, size=60):
    """A wall in the plane z = 0 from -1 to 1, grey but for round spots (x, y, radius, colour)."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1, 1, size)]))
    means, colors = np.stack([x, y, np.zeros_like(x)], axis=1), np.tile(GREY, (size * size, 1))
    for at_x, at_y, radius, color in spots:
        colors[np.hypot(x - at_x, y - at_y) <= radius] = color
    return dots(means, colors)


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


def test_a_wall_in_warm_light_is_no_skin():
    warm = np.array([0.68, 0.53, 0.47])
    scene = wall()
    scene = dots(scene.means, warm)
    assert saliency(scene, framed(scene)).max() < 0.05


def test_nothing_stands_out_of_noise():
    scene = wall()
    noisy = np.array(GREY) + np.random.default_rng(0).normal(0, 0.04, (len(scene), 3))
    assert (saliency(dots(scene.means, noisy), framed(scene)) > 0.3).mean() < 0.05
