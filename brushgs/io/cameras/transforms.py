"""The `transforms.json` of NeRF and nerfstudio: camera-to-world matrices, x right, y up, z backward.

Intrinsics stand in each frame, or once beside all frames. Fields: docs.nerf.studio, data conventions. One is
our own, which the page of `brushgs export` writes: `near_plane`, world units; nothing nearer is painted.
"""

from pathlib import Path
from typing import cast

from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.frame import CameraFrame, Json, names_in, read_frames
from brushgs.io.cameras.lens import warn_of_distortion
from brushgs.io.json_file import shown
from brushgs.values.camera import Camera

_BLENDER_SIZE = 800  # pixels; transforms.json of the NeRF-synthetic scenes omits the size
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


def read(path: Path, content: object) -> CameraFile:
    """The cameras of a JSON object with the field "frames". Raises SceneError, see `read_cameras`."""
    shared = cast(Json, content)
    cameras = read_frames(path, shared["frames"], shared, _read_frame)
    _warn_of_distortion(path, shared, shared["frames"])
    return CameraFile(cameras, names=names_in(shared["frames"], "file_path"))


def _read_frame(frame: CameraFrame) -> Camera:
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
    near = frame.positive("near_plane", Camera.near)
    return frame.opengl_camera("transform_matrix", K, (width, height), near)


def _warn_of_distortion(path: Path, shared: Json, frames: list[Json]) -> None:
    """Warn once of lens distortion in any frame, which is ignored."""
    found: dict[str, float] = {}
    for source in (shared, *frames):
        for name in _DISTORTION:
            value = source.get(name)
            if isinstance(value, int | float) and value:
                found.setdefault(name, value)
    if found:
        models = (source.get("camera_model") for source in (shared, *frames))
        model = next((model for model in models if model in _PINHOLES), "OPENCV")
        warn_of_distortion(path, model, {name: found[name] for name in _DISTORTION if name in found})
