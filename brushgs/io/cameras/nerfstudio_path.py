"""The `camera_path.json` of the nerfstudio viewer: frames of a path, the key views it was made of, its rate.

Matrices are camera-to-world, x right, y up, z backward; the field of view is vertical, in degrees.
"""

import math
from pathlib import Path
from typing import cast

import numpy as np

from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.frame import CameraFrame, Json, read_frames
from brushgs.io.json_file import parse_json, shown
from brushgs.values.camera import Camera

_MIN_SECONDS = 1e-6  # of a path: below, its frame rate would overflow
_MAX_MATRIX_TEXT = 4096  # characters of a matrix that is stored as text


def read(path: Path, content: object) -> CameraFile:
    """The path in a JSON object with the field "camera_path". Raises SceneError, see `read_cameras`."""
    shared = cast(Json, content)
    cameras = read_frames(path, shared["camera_path"], shared, _read_frame)
    keys = shared.get("keyframes") or []
    if keys:
        keys = read_frames(path, keys, shared, _read_keyframe, "keyframe")
    whole = CameraFrame(path, "camera path", shared, {})
    fps = None
    if whole.find("fps") is not None:
        fps = whole.positive("fps")
    elif whole.find("seconds") is not None:
        fps = len(cameras) / whole.positive("seconds", least=_MIN_SECONDS)
    return CameraFile(cameras, keys, fps, whole.find("is_cycle") is True)


def _read_frame(frame: CameraFrame) -> Camera:
    return _view(frame, "camera_to_world")


def _read_keyframe(frame: CameraFrame) -> Camera:
    """One key view; older viewers wrote the matrix as text, column by column."""
    matrix = frame.find("matrix")
    if isinstance(matrix, str):
        try:
            matrix = np.reshape(parse_json(matrix[:_MAX_MATRIX_TEXT]), (4, 4)).T.tolist()
        except (TypeError, ValueError, RecursionError):
            raise frame.fail(f"'matrix' must hold 4x4 finite numbers, got {shown(matrix)}") from None
    own = frame.own | {"matrix": matrix}
    return _view(CameraFrame(frame.path, frame.name, own, frame.shared), "matrix")


def _view(frame: CameraFrame, matrix_name: str) -> Camera:
    """A view with its camera-to-world matrix in the field `matrix_name`."""
    projection = frame.find("camera_type")
    if projection not in (None, "perspective"):
        raise frame.fail(f"camera_type must be perspective, got {shown(projection)}")
    width, height = frame.positive("render_width"), frame.positive("render_height")
    focal = frame.focal(height, "fov", math.radians(1))
    return frame.opengl_camera(matrix_name, (focal, focal, width / 2, height / 2), (width, height))
