"""What each Gaussian makes up of a picture is measured exactly."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.rendering.backward import FrameGradients, rasterize_backward
from brushgs.rendering.rasterize import RasterOptions
from brushgs.rendering.visibility import painted_shares, painted_sums, visible_areas
from tests.doctor.scenes import ball
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, grid

CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=96, height=72)
KERNEL = bg.StrokeTexture.open("gaussian")


def wall(z, opacity=1.0):
    """A square of 8 x 8 units that faces the camera."""
    return gaussians_at(grid(41, 4.0, z), (0.2, 0.2, 0.001), opacity=opacity, dtype=np.float32)


@for_each("antialiased", [False, True])
def test_together_they_are_the_alpha_of_the_picture(antialiased):
    scene = replace(ball(), scales=ball().scales * np.float32(0.2), antialiased=antialiased)
    frame = bg.render(scene, CAMERA, KERNEL)
    assert visible_areas(scene, CAMERA).sum() == pytest.approx(frame.alpha.sum(dtype=np.float64), rel=1e-5)


def test_what_is_hidden_or_outside_or_behind_the_camera_has_none():
    scene = bg.Gaussians.joined([wall(0.0), wall(1.0), wall(-9.0)])
    areas = visible_areas(scene, CAMERA)
    assert areas[:1681].sum() > 0.9 * 96 * 72
    assert areas[1681 : 2 * 1681].max() < 0.2
    assert (areas[2 * 1681 :] == 0).all()
    away = bg.Camera.look_at((0, 0, -4), (0, 0, -9), width=96, height=72)
    assert (visible_areas(ball(), away) == 0).all()


@for_each("num_threads", [1, 2])
@for_each("kernel", ["gaussian", "ellipse"])
@for_each("dtype", [np.float32, np.float64])
def test_sums_are_the_derivative_of_a_picture_by_its_colors_and_depths(dtype, kernel, num_threads):
    camera = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=101, height=70)  # tiles and blocks are cut
    kernel = bg.StrokeTexture.open(kernel)
    boxes = bg.project(ball().astype(dtype), camera)
    picture = np.random.default_rng(1).normal(size=(70, 101, 4)).astype(dtype)
    values, shares = np.ascontiguousarray(picture[..., :3]), np.ascontiguousarray(picture[..., 3])
    sums, areas = painted_sums(boxes, kernel, values, shares, num_threads=num_threads)
    # With an alpha of 1 a layer is a sum by weights, as a color is.
    flat = bg.Frame(np.zeros_like(values), np.ones_like(shares), np.zeros_like(shares))
    v = FrameGradients(values, None, {"depth": shares})
    expected = rasterize_backward(boxes, kernel, flat, v, RasterOptions(70, 101))
    np.testing.assert_array_equal(sums, expected.colors)
    np.testing.assert_array_equal(areas, expected.depths)
    np.testing.assert_array_equal(painted_shares(boxes, kernel, shares, num_threads=num_threads), areas)
    assert (areas != 0).mean() > 0.2


def test_nothing_makes_up_no_picture():
    boxes = bg.project(ball(), CAMERA)[:0]
    sums, areas = painted_sums(boxes, KERNEL, np.ones((72, 96, 3)), np.ones((72, 96)))
    assert (sums.shape, areas.shape) == ((0, 3), (0,))
