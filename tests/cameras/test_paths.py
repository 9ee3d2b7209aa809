import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.cameras.framing import AXES, MARGIN, plain_first_view, subject
from brushgs.cameras.motion import view_change
from brushgs.cameras.orbit import orbit
from brushgs.cameras.paths import path_through, plan_path, turn_around
from brushgs.errors import SceneError
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import MAX_FRAMES, PathConfig
from brushgs.values.camera import Camera
from tests.cameras.test_framing import box, cloud, pixels
from tests.kit.for_each import for_each
from tests.scenes import still_life_of

SIZE = {"width": 64, "height": 48}


POINTS = {"center": (3, -4, 5), "num": 300}
SCENE = cloud(box(**POINTS))


def reach(camera, points):
    """Largest distance of points from the middle of the picture, in half pictures, and their camera z."""
    places, depths = pixels(camera, np.asarray(points, dtype=float))
    return np.abs(places).max(), depths


def axes_of(camera):
    """Right, down, forward in the world."""
    return camera.viewmat[:3, :3]


def angle_between(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)


VIEWS = {"azimuth": st.floats(-3.2, 3.2), "elevation": st.none() | st.floats(-1.57, 1.57)}
VIEWS |= {"fov_y": st.floats(0.2, 2.2), "up": st.sampled_from(list(AXES.values()))}
SIZES = st.sampled_from([(640, 480), (100, 700), (1280, 72)])
EXTENTS = st.sampled_from([(2, 1, 1.5), (0.1, 3, 0.1), (4, 0.2, 1), (1e-4, 1e-4, 1e-4)])


@settings(max_examples=25, deadline=None)
@given(st.fixed_dictionaries(VIEWS | {"over_poles": st.booleans()}), SIZES, EXTENTS)
def test_every_view_of_an_orbit_holds_the_subject_and_no_farther_than_needed(view, size, extent):
    scene = cloud(box(extent, **POINTS))
    cameras = orbit(scene, 24, width=size[0], height=size[1], **view)
    # Float32 means near (3, -4, 5) lie on a grid of 5e-7, which the smallest box feels.
    points, _ = subject(scene)
    for camera in cameras:
        filled, depths = reach(camera, points)
        assert filled < 1 - MARGIN
        assert depths.min() > camera.near


@for_each("over_poles", [False, True])
@for_each("num", [3, 7, 120])
def test_an_orbit_closes_in_even_steps_and_does_not_repeat_its_first_view(over_poles, num):
    cameras = orbit(SCENE, num, over_poles=over_poles, **SIZE)
    assert len(cameras) == num
    for one, two in pairwise([*cameras, cameras[0]]):
        assert view_change(one, two, 1e9) == pytest.approx(2 * np.pi / num, rel=1e-9)
    center = lines_meet(cameras)
    distances = [np.linalg.norm(camera.position - center) for camera in cameras]
    np.testing.assert_allclose(distances, distances[0], rtol=1e-12)
    assert len({camera.near for camera in cameras}) == 1


def lines_meet(cameras):
    """The point nearest to the optical axes of all cameras: the least squares of the distances."""
    forwards = np.stack([axes_of(camera)[2] for camera in cameras])
    off = np.eye(3) - forwards[:, :, None] * forwards[:, None]
    positions = np.stack([camera.position for camera in cameras])
    return np.linalg.solve(off.sum(axis=0), np.einsum("nij,nj->i", off, positions))


@for_each("up", sorted(AXES))
def test_an_orbit_looks_at_one_point_inside_the_subject_at_constant_elevation(up):
    cameras = orbit(SCENE, 16, up=AXES[up], elevation=0.3, **SIZE)
    center = lines_meet(cameras)
    assert (np.abs(center - (3, -4, 5)) < np.array((2, 1, 1.5)) / 2).all()
    for camera in cameras:
        assert np.cross(camera.position - center, axes_of(camera)[2]) == pytest.approx(0, abs=1e-10)
        assert -axes_of(camera)[2] @ AXES[up] == pytest.approx(np.sin(0.3), rel=1e-12)
        assert axes_of(camera)[0] @ AXES[up] == pytest.approx(0, abs=1e-12)


