"""Camera files become a list of `Camera`, in the order of the file.

Read are Inria `cameras.json` (camera-to-world, x right, y down, z forward), NeRF and nerfstudio
`transforms.json` and the nerfstudio viewer's camera path (camera-to-world, x right, y up, z
backward). All of it is JSON; nothing is evaluated.
"""

import json
import math
import warnings
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.io.camera_frame import CameraFrame, Json
from brushgs.scene import Camera

_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward -> x right, y down, z forward
_BLENDER_SIZE = 800  # pixels; transforms.json of the NeRF-synthetic scenes leaves their size out
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


def load_cameras(path: str | Path) -> list[Camera]:
    """Read the cameras of a `cameras.json`, `transforms.json` or nerfstudio camera path.

    Lens distortion is left out with one SceneWarning. Where `transforms.json` gives no size (`w`, `h`),
    pictures are 800 x 800, the size of the NeRF-synthetic scenes, which leave it out.

    Args:
        path: a JSON file; its content decides which of the three it is.

    Returns:
        The cameras in the order of the file, with the default near plane.

    Raises:
        SceneError: if the file is none of these, or a field of a frame is missing or has no use;
            names the frame and the field.
    """
    path = Path(path)
    content = _read_json(path)
    if isinstance(content, list):
        frames, read = content, _read_inria
        shared: Json = {}
    elif isinstance(content, dict) and "camera_path" in content:
        frames, read = content["camera_path"], _read_path_frame
        shared = content
    elif isinstance(content, dict) and "frames" in content:
        frames, read = content["frames"], _read_transforms
        shared = content
    else:
        raise SceneError(
            path, "is no camera file: it has neither a list of cameras, 'frames' nor 'camera_path'"
        )
    if not isinstance(frames, list) or not frames:
        raise SceneError(path, "holds no cameras; export it again")
    cameras = []
    for index, frame in enumerate(frames):
        if not isinstance(frame, dict):
            raise SceneError(path, f"frame {index}: must be an object, got {json.dumps(frame)[:40]}")
        cameras.append(read(CameraFrame(path, index, frame, shared)))
    _warn_of_distortion(path, shared, frames)
    return cameras


def _read_json(path: Path) -> object:
    try:
        # Every number as a float: one of a thousand digits is then infinite, and refused as such.
        return json.loads(path.read_text(encoding="utf-8"), parse_int=float)
    except FileNotFoundError:
        raise SceneError(path, "there is no such file; check the path") from None
    except OSError as error:
        raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None
    except (ValueError, RecursionError) as error:
        raise SceneError(path, f"is not JSON ({error}); give a cameras.json or transforms.json") from None


def _read_inria(frame: CameraFrame) -> Camera:
    """One entry of `cameras.json`; the principal point is the middle of the picture."""
    width, height = frame.positive("width"), frame.positive("height")
    K = frame.positive("fx"), frame.positive("fy"), width / 2, height / 2
    return frame.camera(frame.array("rotation", 3, 3), frame.array("position", 3), K, (width, height))


def _read_transforms(frame: CameraFrame) -> Camera:
    """One frame of `transforms.json`; intrinsics stand in the frame or beside all frames."""
    model = frame.find("camera_model")
    if model is not None and model not in _PINHOLES:
        raise frame.fail(f"camera_model must be a pinhole model such as OPENCV, got {json.dumps(model)[:40]}")
    width, height = frame.positive("w", _BLENDER_SIZE), frame.positive("h", _BLENDER_SIZE)
    if frame.find("fl_x") is not None:
        fx = frame.positive("fl_x")
    elif frame.find("camera_angle_x") is not None:
        fx = width / 2 / math.tan(frame.angle("camera_angle_x") / 2)
    else:
        raise frame.fail("neither 'fl_x' nor 'camera_angle_x'; export the cameras with their focal length")
    if frame.find("fl_y") is None and frame.find("camera_angle_y") is not None:
        fy = height / 2 / math.tan(frame.angle("camera_angle_y") / 2)
    else:
        fy = frame.positive("fl_y", fx)
    K = fx, fy, frame.number("cx", width / 2), frame.number("cy", height / 2)
    return _from_opengl(frame, "transform_matrix", K, (width, height))


def _read_path_frame(frame: CameraFrame) -> Camera:
    """One pose of a nerfstudio camera path; `fov` is vertical and in degrees."""
    kind = frame.find("camera_type")
    if kind not in (None, "perspective"):
        raise frame.fail(f"camera_type must be perspective, got {json.dumps(kind)[:40]}")
    width, height = frame.positive("render_width"), frame.positive("render_height")
    focal = height / 2 / math.tan(frame.angle("fov", math.radians(1)) / 2)
    return _from_opengl(frame, "camera_to_world", (focal, focal, width / 2, height / 2), (width, height))


def _from_opengl(frame: CameraFrame, name: str, K: tuple[float, ...], size: tuple[float, float]) -> Camera:
    """A camera from a camera-to-world matrix with x right, y up, z backward; rows first, 3x4 or 4x4."""
    value = frame.find(name)
    num_rows = 3 if np.size(np.array(value, dtype=object)) == 12 else 4
    matrix = frame.array(name, num_rows, 4)
    return frame.camera(matrix[:3, :3] @ _CV_FROM_GL, matrix[:3, 3], K, size)


def _warn_of_distortion(path: Path, shared: Json, frames: list[Json]) -> None:
    """Warn once of lens distortion, which is left out."""
    found: dict[str, float] = {}
    for source in (shared, *frames):
        for name in _DISTORTION:
            value = source.get(name)
            if isinstance(value, int | float) and value:
                found.setdefault(name, value)
    if not found:
        return
    model = next((s["camera_model"] for s in (shared, *frames) if "camera_model" in s), "OPENCV")
    listed = ", ".join(f"{name} = {found[name]:g}" for name in _DISTORTION if name in found)
    message = f"the distortion of camera model {model} was left out ({listed}); pictures are a pinhole's"
    warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=3)
