"""Camera files in JSON: `cameras.json`, `transforms.json`, and the `camera_path.json` of nerfstudio's viewer.

- `cameras.json`, which 3DGS training writes: a list of camera-to-world poses; x right, y down, z forward.
- `transforms.json` of NeRF and nerfstudio: camera-to-world matrices; x right, y up, z backward. Intrinsics
  are in each frame, or once for all frames. Fields: docs.nerf.studio, data conventions. One field is our own,
  written by the page of `brushgs export`: `near_plane`, world units; nothing nearer is painted.
- `camera_path.json`: frames of a path, its keyframes, its frame rate. Matrices are as in `transforms.json`;
  the field of view is vertical, in degrees.
"""

import math
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.cameras.read import MAX_DISTANCE, CameraFile, camera_of, warn_of_distortion
from brushgs.formats.schema import Numbers, decode, missing, refused, shaped, shown
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera

_CURE = "export the cameras again"
_MIN_ANGLE = 1e-6  # radians
_MIN_SECONDS = 1e-6  # shortest path: the frame rate of a shorter one would overflow
_MAX_MATRIX_TEXT = 4096  # characters of a matrix that is stored as text
_NEAR_RIGID = 1e-2  # largest deviation of a rotation from orthonormal that counts as rounding
_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward -> x right, y down, z forward
_BLENDER_SIZE = 800.0  # pixels; transforms.json of the NeRF-synthetic scenes omits the size
_DISTORTION = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
_PINHOLES = (
    *("OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV_FISHEYE", "FULL_OPENCV"),
)

Positive = Annotated[float, Meta(gt=0)]


class _Trained(Struct):  # entry of `cameras.json`
    width: Positive
    height: Positive
    fx: Positive
    fy: Positive
    rotation: Numbers
    position: Numbers
    img_name: Any = None


class _Frame(Struct):
    """A frame of `transforms.json`; fields except matrix and picture may be given once for all frames."""

    w: Positive | None = None
    h: Positive | None = None
    fl_x: Positive | None = None
    fl_y: Positive | None = None
    camera_angle_x: float | None = None
    camera_angle_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    near_plane: Positive | None = None
    camera_model: Any = None
    transform_matrix: Numbers | None = None
    file_path: Any = None
    k1: Any = None
    k2: Any = None
    k3: Any = None
    k4: Any = None
    k5: Any = None
    k6: Any = None
    p1: Any = None
    p2: Any = None


class _Transforms(_Frame, kw_only=True):
    frames: list[_Frame]


class _View(Struct):
    """A frame or keyframe of `camera_path.json`; fields except the matrix may be given once for all."""

    camera_type: Any = None
    render_width: Positive | None = None
    render_height: Positive | None = None
    fov: float | None = None
    camera_to_world: Numbers | None = None
    matrix: Numbers | str | None = None  # older viewers wrote text, in column order


class _Path(_View, kw_only=True):
    camera_path: list[_View]
    keyframes: list[_View] | None = None
    fps: Positive | None = None
    seconds: float | None = None
    is_cycle: Any = None


def read_trained(path: Path, content: bytes) -> CameraFile:
    """Read `cameras.json`; the principal point is the center of the picture. Raises SceneError."""
    entries = decode(path, content, list[_Trained], _CURE, root="cameras")
    cameras = []
    for index, own in enumerate(_filled(path, entries)):
        entry = Entry(path, f"cameras[{index}]", own)
        K = own.fx, own.fy, own.width / 2, own.height / 2
        rotation, position = entry.array("rotation", (3, 3)), entry.array("position", (3,))
        cameras.append(entry.camera(rotation, position, K, (own.width, own.height)))
    return CameraFile(cameras, names=_names([own.img_name for own in entries]))


def read_transforms(path: Path, content: bytes) -> CameraFile:
    """Read `transforms.json`, an object with the field "frames". Raises SceneError."""
    file = decode(path, content, _Transforms, _CURE)
    frames = _filled(path, file.frames)
    cameras = [_of_frame(Entry(path, f"frames[{i}]", own, file)) for i, own in enumerate(frames)]
    sources = (file, *frames)
    model = next((one.camera_model for one in sources if one.camera_model in _PINHOLES), "OPENCV")
    lenses = ({name: getattr(one, name) for name in _DISTORTION} for one in sources)
    warn_of_distortion(path, ((model, lens) for lens in lenses))
    return CameraFile(cameras, names=_names([frame.file_path for frame in frames]))


def read_path(path: Path, content: bytes) -> CameraFile:
    """Read `camera_path.json`, an object with the field "camera_path". Raises SceneError."""
    file = decode(path, content, _Path, _CURE)
    cameras, keys = (
        [_of_view(Entry(path, f"{name}[{i}]", own, file), matrix) for i, own in enumerate(views)]
        for name, matrix, views in (
            ("camera_path", "camera_to_world", _filled(path, file.camera_path)),
            ("keyframes", "matrix", file.keyframes or []),
        )
    )
    fps = file.fps
    if fps is None and file.seconds is not None:
        if file.seconds <= _MIN_SECONDS:
            raise refused(path, "seconds", f"a number above {_MIN_SECONDS:g}", file.seconds, _CURE)
        fps = len(cameras) / file.seconds
    return CameraFile(cameras, keys, fps, file.is_cycle is True)


def _filled(path: Path, entries: list[Any]) -> list[Any]:
    if not entries:
        raise SceneError(path, "holds no cameras; export it again")
    return entries


def _names(names: list[Any]) -> tuple[str, ...]:
    """Picture names, "" for an entry without one."""
    return tuple(name if isinstance(name, str) else "" for name in names)