def test_over_the_poles_passes_both_and_the_picture_never_spins():
    num = 72
    cameras = orbit(SCENE, num, elevation=0.0, over_poles=True, **SIZE)
    up = np.array(AXES["-y"])
    heights = [-axes_of(camera)[2] @ up for camera in cameras]
    assert max(heights) == pytest.approx(1, abs=1e-12)
    assert min(heights) == pytest.approx(-1, abs=1e-12)
    for one, two in pairwise([*cameras, cameras[0]]):
        turn = axes_of(two) @ axes_of(one).T
        roll = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])  # about the line of sight
        assert abs(roll) < 1e-12
        assert angle_between(axes_of(one)[1], axes_of(two)[1]) == pytest.approx(2 * np.pi / num, rel=1e-9)


def test_an_orbit_of_nothing_or_of_no_frames_is_refused():
    with pytest.raises(ValueError, match="at least one row"):
        orbit(cloud(np.zeros((0, 3))), 3, **SIZE)
    with pytest.raises(ValueError, match="orbit: num_frames must be at least 1, got 0"):
        orbit(SCENE, 0, **SIZE)


# --- the path that is asked for


def matrix_of(camera):
    """World from camera with x right, y up, z backward, as nerfstudio writes it."""
    return np.linalg.inv(camera.viewmat) @ np.diag([1.0, -1, -1, 1])


def views(num, width=64, height=48):
    eyes = [(3 + 4 * np.sin(t), -5, 5 - 4 * np.cos(t)) for t in np.linspace(0.1, 5.0, num)]
    return [Camera.look_at(eye, (3, -4, 5), fov_y=0.9, width=width, height=height) for eye in eyes]


def write_inria(tmp_path, cameras):
    path = tmp_path / "cameras.json"
    entries = []
    for c in cameras:
        placed = {"position": c.position.tolist(), "rotation": axes_of(c).T.tolist()}
        entries.append(placed | {"width": c.width, "height": c.height, "fx": c.K[0, 0], "fy": c.K[1, 1]})
    path.write_text(json.dumps(entries))
    return path


def write_camera_path(tmp_path, frames, keys=(), **fields):
    path = tmp_path / "camera_path.json"
    fov = float(np.degrees(0.9))
    content = {
        "render_width": 64,
        "render_height": 48,
        "camera_path": [{"camera_to_world": matrix_of(c).ravel().tolist(), "fov": fov} for c in frames],
        "keyframes": [{"matrix": matrix_of(c).ravel().tolist(), "fov": fov} for c in keys],
    }
    path.write_text(json.dumps(content | fields))
    return path


def plan(file=None, *, view=None, scene=SCENE, **options):
    first_view = plain_first_view(scene) if len(scene) else None
    return plan_path(first_view, view or ViewConfig(), PathConfig(file=file, **options))


def assert_same_views(found, expected, atol=1e-12):
    assert len(found) == len(expected)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one.viewmat, other.viewmat, atol=atol)
        np.testing.assert_allclose(one.K, other.K, rtol=1e-9)
        assert (one.width, one.height) == (other.width, other.height)


def test_a_camera_file_beside_a_path_is_refused():
    with pytest.raises(ValueError, match="camera-file cannot be combined with a camera path"):
        plan(view=ViewConfig(camera_file=Path("a.json")), orbit=3)


def test_the_views_of_a_training_are_the_frames(tmp_path):
    cameras = views(5)
    path = plan(write_inria(tmp_path, cameras))
    assert_same_views(path.cameras, cameras)
    assert (path.is_loop, path.fps, path.source) == (False, 24, "5 views of cameras.json")


@for_each("loop", [False, True])
def test_with_a_number_of_frames_they_are_key_views(tmp_path, loop):
    cameras = views(5)
    path = plan(write_inria(tmp_path, cameras), frames=41, loop=loop)
    assert len(path.cameras) == 41
    assert_same_views(path.cameras[:1], cameras[:1], atol=1e-9)
    assert path.source == "a curve through 5 key views of cameras.json"
    if loop:
        assert view_change(path.cameras[-1], path.cameras[0], 4.0) > 0.1
    else:
        assert_same_views(path.cameras[-1:], cameras[-1:], atol=1e-9)


@for_each("loop", [False, True])
def test_the_frame_rate_does_not_change_the_way(tmp_path, loop):
    file = write_inria(tmp_path, views(5))
    slow, fast, faster = (plan(file, seconds=2, fps=fps, loop=loop) for fps in (12, 24, 120))
    assert len(slow.cameras) == 24 + (not loop)
    assert len(faster.cameras) == 240 + (not loop)
    assert_same_views(fast.cameras[::2], slow.cameras)
    assert_same_views(faster.cameras[::10], slow.cameras)


