"""One entry of a JSON camera file: its fields, each checked when it is read."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.cameras.lens import MAX_DISTANCE, lens_rule
from brushgs.io.json_file import shown
from brushgs.values.camera import Camera

_MIN_ANGLE = 1e-6  # radians
_NEAR_RIGID = 1e-2  # rotations this close to orthonormal were rounded, not scaled
_CV_FROM_GL = np.diag([1.0, -1.0, -1.0])  # x right, y up, z backward -> x right, y down, z forward

Json = dict[str, Any]


class CameraFrame:
    """One frame of a camera file; fields are looked up in the frame, then in those that all frames share.

    Every method raises SceneError with the path, the frame and the field at fault.

    Args:
        path: the file.
        name: what the entry is called in errors, such as "frame 3".
        own: its fields.
        shared: the fields of the file.
    """

    def __init__(self, path: Path, name: str, own: Json, shared: Json) -> None:
        self.path, self.name, self.own, self.shared = path, name, own, shared

    def fail(self, message: str) -> SceneError:
        """An error that names the frame."""
        return SceneError(self.path, f"{self.name}: {message}")

    def find(self, name: str) -> object:
        """A field, or None."""
        return self.own.get(name, self.shared.get(name))

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number."""
        value = self.find(name)
        if value is None and default is not None:
            return default
        if value is None:
            raise self.fail(f"no field {name!r}; export the cameras again")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise self.fail(f"{name!r} must be a finite number, got {shown(value)}")
        return float(value)

    def positive(self, name: str, default: float | None = None, *, least: float = 0.0) -> float:
        """A number above zero, and not below `least`."""
        value = self.number(name, default)
        if value <= 0 or value < least:
            raise self.fail(f"{name!r} must be above {0 if value <= 0 else least:g}, got {value:g}")
        return value

    def angle(self, name: str, unit: float = 1.0) -> float:
        """A field of view in radians; `unit` is one unit of the field."""
        value = self.positive(name, least=_MIN_ANGLE) * unit
        if value >= math.pi:
            raise self.fail(f"{name!r} must be below half a turn, got {value / unit:g}")
        return value

    def focal(self, side: float, name: str, unit: float = 1.0) -> float:
        """Focal length, pixels, at which a side of so many pixels fills the field of view `name`."""
        return side / 2 / math.tan(self.angle(name, unit) / 2)

    def array(self, name: str, *shape: int, or_shape: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Finite numbers in the given shape, or in `or_shape` if their count fits that; nested or not."""
        value = self.find(name)
        if value is None:
            raise self.fail(f"no field {name!r}; export the cameras again")
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise self.fail(f"{name!r} must hold numbers only") from None
        if or_shape and array.size == math.prod(or_shape):
            shape = or_shape
        if array.size != math.prod(shape) or not np.isfinite(array).all():
            size = "x".join(map(str, shape))
            raise self.fail(f"{name!r} must hold {size} finite numbers, got {shown(value)}")
        return array.reshape(shape)

    def camera(
        self,
        world_from_cam: NDArray[np.float64],
        position: NDArray[np.float64],
        K: tuple[float, ...],
        size: tuple[float, float],
        near: float = Camera.near,
    ) -> Camera:
        """The camera at a pose, its rotation cleaned of rounding errors.

        Args:
            world_from_cam: [3, 3] rotation; x right, y down, z forward.
            position: [3] world units.
            K: fx, fy, cx, cy, pixels.
            size: width and height, pixels.
            near: see `Camera`, world units.
        """
        if broken := lens_rule(K, size, position):
            raise self.fail(broken)
        rotation = self.rigid(world_from_cam)
        viewmat = np.eye(4)
        viewmat[:3, :3] = rotation.T
        viewmat[:3, 3] = -rotation.T @ position
        fx, fy, cx, cy = K
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        try:
            return Camera(viewmat, matrix, round(size[0]), round(size[1]), near)
        except ValueError as error:
            raise self.fail(str(error)) from None

    def opengl_camera(
        self, name: str, K: tuple[float, ...], size: tuple[float, float], near: float = Camera.near
    ) -> Camera:
        """The camera at the pose in a field: camera-to-world, 3x4 or 4x4, with x right, y up, z backward."""
        matrix = self.array(name, 4, 4, or_shape=(3, 4))
        return self.camera(matrix[:3, :3] @ _CV_FROM_GL, matrix[:3, 3], K, size, near)

    def rigid(self, rotation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest rotation to a matrix that is almost one."""
        if (longest := np.abs(rotation).max()) > MAX_DISTANCE:  # for which the SVD may not converge
            raise self.fail(f"the rotation must not scale or mirror, got an entry of {longest:.4g}")
        left, stretch, right = np.linalg.svd(rotation)
        nearest = np.asarray(left @ right)
        is_mirrored = np.linalg.det(nearest) < 0
        if np.abs(stretch - 1).max() > _NEAR_RIGID or is_mirrored:
            found = ", ".join(f"{value:.4g}" for value in stretch) + " long"
            found += " and mirrored" if is_mirrored else ""
            raise self.fail(f"the rotation must not scale or mirror, got axes {found}")
        return nearest


def read_frames(
    path: Path, frames: object, shared: Json, read: Callable[[CameraFrame], Camera], name: str = "frame"
) -> list[Camera]:
    """The cameras of a list of entries.

    Args:
        path: the file.
        frames: what should be a list of JSON objects.
        shared: the fields that all of them share.
        read: turns one entry into a camera.
        name: what an entry is called in errors.

    Raises:
        SceneError: if it is no list, is empty, or an entry is no object or cannot be used.
    """
    if not isinstance(frames, list) or not frames:
        raise SceneError(path, "holds no cameras; export it again")
    cameras = []
    for index, frame in enumerate(frames):
        if not isinstance(frame, dict):
            raise SceneError(path, f"{name} {index}: must be an object, got {shown(frame)}")
        cameras.append(read(CameraFrame(path, f"{name} {index}", frame, shared)))
    return cameras


def names_in(frames: object, field: str) -> tuple[str, ...]:
    """The names of the pictures of a list of entries, "" where an entry has none."""
    entries = frames if isinstance(frames, list) else []
    found = [entry.get(field) if isinstance(entry, dict) else None for entry in entries]
    return tuple(name if isinstance(name, str) else "" for name in found)
