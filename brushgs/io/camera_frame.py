"""One entry of a camera file: its fields, checked as they are asked for."""

import json
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.scene import Camera

_NEAR_RIGID = 1e-2  # rotations this close to orthonormal were rounded, not scaled

Json = dict[str, Any]


class CameraFrame:
    """One frame of a camera file; fields are looked up in the frame, then in what all frames share.

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
            raise self.fail(f"{name!r} must be a finite number, got {json.dumps(value)[:40]}")
        return float(value)

    def positive(self, name: str, default: float | None = None) -> float:
        """A number above zero."""
        value = self.number(name, default)
        if value <= 0:
            raise self.fail(f"{name!r} must be above 0, got {value:g}")
        return value

    def angle(self, name: str, unit: float = 1.0) -> float:
        """A field of view in radians; `unit` is one unit of the field."""
        value = self.positive(name) * unit
        if value >= math.pi:
            raise self.fail(f"{name!r} must be below half a turn, got {value / unit:g}")
        return value

    def array(self, name: str, *shape: int) -> NDArray[np.float64]:
        """Finite numbers in the shape given; nested or not."""
        value = self.find(name)
        if value is None:
            raise self.fail(f"no field {name!r}; export the cameras again")
        try:
            array = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise self.fail(f"{name!r} must hold numbers only") from None
        if array.size != math.prod(shape) or not np.isfinite(array).all():
            size = "x".join(map(str, shape))
            raise self.fail(f"{name!r} must hold {size} finite numbers, got {json.dumps(value)[:60]}")
        return array.reshape(shape)

    def camera(
        self,
        world_from_cam: NDArray[np.float64],
        position: NDArray[np.float64],
        K: tuple[float, ...],
        size: tuple[float, float],
    ) -> Camera:
        """The camera with a rotation freed of rounding; K is fx, fy, cx, cy."""
        rotation = self.rigid(world_from_cam)
        viewmat = np.eye(4)
        viewmat[:3, :3] = rotation.T
        viewmat[:3, 3] = -rotation.T @ position
        fx, fy, cx, cy = K
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        try:
            return Camera(viewmat, matrix, round(size[0]), round(size[1]))
        except ValueError as error:
            raise self.fail(str(error)) from None

    def rigid(self, rotation: NDArray[np.float64]) -> NDArray[np.float64]:
        """The nearest rotation to a matrix that is almost one."""
        left, stretch, right = np.linalg.svd(rotation)
        nearest = np.asarray(left @ right)
        is_mirrored = np.linalg.det(nearest) < 0
        if np.abs(stretch - 1).max() > _NEAR_RIGID or is_mirrored:
            found = ", ".join(f"{value:.4g}" for value in stretch) + " long"
            found += " and mirrored" if is_mirrored else ""
            raise self.fail(f"the rotation must not scale or mirror, got axes {found}")
        return nearest


def warn_of_distortion(path: Path, model: str, found: dict[str, float]) -> None:
    """Warn once that the lens distortion of a file, by name of the coefficient, was left out."""
    listed = ", ".join(f"{name} = {value:g}" for name, value in found.items())
    message = f"the distortion of camera model {model} was left out ({listed}); pictures are a pinhole's"
    warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=4)
