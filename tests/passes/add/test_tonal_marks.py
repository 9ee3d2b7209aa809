"""Hatching and dots placed in views: evenly spaced, nested, along directions, and lifted to surfaces."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from brushgs.core.native import core as _core
from brushgs.passes.add.tonal_marks import Manner, tonal_marks
from brushgs.passes.add.tonal_view import TonalView
from brushgs.passes.form.plane_axes import mark_axes
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.passes.form.planks import long_axes
from tests.passes.scenes import gaussians_at


def camera_at(z):
    return Camera.look_at((0, 0, -z), (0, 0, 0), width=320, height=180, fov_y=0.8)


CAMERA = camera_at(4.0)
LINES = Manner(0.1, 0.8, (3.0, 9.0), (1.2, 0.8), (12.0, 60.0))
DOTS = Manner(0.1, 0.8, (3.0, 9.0), (1.2, 0.8))


def wall(angle=0.3, tilt=0.0):
    """A wall of strokes whose long axes run at an angle, 4 from the camera, turned about the vertical."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-2, 2, 41), np.linspace(-1, 1, 21)))
    turn = Rotation.from_euler("y", tilt)
    means = turn.apply(np.stack([x, y, 0 * x], axis=1))
    quats = np.roll((turn * Rotation.from_euler("z", angle)).as_quat(), 1)
    return gaussians_at(means, (0.1, 0.05, 0.001), opacity=0.95, quats=quats, dtype=np.float32)


def view_of(strokes, tones, camera=CAMERA, **options):
    axes, normals = mark_axes(strokes)
    return TonalView.of(strokes, np.broadcast_to(tones, len(strokes)), axes, normals, camera, **options)


def marks_of(strokes, tones=0.1, manner=LINES, cameras=(CAMERA,)):
    views = [view_of(strokes, tones, camera) for camera in cameras]
    return tonal_marks(views, manner, strokes, num_sigmas=2.0)


def traced(spacing, factors=(1.0,), *, step=1.0, taken=(), seeds=4000, directions=(1.0, 0.0), end=0.5):
    """The points of each line in a field of one direction, and their levels."""
    spacing = np.asarray(spacing, np.float32)
    height, width = spacing.shape
    field = np.tile(np.float32(directions), (height, width, 1))
    points, begins, levels = _core.trace_lines(
        field,
        spacing,
        np.array(taken, np.float64).reshape(-1, 2),
        np.random.default_rng(0).random((seeds, 2)) * (width, height),
        np.array(factors),
        step=step,
        shortest=5.0 * step,
        longest=40.0,
        end=end,
    )
    return np.split(points.reshape(-1, 2), begins[1:-1]), levels


def test_lines_keep_their_distance_and_fill_the_field():
    lines, _ = traced(np.full((60, 80), 4.0))
    points, owner = np.concatenate(lines), np.repeat(np.arange(len(lines)), [len(one) for one in lines])
    pairs = cKDTree(points).query_pairs(0.5 * 4.0 - 1e-9, output_type="ndarray")
    assert (owner[pairs[:, 0]] == owner[pairs[:, 1]]).all(), "only the points of one line are nearer"
    grid = np.stack(np.meshgrid(np.arange(80), np.arange(60)), axis=2).reshape(-1, 2)
    assert cKDTree(points).query(grid)[0].max() < 1.5 * 4.0


def test_lines_run_along_directions_and_end_where_there_are_none():
    spacing = np.full((60, 80), 4.0)
    spacing[:, 40:] = 0
    angle = 0.4
    lines, _ = traced(spacing, directions=(np.cos(2 * angle), np.sin(2 * angle)))
    for line in lines:
        assert (line[:, 0] < 40).all()
        along = np.diff(line, axis=0)
        np.testing.assert_allclose(np.abs(along @ (np.cos(angle), np.sin(angle))), 1, atol=1e-6)


def test_levels_are_nested_and_each_keeps_its_own_distance():
    dots, levels = traced(np.full((60, 80), 3.0), (4.0, 2.0, 1.0), step=0.0)
    points = np.concatenate(dots)
    for level, factor in enumerate((4.0, 2.0, 1.0)):
        nearest = cKDTree(points[levels <= level]).query(points[levels <= level], 2)[0][:, 1]
        assert nearest.min() >= factor * 3.0
    alone, _ = traced(np.full((60, 80), 3.0), (4.0,), step=0.0)
    np.testing.assert_array_equal(np.concatenate(alone), points[levels == 0])


@for_each("manner", [LINES, DOTS])
def test_marks_are_denser_in_the_dark_and_absent_in_the_light(manner):
    strokes = wall()
    counts = [len(np.unique(marks_of(strokes, tone, manner).chains)) for tone in (0.1, 0.6, 0.85)]
    assert counts[0] > 1.5 * counts[1] > 0
    assert counts[2] == 0


@for_each("manner", [LINES, DOTS])
def test_marks_lie_on_the_surface(manner):
    strokes = wall(tilt=0.4)
    marks = marks_of(strokes, manner=manner)
    normal = np.array([np.sin(0.4), 0, np.cos(0.4)])
    assert np.abs(marks.strokes.means @ normal).max() < 0.07, "the size of a stroke"
    assert np.median(shares_of(marks, strokes, CAMERA)) == 1, "in their own view marks are whole"


def shares_of(marks, strokes, camera):
    """What is drawn of marks in a view, by the angle in the picture of the directions of their wall."""
    x, y = view_of(strokes, 0.1).directions[90, 160]
    angles = np.full(len(marks), 0.5 * np.arctan2(y, x))
    return marks.nested.shares(marks.strokes.means, np.arange(len(marks)), angles, camera)


def test_hatching_follows_strokes_and_crosses_at_its_turn():
    for turn in (0, np.pi / 2):
        marks = marks_of(wall(angle=0.3), manner=replace(LINES, turn=turn))
        along = np.abs(long_axes(marks.strokes) @ (np.cos(0.3 + turn), np.sin(0.3 + turn), 0))
        assert np.quantile(along, 0.05) > np.cos(0.15)


@for_each("manner", [LINES, DOTS])
def test_density_on_paper_stays_from_half_the_distance_to_twice(manner):
    """Ink on paper over that in the own view: counted as width times length, or area."""
    strokes = wall()
    cameras = [camera_at(z) for z in (4.0, 2.0, 8.0)]
    marks = marks_of(strokes, manner=manner, cameras=cameras[:2])

    def ink(camera):
        field = view_of(strokes, 0.1, camera)
        shares = shares_of(marks, strokes, camera)
        pixels, is_seen = field.at(marks.strokes.means.astype(np.float64))
        inside = is_seen & (np.abs(pixels - (160, 90)) < (40, 25)).all(axis=1)  # on the wall in all views
        zoom = 4.0 / np.abs(camera.position[2])
        return float((shares * (1.0 if manner.is_round else zoom))[inside].sum())

    own, near, far = (ink(camera) for camera in cameras)
    assert 0.7 < near / own < 1.4
    assert 0.6 < far / own < 1.5


def test_strokes_of_a_wall_share_a_direction_and_those_of_a_ball_do_not():
    angles = np.random.default_rng(0).normal(0.3, 0.2, len(wall()))
    quats = np.roll(Rotation.from_euler("z", angles[:, None]).as_quat(), 1, axis=1)
    strokes = replace(wall(), quats=quats.astype(np.float32))
    planes, free = (mark_axes(strokes, with_planes=whether)[0] for whether in (True, False))
    for axes, least, most in ((planes, 0.999, 1.001), (free, 0, 0.95)):
        units = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        assert least < np.abs(units @ units[0]).min() < most
