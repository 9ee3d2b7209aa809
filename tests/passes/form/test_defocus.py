"""Detail that is lost with distance from the focus: its law, its limits, and what stays."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.form.defocus import Lens, defocus, focused
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0, base_colors
from tests.passes.scenes import assert_same

VIEW = Camera.look_at((0, 0, 0), (0, 0, 1), width=160, height=120)  # z is depth
SHARP = 4.0
NO_COLORS = np.empty((0, 3)), np.empty((0, 3)), np.empty(0)
LENS = Lens([VIEW], np.array([[SHARP, SHARP]]), *NO_COLORS)


def dots(depths, size=0.01, opacity=0.9, rgb=0.5):
    """Small round strokes along the axis of the view."""
    count = len(depths)
    means = np.stack([np.zeros(count), np.zeros(count), np.asarray(depths, float)], axis=1)
    sh = np.full((count, 1, 3), 1.0) * ((np.broadcast_to(rgb, count) - 0.5) / C0)[:, None, None]
    return Gaussians(
        means,
        np.tile([1.0, 0, 0, 0], (count, 1)),
        np.full((count, 3), size),
        np.full(count, opacity),
        sh,
    )


def growth_of(strokes, lens=LENS, strength=1.0):
    return (defocus(strokes, lens, strength).scales / strokes.scales)[:, 0]


def test_nothing_changes_at_strength_0_and_in_focus():
    strokes = dots([1, SHARP, 9])
    assert defocus(strokes, LENS, 0) is strokes
    sharp = strokes.take([1])
    assert_same(defocus(sharp, LENS, 1), sharp)


@pytest.mark.parametrize("strength", [0.3, 1.0])
def test_strokes_grow_as_a_lens_blurs(strength):
    depths = np.array([2.5, 3, 3.9, SHARP, 4.2, 6, 20, 1e3])
    expected = 1 + 2 * strength * np.abs(1 / depths - 1 / SHARP) * SHARP
    np.testing.assert_allclose(growth_of(dots(depths, size=1e-3), strength=strength), expected, rtol=1e-12)


def test_growth_opacity_and_contrast_follow_the_blur():
    depths = np.array([4, 4.5, 5, 6, 8, 12, 30, 100, 1e4])
    strokes = dots(depths, size=1e-3, rgb=np.where(np.arange(9) % 2, 0.8, 0.2))
    lens = replace(LENS, places=strokes.means, colors=np.full((9, 3), 0.5), areas=np.ones(9))
    found = defocus(strokes, lens, 1)
    growth = found.scales[:, 0] / strokes.scales[:, 0]
    assert (np.diff(growth) > 0).all()
    assert (np.diff(found.opacities) < 0).all()
    contrast = np.abs(base_colors(found.sh) - 0.5)[:, 0]
    np.testing.assert_allclose(contrast, 0.3 / growth)


@pytest.mark.parametrize("depth", [-1e6, -1.0, 0.0, 1e-12, VIEW.near, 1e6, 1e18, 1e30])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_extreme_depths_stay_finite_and_within_threefold(depth, dtype):
    strokes = dots([depth, SHARP])
    names = ("means", "quats", "scales", "opacities", "sh")
    strokes = replace(strokes, **{name: getattr(strokes, name).astype(dtype) for name in names})
    found = defocus(strokes, focused(strokes, [VIEW], None), 1)
    for name in names:
        assert np.isfinite(getattr(found, name)).all()
        assert getattr(found, name).dtype == dtype
    growth = found.scales / strokes.scales
    assert (growth >= 1).all()
    assert (growth <= 3 * (1 + 1e-6)).all()
    assert ((found.opacities >= 0) & (found.opacities <= 1)).all()


def wall(depth, half, colors, step=0.1):
    """A flat wall across the view."""
    axis = np.arange(-half, half, step)
    x, y = (values.ravel() for values in np.meshgrid(axis, axis))
    means = np.stack([x, y, np.full(len(x), float(depth))], axis=1)
    count = len(means)
    sh = np.full((count, 1, 3), (colors - 0.5) / C0)
    scales = np.tile([0.6 * step, 0.6 * step, 1e-3], (count, 1))
    return Gaussians(means, np.tile([1.0, 0, 0, 0], (count, 1)), scales, np.full(count, 0.95), sh)


def joined(*scenes):
    return Gaussians(
        *(
            np.concatenate([getattr(one, name) for one in scenes])
            for name in ("means", "quats", "scales", "opacities", "sh")
        )
    )


def test_the_focus_is_what_views_show_of_it():
    front, back = wall(3, 0.9, 0.2), wall(9, 8, 0.8)
    hidden = wall(12, 8, 0.1)
    scene = joined(front, back, hidden)
    is_back = np.repeat([False, True, True], [len(front), len(back), len(hidden)])
    np.testing.assert_allclose(focused(scene, [VIEW], is_back).depths, [[9, 9]])
    np.testing.assert_allclose(focused(scene, [VIEW], None).depths, [[3, 3]])  # the middle shows the front
    away = Camera.look_at((0, 0, 0), (0, 0, -1), width=160, height=120)
    low, high = focused(scene, [away], None).depths[0]  # which shows nothing
    assert (low, high) == (away.near, np.inf)
    assert focused(scene, [away], None).blur(scene.means).max() == 0


def test_a_strength_out_of_range_is_refused():
    with pytest.raises(ValueError, match=r"defocus: strength must be in \[0, 1\], got 1.5"):
        defocus(dots([1]), LENS, 1.5)


@pytest.mark.parametrize("place", [(0.0, 0.0, -0.1), (0.3, 0.0, 0.05)])
def test_strokes_beside_and_behind_the_camera_do_not_grow_into_the_picture(place):
    strokes = replace(dots([1.0], size=0.05), means=np.array([place]))
    np.testing.assert_array_equal(growth_of(strokes), 1)
