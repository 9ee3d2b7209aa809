"""Camera animations of splat editors: timelines of LichtFeld Studio and projects of SuperSplat."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from brushgs.cameras.paths import plan_path
from brushgs.formats.cameras.read import CameraFile, read_cameras
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.kit.json_changes import with_value
from tests.kit.refusals import refuse, refuse_bytes

SCENE_FROM_LICHTFELD = np.diag([1.0, -1.0, -1.0])  # y up, z backward -> y down, z forward
SCENE_FROM_SUPERSPLAT = np.diag([-1.0, -1.0, 1.0])  # half a turn about z
CV_FROM_GL = np.diag([1.0, -1.0, -1.0])


def key(time: float, position: list[float], degrees: float = 0.0, mm: float = 35.0, easing: int = 0) -> Any:
    """A key view that is turned to the left about y."""
    x, y, z, w = Rotation.from_euler("y", degrees, degrees=True).as_quat()
    placed = {"time": time, "position": position, "rotation": [w, x, y, z]}
    return placed | {"focal_length_mm": mm, "easing": easing}


KEYS = key(1, [0, 0, 4], 0, 24), key(2, [2, 1, 4], 40, 48, 3), key(4, [3, 0, 1], 90, 36, 1)
TIMELINE = {"version": 4, "clip_duration": 30.0, "keyframes": [*KEYS, key(5, [3, 0, 0], 100, 36)]}
POSES = [
    {"name": "a", "frame": 0, "position": [0, 0, 4], "target": [0, 0, 0], "fov": 90},
    {"name": "c", "frame": 90, "position": [-4, 2, 0], "target": [0, 0, 1]},
    {"name": "b", "frame": 30, "position": [4, 1, 0], "target": [0, 1, 0], "fov": 50},
]
PROJECT = {
    **{"version": 0, "poseSets": [{"name": "set0", "poses": POSES}], "splats": []},
    "camera": {"fov": 60, "azim": 0, "elev": 0, "focalPoint": [0, 0, 0], "distance": 1},
    "timeline": {"frames": 120, "frameRate": 24, "frame": 7, "smoothness": 0.5},
}


def write(folder: Path, content: Any) -> Path:
    path = folder / "camera.json"
    path.write_text(json.dumps(content))
    return path


def pack(folder: Path, members: dict[str, bytes]) -> Path:
    path = folder / "scene.ssproj"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


def read(folder: Path, content: Any) -> CameraFile:
    return read_cameras(write(folder, content))


def at(file: CameraFile, seconds: float) -> Camera:
    """The view so many seconds after the start."""
    return file.motion.at(np.array([seconds]))[0]


def film_height(camera: Camera) -> float:
    """Focal length in heights of the picture."""
    assert camera.K[0, 0] == camera.K[1, 1]
    return float(camera.K[1, 1] / camera.height)


def test_a_timeline_has_its_positions_and_lenses_at_its_keys(tmp_path):
    file = read(tmp_path, TIMELINE)
    assert (file.motion.seconds, file.fps) == (4, None)
    for one in TIMELINE["keyframes"]:
        camera = at(file, one["time"] - 1)
        np.testing.assert_allclose(camera.position, SCENE_FROM_LICHTFELD @ one["position"], atol=1e-12)
        assert film_height(camera) == pytest.approx(one["focal_length_mm"] / 24)


def test_a_lichtfeld_camera_looks_along_minus_z_with_y_up_in_a_world_of_y_up(tmp_path):
    (camera,) = read(tmp_path, {"version": 4, "keyframes": [key(0, [0, 0, 4])]}).cameras
    # In the viewer: right of the axis, above it, 4 in front; scenes have y down and z forward there.
    right_above = SCENE_FROM_LICHTFELD @ [1, 2, 0]
    np.testing.assert_allclose(camera.viewmat @ [*right_above, 1], [1, -2, 4, 1])
    # Turned to the left by 90 degrees, it looks along -x of the viewer.
    (camera,) = read(tmp_path, {"keyframes": [key(0, [0, 0, 4], 90)]}).cameras
    ahead = SCENE_FROM_LICHTFELD @ [-3, 0, 4]
    np.testing.assert_allclose(camera.viewmat @ [*ahead, 1], [0, 0, 3, 1], atol=1e-12)


@for_each(("easing", "share"), [(0, 0.25), (1, 0.25**3), (2, 1 - 0.75**3), (3, 4 * 0.25**3)])
def test_easing_moves_place_turn_and_lens_alike(tmp_path, easing, share):
    keys = [key(0, [0, 0, 4], 0, 24, easing), key(2, [4, 0, 4], 80, 48)]
    camera = at(read(tmp_path, {"keyframes": keys}), 0.5)
    rotation = Rotation.from_euler("y", 80 * share, degrees=True).as_matrix()
    found = SCENE_FROM_LICHTFELD @ camera.viewmat[:3, :3].T @ CV_FROM_GL
    np.testing.assert_allclose(found, rotation, atol=1e-12)
    assert film_height(camera) == pytest.approx(1 + share)
    # Catmull-Rom with the end keys repeated: velocities are half the step.
    place = CubicHermiteSpline([0, 1], [0, 4], [2, 2])(share)
    np.testing.assert_allclose(SCENE_FROM_LICHTFELD @ camera.position, [place, 0, 4], atol=1e-12)


def spline(name: str, width: int) -> CubicHermiteSpline:
    """The closed curve of a field of the project's poses, over frames -90 to 240."""
    poses = sorted(POSES, key=lambda pose: pose["frame"])
    frames = np.array([pose["frame"] for pose in poses], float)
    values = np.array([np.broadcast_to(pose.get(name, 60), width) for pose in poses], float)
    frames, values = np.concatenate([frames + turn for turn in (-120, 0, 120)]), np.tile(values, (3, 1))
    speeds = 0.5 * (values[2:] - values[:-2]) / (frames[2:] - frames[:-2])[:, None]
    return CubicHermiteSpline(frames[1:-1], values[1:-1], speeds)


