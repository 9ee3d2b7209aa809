import re
from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.measure.warp import View, match_views
from tests.measure.warped import warp_error


def camera_at(x, *, towards=0.0, size=(96, 80)):
    return bg.Camera.look_at((x, -0.3, -4.0), (towards, 0, 0), width=size[0], height=size[1])


def plane_view(camera, z=0.0, pattern=0.5):
    """The plane world z = `z` with a smooth pattern in its own coordinates, and its exact depth."""
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    pixels = np.stack([columns, rows, np.ones_like(rows)], axis=-1)
    rays = pixels @ np.linalg.inv(camera.K).T
    world = rays @ camera.viewmat[:3, :3]
    depth = (z - camera.position[2]) / world[..., 2]
    points = camera.position + world * depth[..., None]
    rgb = 0.5 + pattern * np.sin(3 * points[..., :1] + np.array([0, 1, 2]) + 2 * points[..., 1:2])
    return View(rgb, depth, np.ones_like(depth), camera)


def test_a_plane_seen_twice_has_no_error_but_the_interpolation():
    error = warp_error(plane_view(camera_at(0.0)), plane_view(camera_at(0.15)), keep_map=True)
    # second derivative (3^2 + 2^2) * 0.5, pixels of 0.047: at most 13 * 0.5 * 0.047^2 / 8 * 2 = 0.0036
    assert error.rmse < error.worst_1pct < 0.0036
    assert 0.9 < error.valid_share < 1
    assert np.mean(np.isfinite(error.squared_error)) == pytest.approx(error.valid_share)
    assert np.sqrt(np.nanmean(error.squared_error)) == pytest.approx(error.rmse, rel=1e-5)


def test_a_change_of_color_is_the_error_and_the_worst_pixels_are_those_of_largest():
    view = plane_view(camera_at(0.0))
    assert warp_error(view, view).rmse < 1e-6
    brighter = warp_error(view, replace(view, rgb=view.rgb + 0.1))
    assert brighter.rmse == pytest.approx(0.1, rel=1e-4)
    rgb = view.rgb.copy()
    rgb[30:34, 30:50] += 0.5  # 80 of 7680 pixels: a little more than the worst 1 % (7505 valid)
    error = warp_error(view, replace(view, rgb=rgb))
    assert error.worst_1pct == pytest.approx(0.5, rel=1e-4)
    assert error.rmse == pytest.approx(0.5 * np.sqrt(80 / (7680 * error.valid_share)), rel=1e-4)


def test_what_the_first_view_does_not_see_is_not_valid():
    first, second = plane_view(camera_at(0.0)), plane_view(camera_at(0.15))
    hidden = np.zeros(first.depth.shape, bool)
    hidden[20:40, 30:60] = True
    covered = replace(first, depth=np.where(hidden, 0.5, 1) * first.depth)
    covered = replace(covered, rgb=np.where(hidden[..., None], 9.0, first.rgb))
    error = warp_error(covered, second)
    assert error.rmse < 0.0036
    lost = warp_error(first, second).valid_share - error.valid_share
    assert 20 * 30 < lost * hidden.size < 22 * 32  # and a seam of one pixel


def test_faint_pixels_are_not_valid_in_either_view():
    first, second = plane_view(camera_at(0.0)), plane_view(camera_at(0.15))
    left = np.arange(first.depth.shape[1]) < 40
    alpha = np.where(left, 0.4, 1.0) * np.ones_like(first.depth)
    for pair in ((replace(first, alpha=alpha), second), (first, replace(second, alpha=alpha))):
        assert 0.45 < warp_error(*pair).valid_share < 0.6
    empty = replace(first, alpha=np.zeros_like(first.depth), depth=np.zeros_like(first.depth))
    nothing = warp_error(first, empty)
    assert (nothing.rmse, nothing.worst_1pct, nothing.valid_share) == (0, 0, 0)


def test_views_may_differ_in_size_and_those_behind_each_other_match_nothing():
    first, second = plane_view(camera_at(0.0, size=(192, 160))), plane_view(camera_at(0.15))
    assert warp_error(first, second).rmse < 0.002
    beyond = bg.Camera.look_at((0, 0, 4.0), (0, 0, 8.0), width=96, height=80)
    assert warp_error(replace(second, camera=beyond), second).valid_share == 0


def test_a_picture_of_another_size_is_refused():
    view = plane_view(camera_at(0.0))
    with pytest.raises(ValueError, match=re.escape("View: rgb must have shape [80, 96, 3], got [80, 95, 3]")):
        replace(view, rgb=view.rgb[:, 1:])
    with pytest.raises(ValueError, match="error: second must have shape"):
        match_views(view, view).error(view.rgb, view.rgb[1:])


def test_rendered_gaussians_on_a_plane_keep_still():
    """The whole way: a wall of Gaussians, drawn by the plain kernel from two places."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-2, 2, 40), np.linspace(-2, 2, 40)))
    means = np.stack([x, y, np.zeros_like(x)], axis=1)
    sh = (np.stack([np.sin(2 * x), np.cos(2 * y), np.sin(x + y)], axis=1) * 0.7)[:, None]
    quats, scales = np.tile([1.0, 0, 0, 0], (len(x), 1)), np.tile([0.1, 0.1, 0.0], (len(x), 1))
    wall = bg.Gaussians(means, quats, scales, np.full(len(x), 0.95), sh)
    plain, painted = [], []
    for camera in (camera_at(0.0), camera_at(0.1, towards=0.1)):  # not turned: the order by depth stays
        frame = bg.render(wall, camera, bg.StrokeTexture.open("gaussian"))
        plain.append(View(frame.over((1, 1, 1)), frame.depth, frame.alpha, camera))
        strokes = bg.render(wall, camera, bg.StrokeTexture.open("dry_brush"), filter="nearest")
        painted.append(replace(plain[-1], rgb=strokes.over((1, 1, 1))))
    error = warp_error(*plain)
    assert error.valid_share > 0.7
    assert error.rmse < 0.005
    assert warp_error(*painted).rmse > 2 * error.rmse
