"""What a pose does to strokes, and what lies between two."""

from dataclasses import replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.coat import Coat
from brushgs.rendering.motion import AT_REST, COLOR, OPACITY, SHIFT, SIZE, TURN, Pose, StrokeMotion, new_table
from brushgs.rendering.nested import Nested
from brushgs.rendering.options import RenderOptions
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors
from tests.kit.for_each import for_each
from tests.passes.scenes import columns_of, random_gaussians
from tests.rendering.moving_strokes import turn_about, with_ids

FLAT = StrokeTexture.open("flat")


def strokes_of(n=6, dtype=np.float64, **columns):
    """Strokes in colors that do not clip."""
    strokes = random_gaussians(n, terms=4, dtype=dtype)
    return replace(strokes, sh=(0.1 * strokes.sh).astype(dtype), **columns)


def at_rest(ids, pivots=None):
    """A pose in which nothing moves."""
    ids = np.asarray(ids, np.int32)
    pivots = np.zeros((len(ids), 3)) if pivots is None else pivots
    return Pose(ids, pivots, np.tile(np.float32(AT_REST), (len(ids), 1)))


@for_each("dtype", [np.float32, np.float64])
def test_a_pose_moves_strokes_as_one_body_around_the_pivot(dtype):
    strokes = with_ids(strokes_of(6, dtype), [3] * 6)
    pose = at_rest([3], np.array([[1.0, 2, 3]]))
    turn = turn_about([1, -1, 2], 1.2)
    pose.numbers[0, SHIFT], pose.numbers[0, TURN], pose.numbers[0, SIZE] = (4, 5, 6), turn, np.log(3)
    moved = pose.moved(strokes)
    R = rotation_matrices(turn[None])[0]
    expected = (strokes.means - pose.pivots[0]) @ R.T * 3 + pose.pivots[0] + (4, 5, 6)
    np.testing.assert_allclose(moved.means, expected, atol=1e-5)
    np.testing.assert_allclose(moved.scales, 3 * strokes.scales, rtol=1e-6)
    turned = rotation_matrices(moved.quats)
    np.testing.assert_allclose(turned, R @ rotation_matrices(strokes.quats), atol=1e-6)
    assert moved.means.dtype == dtype
    np.testing.assert_allclose(pose.turned(strokes, strokes.means), strokes.means @ R.T, atol=1e-5)
    nested = Nested(strokes.means, np.ones(6), np.ones(6))
    coat = Coat("lines", strokes, FLAT, RenderOptions.of(FLAT), nested=nested).posed(pose)
    np.testing.assert_allclose(coat.nested.gaps, strokes.means @ R.T, atol=1e-5)


def test_opacity_is_a_factor_and_color_is_added():
    strokes = with_ids(strokes_of(2, opacities=np.array([0.8, 0.4])))
    pose = at_rest([0, 1])
    pose.numbers[:, OPACITY] = 0.5, 4
    pose.numbers[:, COLOR] = 0.1, -0.05, 0
    moved = pose.moved(strokes)
    np.testing.assert_allclose(moved.opacities, [0.4, 1])
    change = base_colors(moved.sh) - base_colors(strokes.sh)
    np.testing.assert_allclose(change, np.tile((0.1, -0.05, 0), (2, 1)), atol=1e-7)
    np.testing.assert_array_equal(moved.sh[:, 1:], strokes.sh[:, 1:])
    np.testing.assert_array_equal(pose.moved(strokes, has_color=False).sh, strokes.sh)


def test_marks_move_with_the_stroke_of_their_id_and_others_rest():
    marks = with_ids(strokes_of(5), [7, -1, 2, 7, 9])
    pose = at_rest([2, 7])
    pose.numbers[:, SHIFT] = (1, 0, 0), (0, 1, 0)
    moved = pose.moved(marks)
    shifts = [(0, 1, 0), (0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 0)]
    np.testing.assert_allclose(moved.means - marks.means, shifts, atol=1e-12)
    np.testing.assert_array_equal(moved.ids, marks.ids)
    for column, before in zip(columns_of(moved), columns_of(marks), strict=True):
        np.testing.assert_array_equal(column[[1, 4]], before[[1, 4]])


def turning(num_times=4, step=np.pi / 2):
    """One stroke that turns and moves by equal steps."""
    table = new_table(num_times, 1)
    steps = np.arange(num_times)
    turns = turn_about([[0, 0, 1]] * num_times, step * steps)
    table[:, 0, TURN], table[:, 0, 0] = turns, steps
    return StrokeMotion(10.0 * steps, np.zeros(1, np.int32), np.zeros((1, 3)), table)


def test_between_two_moments_strokes_are_between_their_poses():
    motion = turning()
    halfway = motion.pose(1.5)
    np.testing.assert_allclose(halfway.numbers[0, 0], 1.5)
    expected = turn_about([[0, 0, 1]], [1.5 * np.pi / 2])[0]
    np.testing.assert_allclose(np.abs(halfway.numbers[0, TURN] @ expected), 1, atol=1e-6)
    np.testing.assert_array_equal(motion.pose(2).numbers, motion.table[2])
    np.testing.assert_array_equal(motion.pose(3.0).numbers, motion.table[3])


def test_times_are_found_among_the_moments_and_outside_at_the_ends():
    motion = turning()
    np.testing.assert_allclose(motion.positions(np.array([-5.0, 0, 15, 30, 99])), [0, 0, 1.5, 3, 3])
