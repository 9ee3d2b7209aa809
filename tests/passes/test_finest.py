"""What is thinner than the low-pass of the renderer is weighed by what pictures show of it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from brushgs.passes.extent import robust_frame
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.reduce.contribution import projected_areas, seen_areas
from brushgs.rendering.render import render
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.passes.scenes import random_gaussians, replaced

PIXEL = np.sqrt(0.3)  # standard deviation of the low-pass


def camera(eye=(0, 0, -6.0), target=(0, 0, 0), *, width=320, height=240):
    return Camera.look_at(eye, target, width=width, height=height, near=1e-3)


def test_the_finest_line_is_the_low_pass_at_the_distance_of_the_scene_in_the_median_view():
    scene = random_gaussians(500)
    center, radius = robust_frame(scene.means)

    def from_away(distance):
        return camera(center + np.array((0, 0, -distance)), center)

    near, far, inside = from_away(6.0), from_away(60.0), camera(center, center + np.array((0, 0, 1.0)))
    line = PIXEL / near.resized(960, 720).K[1, 1]
    for width, height in ((960, 720), (80, 60)):  # whatever the size of the picture
        assert finest_of(scene, [near.resized(width, height)]) == pytest.approx(6.0 * line)
    assert finest_of(scene, [inside]) == pytest.approx(0.5 * radius * line)
    assert finest_of(scene, [near, far, near]) == finest_of(scene, [near])
    assert finest_of(scene) == pytest.approx(finest_of(scene, [from_away(2.4 * radius)]))
    assert finest_of(replace(scene, finest=0.5), [near]) == 0.5
    assert finest_of(replace(scene, antialiased=True), [near]) == 0  # it gets fainter in place of thicker


@given(st.floats(0, 1), st.floats(1, 100))
def test_areas_change_without_a_jump_as_a_disc_narrows_to_a_needle(thin, long):
    def area(middle):
        return projected_areas(seen_scales(np.array([[thin * middle, middle, long]]), 1.0))[0]

    assert area(1 - 1e-9) == pytest.approx(area(1.0), rel=1e-6)


@for_each("scales", [(1e-6, 1e-6, 1.0), (1e-6, 1e-6, 1e-6), (0.2, 0.2, 1.0), (1e-6, 0.5, 0.8)])
def test_pictures_show_that_area_on_the_average_over_views(scales):
    """Faint, so that what a picture shows is in proportion. The formula is within a fifth."""
    one = replaced(
        random_gaussians(1), means=np.zeros((1, 3)), scales=np.array([scales]), opacities=np.array([0.05])
    )
    painted, directions = [], np.random.default_rng(0).normal(size=(60, 3))
    for direction in directions / np.linalg.norm(directions, axis=1, keepdims=True):
        view = camera(20 * direction, width=400, height=400)
        painted.append(render(one, view, "gaussian").alpha.sum(dtype=np.float64))
    pixel = 20 / view.K[1, 1]
    area = seen_areas(replace(one, finest=PIXEL * pixel))[0]
    # The kernel ends at three standard deviations, and below 1/255 of alpha: a tenth or more of faint paint.
    assert np.mean(painted) == pytest.approx(2 * np.pi * 0.05 * area / pixel**2, rel=0.25)