class Entry:
    """One entry of a camera file; fields are looked up in it, then in the fields shared by all entries.

    Methods raise SceneError with the path, the place and the rule.
    """

    def __init__(self, path: Path, place: str, own: Struct, shared: Struct | None = None) -> None:
        self.path, self.place, self.own, self.shared = path, place, own, shared

    def fail(self, message: str) -> SceneError:
        """A SceneError that names the entry."""
        return SceneError(self.path, f"{self.place}: {message}")

    def find(self, name: str) -> Any:
        """A field of the entry, else the shared one, else None."""
        value = getattr(self.own, name)
        return getattr(self.shared, name) if value is None and self.shared is not None else value

    def number(self, name: str) -> float:
        """A number that the entry or the shared fields must have."""
        if (value := self.find(name)) is None:
            raise missing(self.path, f"{self.place}.{name}", "a number", _CURE)
        return float(value)

    def focal(self, side: float, name: str, unit: float = 1.0) -> float:
        """Focal length in pixels from the field of view `name` (in `unit` radians) across `side` pixels."""
        value = self.number(name)
        if value < _MIN_ANGLE or value * unit >= math.pi:
            place = name if getattr(self.own, name) is None else f"{self.place}.{name}"
            rule = f"above {_MIN_ANGLE:g} and below half a turn, {math.pi / unit:.4g}"
            raise refused(self.path, place, rule, value, _CURE)
        return side / 2 / math.tan(value * unit / 2)

    def array(self, name: str, *shapes: tuple[int, ...]) -> F64:
        """A field of numbers, in the first shape of its size."""
        value = getattr(self.own, name)
        rule = " or ".join("x".join(map(str, shape)) for shape in shapes) + " numbers"
        if value is None:
            raise missing(self.path, f"{self.place}.{name}", rule, _CURE)
        if (array := shaped(value, *shapes)) is None:
            raise refused(self.path, f"{self.place}.{name}", rule, value, _CURE)
        return array

    def camera(
        self,
        world_from_cam: F64,
        position: F64,
        K: tuple[float, ...],
        size: tuple[float, float],
        near: float = Camera.near,
    ) -> Camera:
        """The camera at a pose; see `camera_of` for `K`, `size` and `near`.

        `world_from_cam` is [3, 3] with x right, y down, z forward, and is made orthonormal; `position` is
        [3] in world units.
        """
        rotation = self._rigid(world_from_cam).T
        with np.errstate(all="ignore"):
            translation = -rotation @ position
        try:
            return camera_of(rotation, translation, K, size, near)
        except ValueError as error:
            raise self.fail(str(error)) from None

    def opengl_camera(
        self, name: str, K: tuple[float, ...], size: tuple[float, float], near: float = Camera.near
    ) -> Camera:
        """The camera at the camera-to-world matrix in a field, with x right, y up, z backward."""
        matrix = self.array(name, (4, 4), (3, 4))
        return self.camera(matrix[:3, :3] @ _CV_FROM_GL, matrix[:3, 3], K, size, near)

    def _rigid(self, rotation: F64) -> F64:
        """The rotation nearest to a matrix. Raises SceneError if the matrix scales or mirrors."""
        if (longest := np.abs(rotation).max()) > MAX_DISTANCE:  # the SVD may not converge
            raise self.fail(f"the rotation must not scale or mirror, got an entry of {longest:.4g}")
        left, stretch, right = np.linalg.svd(rotation)
        nearest = np.asarray(left @ right)
        is_mirrored = np.linalg.det(nearest) < 0
        if np.abs(stretch - 1).max() > _NEAR_RIGID or is_mirrored:
            found = ", ".join(f"{value:.4g}" for value in stretch) + " long"
            found += " and mirrored" if is_mirrored else ""
            raise self.fail(f"the rotation must not scale or mirror, got axes {found}")
        return nearest


def _of_frame(frame: Entry) -> Camera:
    model = frame.find("camera_model")
    if model is not None and model not in _PINHOLES:
        raise frame.fail(f"camera_model must be a pinhole model such as OPENCV, got {shown(model)}")
    width, height = frame.find("w") or _BLENDER_SIZE, frame.find("h") or _BLENDER_SIZE
    fx, fy, cx, cy = (frame.find(name) for name in ("fl_x", "fl_y", "cx", "cy"))
    if fx is None and frame.find("camera_angle_x") is None:
        raise frame.fail("neither 'fl_x' nor 'camera_angle_x'; export the cameras with their focal length")
    if fx is None:
        fx = frame.focal(width, "camera_angle_x")
    if fy is None:
        fy = fx if frame.find("camera_angle_y") is None else frame.focal(height, "camera_angle_y")
    K = fx, fy, width / 2 if cx is None else cx, height / 2 if cy is None else cy
    near = frame.find("near_plane") or Camera.near
    return frame.opengl_camera("transform_matrix", K, (width, height), near)


def _of_view(view: Entry, matrix_name: str) -> Camera:
    """The camera of a view with its camera-to-world matrix in the field `matrix_name`."""
    projection = view.find("camera_type")
    if projection not in (None, "perspective"):
        raise view.fail(f"camera_type must be perspective, got {shown(projection)}")
    width, height = view.number("render_width"), view.number("render_height")
    focal = view.focal(height, "fov", math.radians(1))
    text = getattr(view.own, matrix_name)
    if isinstance(text, str):
        try:
            stored = shaped(msgspec.json.decode(text[:_MAX_MATRIX_TEXT], type=Numbers), (4, 4))
        except (msgspec.DecodeError, RecursionError):
            stored = None
        if stored is None:
            raise refused(view.path, f"{view.place}.{matrix_name}", "4x4 numbers", text, _CURE)
        view = Entry(view.path, view.place, msgspec.structs.replace(view.own, matrix=stored.T), view.shared)
    return view.opengl_camera(matrix_name, (focal, focal, width / 2, height / 2), (width, height))
