"""Camera files become a list of `Camera`, in the order of the file.

Read are Inria `cameras.json` (camera-to-world, x right, y down, z forward), NeRF and nerfstudio
`transforms.json` and the nerfstudio viewer's camera path (camera-to-world, x right, y up, z
backward). All of it is JSON; nothing is evaluated. COLMAP sparse models are `colmap`'s.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.cameras.colmap import is_colmap, read_colmap
from brushgs.io.cameras.frame import CameraFrame, Json, warn_of_distortion
from brushgs.io.json_file import parse_json, read_json, shown
from brushgs.scene import Camera

_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward -> x right, y down, z forward
_BLENDER_SIZE = 800  # pixels; transforms.json of the NeRF-synthetic scenes leaves their size out
_SHORTEST = 1e-6  # seconds of a path: below, its rate would leave the range of numbers
_LONGEST_MATRIX = 4096  # characters of a matrix that is stored as text
_DISTORTION = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
_PINHOLES = (
    "OPENCV",
    "PINHOLE",
    "SIMPLE_PINHOLE",
    "SIMPLE_RADIAL",
    "RADIAL",
    "OPENCV_FISHEYE",
    "FULL_OPENCV",
)


@dataclass(frozen=True)
class CameraFile:
    """What a camera file holds.

    Attributes:
        cameras: its views, in the order of the file; of a COLMAP model by the name of the image.
        is_path: whether the views are the frames of a camera path; else they are training views.
        keys: the key views that such a path was made of; may be empty.
        fps: frames a second, if it says so.
        is_loop: whether it says that the first frame follows the last.
    """

    cameras: list[Camera]
    is_path: bool = False
    keys: list[Camera] = field(default_factory=list)
    fps: float | None = None
    is_loop: bool = False


def read_cameras(path: str | Path) -> CameraFile:
    """Read a camera file: its views as `brushgs.load_cameras` returns them, and what else a path states.

    Raises:
        SceneError: if the file is of no known format, or a field of a frame is missing or unusable.
    """
    path = Path(path)
    if is_colmap(path):
        return CameraFile(read_colmap(path))
    content = read_json(path, "give a cameras.json or transforms.json")
    if isinstance(content, list):
        return CameraFile(_read_all(path, content, {}, _read_inria))
    if isinstance(content, dict) and "camera_path" in content:
        return _read_path(path, content)
    if isinstance(content, dict) and "frames" in content:
        cameras = _read_all(path, content["frames"], content, _read_transforms)
        _warn_of_distortion(path, content, content["frames"])
        return CameraFile(cameras)
    raise SceneError(path, "is no camera file: it has neither a list of cameras, 'frames' nor 'camera_path'")


def _read_all(
    path: Path, frames: object, shared: Json, read: Callable[[CameraFrame], Camera], name: str = "frame"
) -> list[Camera]:
    """The cameras of a list of entries."""
    if not isinstance(frames, list) or not frames:
        raise SceneError(path, "holds no cameras; export it again")
    cameras = []
    for index, frame in enumerate(frames):
        if not isinstance(frame, dict):
            raise SceneError(path, f"{name} {index}: must be an object, got {shown(frame)}")
        cameras.append(read(CameraFrame(path, f"{name} {index}", frame, shared)))
    return cameras


def _read_path(path: Path, content: Json) -> CameraFile:
    """A camera path of the nerfstudio viewer."""
    cameras = _read_all(path, content["camera_path"], content, _read_path_frame)
    keys = content.get("keyframes") or []
    if keys:
        keys = _read_all(path, keys, content, _read_keyframe, "keyframe")
    whole = CameraFrame(path, "camera path", content, {})
    fps = None
    if whole.find("fps") is not None:
        fps = whole.positive("fps")
    elif whole.find("seconds") is not None:
        fps = len(cameras) / whole.positive("seconds", least=_SHORTEST)
    return CameraFile(cameras, True, keys, fps, whole.find("is_cycle") is True)


def _read_inria(frame: CameraFrame) -> Camera:
    """One entry of `cameras.json`; the principal point is the middle of the picture."""
    width, height = frame.positive("width"), frame.positive("height")
    K = frame.positive("fx"), frame.positive("fy"), width / 2, height / 2
    return frame.camera(frame.array("rotation", 3, 3), frame.array("position", 3), K, (width, height))


def _read_transforms(frame: CameraFrame) -> Camera:
    """One frame of `transforms.json`; intrinsics stand in the frame or beside all frames."""
    model = frame.find("camera_model")
    if model is not None and model not in _PINHOLES:
        raise frame.fail(f"camera_model must be a pinhole model such as OPENCV, got {shown(model)}")
    width, height = frame.positive("w", _BLENDER_SIZE), frame.positive("h", _BLENDER_SIZE)
    if frame.find("fl_x") is not None:
        fx = frame.positive("fl_x")
    elif frame.find("camera_angle_x") is not None:
        fx = frame.focal(width, "camera_angle_x")
    else:
        raise frame.fail("neither 'fl_x' nor 'camera_angle_x'; export the cameras with their focal length")
    if frame.find("fl_y") is None and frame.find("camera_angle_y") is not None:
        fy = frame.focal(height, "camera_angle_y")
    else:
        fy = frame.positive("fl_y", fx)
    K = fx, fy, frame.number("cx", width / 2), frame.number("cy", height / 2)
    return _from_opengl(frame, "transform_matrix", K, (width, height))


def _read_path_frame(frame: CameraFrame) -> Camera:
    """One pose of a nerfstudio camera path; `fov` is vertical and in degrees."""
    return _from_viewer(frame, "camera_to_world")


def _read_keyframe(frame: CameraFrame) -> Camera:
    """One key view of a nerfstudio camera path; older viewers wrote the matrix as text, columns first."""
    matrix = frame.find("matrix")
    if isinstance(matrix, str):
        try:
            matrix = np.reshape(parse_json(matrix[:_LONGEST_MATRIX]), (4, 4)).T.tolist()
        except (TypeError, ValueError, RecursionError):
            raise frame.fail(f"'matrix' must hold 4x4 finite numbers, got {shown(matrix)}") from None
    return _from_viewer(
        CameraFrame(frame.path, frame.name, frame.own | {"matrix": matrix}, frame.shared), "matrix"
    )


def _from_viewer(frame: CameraFrame, name: str) -> Camera:
    """A view of the nerfstudio viewer with its camera-to-world matrix in the field `name`."""
    kind = frame.find("camera_type")
    if kind not in (None, "perspective"):
        raise frame.fail(f"camera_type must be perspective, got {shown(kind)}")
    width, height = frame.positive("render_width"), frame.positive("render_height")
    focal = frame.focal(height, "fov", math.radians(1))
    return _from_opengl(frame, name, (focal, focal, width / 2, height / 2), (width, height))


def _from_opengl(frame: CameraFrame, name: str, K: tuple[float, ...], size: tuple[float, float]) -> Camera:
    """A camera from a camera-to-world matrix with x right, y up, z backward; rows first, 3x4 or 4x4."""
    matrix = frame.array(name, 4, 4, or_shape=(3, 4))
    return frame.camera(matrix[:3, :3] @ _CV_FROM_GL, matrix[:3, 3], K, size)


def _warn_of_distortion(path: Path, shared: Json, frames: list[Json]) -> None:
    """Warn once of lens distortion, which is left out."""
    found: dict[str, float] = {}
    for source in (shared, *frames):
        for name in _DISTORTION:
            value = source.get(name)
            if isinstance(value, int | float) and value:
                found.setdefault(name, value)
    if found:
        models = (source.get("camera_model") for source in (shared, *frames))
        model = next((model for model in models if model in _PINHOLES), "OPENCV")
        in_order = {name: found[name] for name in _DISTORTION if name in found}
        warn_of_distortion(path, model, in_order)
