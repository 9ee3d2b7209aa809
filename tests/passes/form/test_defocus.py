"""Detail that is lost with distance from the focus: its law, its limits, and what stays."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.form.defocus import Lens, defocus, focused
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import assert_same, gaussians_at, grid

VIEW = Camera.look_at((0, 0, 0), (0, 0, 1), width=160, height=120)  # z is depth
SHARP = 4.0
LENS = Lens([VIEW], np.array([[SHARP, SHARP]]), np.empty((0, 3)), np.empty((0, 3)), np.empty(0))


def dots(depths, size=0.01, rgb=0.5):
    """Small round strokes along the axis of the view."""
    return gaussians_at(np.outer(depths, (0, 0, 1)), size, np.reshape(rgb, (-1, 1)))


@for_each("strength", [0.3, 1.0])
def test_strokes_grow_as_a_lens_blurs(strength):
    depths = np.array([2.5, 3, 3.9, SHARP, 4.2, 6, 20, 1e3])
    expected = 1 + 2 * strength * np.abs(1 / depths - 1 / SHARP) * SHARP
    growth = defocus(dots(depths, size=1e-3), LENS, strength).scales[:, 0] / 1e-3
    np.testing.assert_allclose(growth, expected, rtol=1e-12)


def test_growth_opacity_and_contrast_follow_the_blur_and_nothing_changes_in_focus_and_at_strength_0():
    depths = np.array([SHARP, 4.5, 5, 6, 8, 12, 30, 100, 1e4])
    strokes = dots(depths, size=1e-3, rgb=np.where(np.arange(9) % 2, 0.8, 0.2))
    lens = replace(LENS, places=strokes.means, colors=np.full((9, 3), 0.5), areas=np.ones(9))
    found = defocus(strokes, lens, 1)
    assert_same(found.take([0]), strokes.take([0]))
    assert defocus(strokes, lens, 0) is strokes
    growth = found.scales[:, 0] / strokes.scales[:, 0]
    assert (np.diff(growth) > 0).all()
    assert (np.diff(found.opacities) < 0).all()
    contrast = np.abs(base_colors(found.sh) - 0.5)[:, 0]
    np.testing.assert_allclose(contrast, 0.3 / growth)
    with pytest.raises(ValueError, match=r"defocus: strength must be in \[0, 1\], got 1.5"):
        defocus(strokes, LENS, 1.5)


@for_each("depth", [-1e6, -1.0, 0.0, 1e-12, VIEW.near, 1e6, 1e18, 1e30])
def test_at_extreme_depths_strokes_grow_at_most_threefold(depth):
    strokes = dots([depth, SHARP])
    growth = defocus(strokes, focused(strokes, [VIEW], None), 1.0).scales / strokes.scales
    assert ((growth >= 1) & (growth <= 3 * (1 + 1e-6))).all()


def wall(depth, half, colors):
    """A flat wall across the view."""
    return gaussians_at(grid(round(20 * half), half, depth), (0.06, 0.06, 1e-3), colors, opacity=0.95)


def test_the_focus_is_what_views_show_of_it():
    scene = Gaussians.joined([wall(3, 0.9, 0.2), wall(9, 8, 0.8), wall(12, 8, 0.1)])  # the last is hidden
    is_back = scene.means[:, 2] > 5
    np.testing.assert_allclose(focused(scene, [VIEW], is_back).depths, [[9, 9]])
    np.testing.assert_allclose(focused(scene, [VIEW], None).depths, [[3, 3]])  # the middle shows the front
    away = Camera.look_at((0, 0, 0), (0, 0, -1), width=160, height=120)
    nothing = focused(scene, [away], None)
    np.testing.assert_array_equal(nothing.depths, [[away.near, np.inf]])
    assert nothing.blur(scene.means).max() == 0


@for_each("place", [(0.0, 0.0, -0.1), (0.3, 0.0, 0.05)])
def test_strokes_beside_and_behind_the_camera_do_not_grow_into_the_picture(place):
    strokes = replace(dots([1.0], size=0.05), means=np.array([place]))
    np.testing.assert_array_equal(defocus(strokes, LENS, 1.0).scales, strokes.scales)
