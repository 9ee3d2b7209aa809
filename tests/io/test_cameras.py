import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brushgs import SceneError, SceneWarning
from brushgs.formats import load_cameras
from brushgs.formats.cameras.read import read_cameras
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

# A camera at (1, 2, 3) that looks along world +x; its picture has world +z up.
FORWARD, RIGHT, UP = np.array([1.0, 0, 0]), np.array([0, -1.0, 0]), np.array([0, 0, 1.0])
POSITION = [1.0, 2.0, 3.0]
CV_ROTATION = np.stack([RIGHT, -UP, FORWARD], 1).tolist()  # world from camera; x right, y down, z forward
GL_MATRIX = np.eye(4)
GL_MATRIX[:3] = np.stack([RIGHT, UP, -FORWARD, np.array(POSITION)], 1)  # x right, y up, z backward

INRIA = {"id": 0, "width": 640, "height": 480, "fx": 500, "fy": 510, "position": POSITION}
INRIA |= {"rotation": CV_ROTATION}
BLENDER = {"camera_angle_x": 2 * np.arctan(0.5), "frames": [{"transform_matrix": GL_MATRIX.tolist()}]}
NERFSTUDIO = {
    "w": 640, "h": 480, "fl_x": 500, "fl_y": 510, "cx": 300, "cy": 250, "camera_model": "OPENCV",
    "frames": [{"file_path": "a.jpg", "transform_matrix": GL_MATRIX.tolist()}],
}  # fmt: skip
CAMERA_PATH = {
    "render_width": 640, "render_height": 480, "camera_type": "perspective",
    "camera_path": [{"camera_to_world": GL_MATRIX.ravel().tolist(), "fov": 90.0, "aspect": 1.0}],
}  # fmt: skip
# The same pose as a key view of the viewer.
KEYFRAME = {"matrix": GL_MATRIX.ravel().tolist(), "fov": 90.0, "aspect": 1.0}
FILES = {"inria": [INRIA], "blender": BLENDER, "nerfstudio": NERFSTUDIO, "camera_path": CAMERA_PATH}


def write(tmp_path: Path, content: object) -> Path:
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps(content))
    return path


def changed(content: Any, **fields: object) -> Any:
    """A copy of the content of a file with other fields in its only frame."""
    content = json.loads(json.dumps(content))
    frames = content if isinstance(content, list) else content.get("frames") or content["camera_path"]
    frames[0].update(fields)
    return content


@for_each(
    "kind, K, size",
    [
        ("inria", (500, 510, 320, 240), (640, 480)),
        ("blender", (800, 800, 400, 400), (800, 800)),
        ("nerfstudio", (500, 510, 300, 250), (640, 480)),
        ("camera_path", (240, 240, 320, 240), (640, 480)),
    ],
)
def test_every_kind_of_file_gives_the_same_pose_and_its_intrinsics(tmp_path, kind, K, size):
    (camera,) = load_cameras(write(tmp_path, FILES[kind]))
    np.testing.assert_allclose(camera.position, POSITION, atol=1e-12)
    np.testing.assert_allclose(camera.viewmat[:3, :3], [RIGHT, -UP, FORWARD], atol=1e-12)
    assert (camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]) == pytest.approx(K)
    assert (camera.width, camera.height) == size


def test_cameras_keep_the_order_of_the_file_and_rounded_rotations_become_rotations(tmp_path):
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    rounded = INRIA | {"rotation": np.round(turn, 3).tolist()}
    content = [rounded | {"id": 9 - i, "img_name": str(9 - i), "position": [i, 0, 0]} for i in range(5)]
    cameras = load_cameras(write(tmp_path, content))
    assert [camera.position[0] for camera in cameras] == pytest.approx([0, 1, 2, 3, 4])
    rotation = cameras[0].viewmat[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(rotation.T, turn, atol=2e-3)


@for_each("model", ["OPENCV", "OPENCV_FISHEYE"])
def test_distortion_is_ignored_with_one_warning(tmp_path, model):
    content = NERFSTUDIO | {"camera_model": model, "k1": 0.1, "k2": 0.0, "p2": -0.02}
    what = rf"cameras\.json: the distortion of camera model {model} was ignored \(k1 = 0\.1, p2 = -0\.02\)"
    with pytest.warns(SceneWarning, match=what) as caught:
        load_cameras(write(tmp_path, content))
    assert len(caught) == 1


def test_what_is_no_file_of_cameras_is_refused(tmp_path):
    with pytest.raises(SceneError, match="is a folder without cameras; give"):
        load_cameras(tmp_path)
    for content in (b"{", b"\xff\xfe", b"[" * 100_000):
        sentence = r"is not JSON .*; give cameras\.json .* a COLMAP sparse model or a PLY scene"
        refuse_bytes(tmp_path / "cameras.json", content, sentence, load_cameras)


NO_LENS = {"frames": [{"transform_matrix": GL_MATRIX.tolist()}]}
SPHERE = "EQUIRECTANGULAR"


@for_each(
    "content, sentence",
    [
        (3, "is no camera file of a known format, got 3; give cameras.json of"),
        ([], "holds no cameras; export it again"),
        ({"frames": {}}, "frames must be a list, got {}; export the cameras again"),
        ([INRIA | {"width": 0.4}], r"cameras\[0\]: Camera: size must be at least 1x1, got 0x480"),
        ([INRIA | {"position": [1, 2]}], r"cameras\[0\]\.position must be 3 numbers, got \[1, 2\]"),
        ([INRIA | {"rotation": (2 * np.eye(3)).tolist()}], "must not scale or mirror, got axes 2, 2, 2 long"),
        (NO_LENS, r"frames\[0\]: neither 'fl_x' nor 'camera_angle_x'"),
        (BLENDER | {"frames": [{}]}, r"frames\[0\]\.transform_matrix is missing, it must be 4x4 or 3x4"),
        (changed(BLENDER, transform_matrix=[1, 2]), r"matrix must be 4x4 or 3x4 numbers, got \[1, 2\]"),
        (BLENDER | {"camera_model": SPHERE}, "camera_model must be a pinhole model such as OPENCV"),
        (changed(CAMERA_PATH, fov=180), r"\.fov must be above 1e-06 and below half a turn, 180, got 180"),
        (CAMERA_PATH | {"camera_type": "sphere"}, r"camera_path\[0\]: camera_type must be perspective, got"),
        ({"camera_path": CAMERA_PATH["camera_path"]}, r"path\[0\]\.render_width is missing, it must be"),
        (CAMERA_PATH | {"fps": -1}, "fps must be a number above 0, got -1"),
        (CAMERA_PATH | {"keyframes": [KEYFRAME, {}]}, r"keyframes\[1\]\.fov is missing, it must be a"),
    ],
)
def test_a_field_at_fault_is_named_with_its_frame(tmp_path, content, sentence):
    refuse(write(tmp_path, content), sentence, load_cameras)


def test_a_camera_path_may_say_more_than_its_poses(tmp_path):
    file = read_cameras(write(tmp_path, CAMERA_PATH))
    assert (file.fps, file.is_loop, file.keys) == (None, False, [])
    assert read_cameras(write(tmp_path, CAMERA_PATH | {"seconds": 0.5})).fps == 2
    text = json.dumps(GL_MATRIX.T.ravel().tolist())  # its columns first
    for matrix in (text, GL_MATRIX.ravel().tolist()):
        content = CAMERA_PATH | {"keyframes": [KEYFRAME | {"matrix": matrix}]}
        (key,) = read_cameras(write(tmp_path, content)).keys
        np.testing.assert_allclose(key.position, POSITION, atol=1e-12)
