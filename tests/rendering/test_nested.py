"""Levels of marks: which are seen from where, how wide, and how faint."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.rendering.nested import GONE, WHOLE, Nested
from brushgs.rendering.project import project
from brushgs.values.camera import Camera
from tests.passes.scenes import gaussians_at


def camera(distance=4.0, width=960, height=540):
    return Camera.look_at((0, 0, -distance), (0, 0, 0), width=width, height=height, fov_y=0.8)


def line(count=1):
    """Horizontal lines in the plane z = 0."""
    return gaussians_at(np.zeros((count, 3)), (0.2, 0.01, 0.01), opacity=1)


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
        boxes = nested.of(project(line(), view), line(), view, np.zeros(1, np.intp))
        np.testing.assert_allclose(boxes.opacities, share, atol=1e-5)


@pytest.mark.parametrize("ratio", [0.62, 0.7, 0.8])
def test_a_line_gets_shorter_from_both_ends_and_no_crumbs_of_it_are_left(ratio):
    """Seven pieces in a row, turned to and fro; what is left is one line around the middle."""
    view, count = camera(), 7
    far = gap_of(34.0, view)
    pieces = line(count)
    pieces = replace(
        pieces,
        means=np.stack([far * (np.arange(count) - 3), 0 * np.arange(count), 0 * np.arange(count)], axis=1),
        quats=np.where(np.arange(count)[:, None] % 2, [[1.0, 0, 0, 0]], [[0.0, 0, 0, 1]]),
    )
    gaps = np.tile([0, gap_of(5.0 * ratio, view), 0], (count, 1))
    nested = Nested(gaps, np.full(count, 5.0), np.full(count, 3.0))
    whole = project(pieces, view)
    boxes = nested.of(whole, pieces, view, np.zeros(count, np.intp))
    share = nested.shares(pieces.means, np.arange(count), np.zeros(count), view)[0]
    shown = boxes[boxes.opacities > 0]
    left, right = (shown.centers[:, 0] + side * shown.half_extents[:, 0] for side in (-1, 1))
    total = 2 * whole.half_extents[:, 0].sum()
    assert (right - left).sum() == pytest.approx(share * total, rel=1e-6)
    assert 0.5 * (left.min() + right.max()) == pytest.approx(480, abs=1e-6)
    assert (shown.opacities == 1).all()


def test_shares_are_finite_for_marks_beside_and_behind_the_camera():
    nested = Nested(np.ones((3, 3)), np.full(3, 5.0), np.ones(3))
    points = np.array([[0, 0, -4.0], [1e30, 0, 0], [0, 0, -40.0]])
    with np.errstate(over="ignore", invalid="ignore"):
        shares = nested.shares(points, np.arange(3), np.zeros(3), camera())
    assert ((shares >= 0) & (shares <= 1)).all()