def test_the_poses_of_a_camera_path_are_the_frames_with_its_rate(tmp_path):
    frames, keys = views(6), views(3)
    path = plan(write_camera_path(tmp_path, frames, keys, fps=15, seconds=4.0, is_cycle=True))
    assert_same_views(path.cameras, frames)
    assert (path.is_loop, path.fps) == (True, 15)
    assert plan(write_camera_path(tmp_path, frames, fps=15), fps=60).fps == 60
    assert plan(write_camera_path(tmp_path, frames, seconds=3.0)).fps == 2
    assert plan(write_camera_path(tmp_path, frames)).fps == 24
    with pytest.raises(SceneError, match=r"path\.json: says 1e\+06 frames a second, above 1000; give --fps"):
        plan(write_camera_path(tmp_path, frames, fps=1e6))


def test_a_loop_leaves_out_a_last_view_that_is_the_first_again(tmp_path):
    cameras = views(5)
    closed = write_inria(tmp_path, [*cameras, cameras[0]])
    assert_same_views(plan(closed, loop=True).cameras, cameras)
    assert len(plan(closed).cameras) == 6
    curve = plan(closed, frames=10, loop=True).cameras
    open_file = write_inria(tmp_path, cameras)
    assert_same_views(plan(open_file, loop=True).cameras, cameras)
    assert_same_views(plan(open_file, frames=10, loop=True).cameras, curve)


def test_too_few_key_views_are_refused_with_the_file(tmp_path):
    file = write_inria(tmp_path, views(1))
    assert len(plan(file).cameras) == 1
    with pytest.raises(SceneError, match=r"\.json: a path must have at least 2 different key views, got 1; "):
        plan(file, frames=10)
    with pytest.raises(SceneError, match="at least 3 different key views, got 2; omit frames and seconds"):
        plan(write_inria(tmp_path, views(2)), seconds=1.0, loop=True)


@for_each("seconds, fps", [(1e-3, 24), (1e9, 24), (1e300, 1000)])
def test_a_senseless_duration_is_refused(tmp_path, seconds, fps):
    with pytest.raises(ValueError, match=f"seconds times fps must give 1 to {MAX_FRAMES} frames, got"):
        plan(write_inria(tmp_path, views(3)), seconds=seconds, fps=fps)


@for_each(
    ("options", "sentence"),
    [
        ({"fps": 24.0}, "a camera path must be either an orbit or a path from a file, got neither"),
        ({"orbit": 9, "file": Path("a.json")}, "got both"),
        ({"orbit": 9, "frames": 9}, "frames cannot be combined with orbit, which is a number of frames;"),
        ({"orbit": 9, "seconds": 3.0}, "seconds cannot be combined with orbit, .*; set fps"),
        ({"file": Path("a"), "frames": 9, "seconds": 3.0}, "frames cannot be combined with seconds"),
        ({"file": Path("a"), "fps": 0.0}, "fps must be above 0 and at most 1000, got 0"),
    ],
)
def test_senseless_paths_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        PathConfig(**options)


@for_each("up", [(0, -1, 0), (1, 2, -3)])
def test_a_turn_around_the_middle_of_an_orbit_is_that_orbit(up):
    cameras = orbit(still_life_of(1000), 6, width=80, height=60, up=up)
    center = np.mean([camera.position for camera in cameras], axis=0)
    path = turn_around(cameras[0], center, np.multiply(up, 7), seconds=2, fps=3)
    assert (path.is_loop, path.fps) == (True, 3)
    for ours, theirs in zip(path.cameras, cameras, strict=True):
        assert np.allclose(ours.viewmat, theirs.viewmat, rtol=0, atol=1e-9)


def test_a_path_through_key_views_begins_and_ends_with_them():
    cameras = orbit(still_life_of(1000), 6, width=80, height=60)
    keys = [cameras[0].resized(160, 120), cameras[1], cameras[2].resized(40, 30)]
    path = path_through(keys, plain_first_view(still_life_of(1000)), size=(64, 48), seconds=2, fps=2)
    assert len(path.cameras) == 5
    assert {(camera.width, camera.height) for camera in path.cameras} == {(64, 48)}
    assert np.allclose(path.cameras[0].viewmat, cameras[0].viewmat, rtol=0, atol=1e-9)
    assert np.allclose(path.cameras[-1].viewmat, cameras[2].viewmat, rtol=0, atol=1e-9)
    with pytest.raises(ValueError, match="at least 2 different key views, got 1"):
        path_through(keys[:1], None, size=(64, 48), seconds=1)