def test_a_project_follows_its_closed_spline(tmp_path):
    file = read(tmp_path, PROJECT)
    assert (file.is_loop, file.fps, file.motion.seconds) == (True, 24, 5)
    for frame in (0, 10, 30, 61.5, 90, 100, 119):
        camera = at(file, frame / 24)
        place, target = spline("position", 3)(frame), spline("target", 3)(frame)
        np.testing.assert_allclose(camera.position, SCENE_FROM_SUPERSPLAT @ place, atol=1e-12)
        seen = camera.viewmat @ [*(SCENE_FROM_SUPERSPLAT @ target), 1]
        np.testing.assert_allclose(seen[:2], 0, atol=1e-12)
        assert seen[2] == pytest.approx(np.linalg.norm(target - place))
        fov = spline("fov", 1)(frame)[0]  # across the longer side
        assert 2 * np.degrees(np.arctan(camera.width / 2 / camera.K[0, 0])) == pytest.approx(fov)
        # It does not roll: up in the editor is up in the picture.
        up = camera.viewmat[:3, :3] @ SCENE_FROM_SUPERSPLAT @ [0, 1, 0]
        assert up[0] == pytest.approx(0, abs=1e-12)
        assert up[1] < 0


def test_a_project_of_one_pose_is_a_view_with_the_scene_upright(tmp_path):
    pose = {"frame": 0, "position": [0, 0, 4], "target": [0, 0, 0], "fov": 90}
    (camera,) = read(tmp_path, {"poseSets": [{"poses": [pose]}]}).cameras
    above_right = SCENE_FROM_SUPERSPLAT @ [1, 2, 0]
    np.testing.assert_allclose(camera.viewmat @ [*above_right, 1], [1, -2, 4, 1], atol=1e-12)
    assert camera.K[0, 0] == pytest.approx(camera.width / 2)


def test_an_archive_is_read_as_its_document(tmp_path):
    packed = pack(tmp_path, {"document.json": json.dumps(PROJECT).encode(), "splat_0.ply": b"ply\n"})
    found, plain = read_cameras(packed), read(tmp_path, PROJECT)
    assert len(found.cameras) == 121
    for one, other in zip(found.cameras, plain.cameras, strict=True):
        assert np.array_equal(one.viewmat, other.viewmat)
        assert np.array_equal(one.K, other.K)


def test_paths_have_the_frames_and_the_pace_of_the_file(tmp_path):
    view, project = ViewConfig(size=(64, 48)), write(tmp_path, PROJECT)
    path = plan_path(None, view, PathConfig(file=project))
    assert (len(path.cameras), path.fps, path.is_loop) == (120, 24, True)
    expected = SCENE_FROM_SUPERSPLAT @ spline("position", 3)(61)
    np.testing.assert_allclose(path.cameras[61].position, expected, atol=1e-12)
    few = plan_path(None, view, PathConfig(file=project, frames=12))
    assert len(few.cameras) == 12
    np.testing.assert_allclose(few.cameras[3].position, path.cameras[30].position, atol=1e-12)
    timeline = plan_path(None, view, PathConfig(file=write(tmp_path, TIMELINE), fps=10))
    assert (len(timeline.cameras), timeline.fps, timeline.is_loop) == (41, 10, False)


SET = "poseSets/0/poses"
MEETING = [POSES[0] | {"position": [0, 0, 1]}, POSES[1] | {"position": [0, 0, 0], "target": [0, 0, 1]}]


@for_each(
    "content, place, value, sentence",
    [
        (TIMELINE, "keyframes", [], "has no keyframes; add some to the timeline"),
        (TIMELINE, "keyframes/1/position", ..., r"keyframes\[1\].position is missing"),
        (TIMELINE, "keyframes/2/rotation", [0, 0, 0, 0], r"keyframes\[2\].rotation must be a rotation"),
        (PROJECT, "poseSets", [], "has no camera poses before frame 120"),
        (PROJECT, f"{SET}/0/target", [0, 0, 4], "target must be another point than"),
        (PROJECT, f"{SET}/1/frame", 30, "two poses at frame 30; remove one"),
        (PROJECT, SET, MEETING, "between two poses the camera meets its target; move a pose"),
    ],
)
def test_what_does_not_fit_is_one_sentence(tmp_path, content, place, value, sentence):
    refuse(write(tmp_path, with_value(content, place, value)), sentence, read_cameras)


def test_a_damaged_project_is_one_sentence(tmp_path):
    path = pack(tmp_path, {"splat_0.ply": b"ply\n"})
    refuse(path, "is no SuperSplat project, it has no document.json", read_cameras)
    content = pack(tmp_path, {"document.json": json.dumps(PROJECT).encode()}).read_bytes()
    damaged = content[:60] + bytes(10) + content[70:]
    refuse_bytes(path, damaged, "its document.json is damaged", read_cameras)
    refuse_bytes(path, b"PK\x03\x04", "is a damaged zip archive", read_cameras)
