"""Levels of marks: which are seen from where, how wide, and how faint."""

import numpy as np
import pytest

from brushgs.rendering.nested import GONE, WHOLE, Nested
from brushgs.rendering.project import project
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians


def camera(distance=4.0, width=960, height=540):
    return Camera.look_at((0, 0, -distance), (0, 0, 0), width=width, height=height, fov_y=0.8)


def line(count=1):
    """Horizontal lines in the plane z = 0."""
    scales = np.tile([0.2, 0.01, 0.01], (count, 1))
    columns = np.zeros((count, 3)), np.tile([1.0, 0, 0, 0], (count, 1)), scales, np.ones(count)
    return Gaussians(*columns, np.zeros((count, 1, 3)))


def gap_of(pixels, view, distance=4.0):
    """World units of pixels in the plane z = 0."""
    return pixels * distance / view.K[1, 1]


@pytest.mark.parametrize("is_round", [False, True])
def test_a_mark_is_whole_where_its_gap_is_wide_enough_and_gone_where_it_is_not(is_round):
    view = camera()
    for ratio, share in ((WHOLE, 1.0), (GONE, 0.0), (2.0, 1.0)):
        gap = gap_of(5.0 * ratio, view)
        gaps = [[0, 0, gap]] if is_round else [[0, gap, 0]]
        nested = Nested(np.array(gaps), np.array([5.0]), np.array([3.0]), is_round)
        boxes = nested.of(project(line(), view), line(), view)
        np.testing.assert_allclose(boxes.opacities, share, atol=1e-5)


@pytest.mark.parametrize("distance", [2.0, 4.0])
@pytest.mark.parametrize("size", [(960, 540), (1920, 1080)])
def test_marks_are_equally_wide_from_near_and_far_and_grow_with_the_picture(distance, size):
    view = camera(distance, *size)
    nested = Nested(np.array([[0, 1.0, 0]]), np.array([5.0]), np.array([3.0]))
    boxes = nested.of(project(line(), view), line(), view)
    np.testing.assert_allclose(boxes.half_extents[:, 1], 1.5 * size[0] / 960, rtol=1e-6)


def test_shares_are_finite_for_marks_beside_and_behind_the_camera():
    nested = Nested(np.ones((3, 3)), np.full(3, 5.0), np.ones(3))
    points = np.array([[0, 0, -4.0], [1e30, 0, 0], [0, 0, -40.0]])
    with np.errstate(over="ignore", invalid="ignore"):
        shares = nested.shares(points, np.arange(3), np.zeros(3), camera())
    assert ((shares >= 0) & (shares <= 1)).all()
