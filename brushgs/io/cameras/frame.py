"""One entry of a camera file: its fields, checked as they are asked for."""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.io.json_file import shown
from brushgs.options.choices import size_rule
from brushgs.scene import Camera

# Pixels and world units far beyond any camera: from here on squares and quotients leave the range of numbers.
_LENSES, _MAX_PLACE = (1e-3, 1e9), 1e15
_SMALLEST_ANGLE = 1e-6  # radians
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
        value = self.positive(name, least=_SMALLEST_ANGLE) * unit
        if value >= math.pi:
            raise self.fail(f"{name!r} must be below half a turn, got {value / unit:g}")
        return value

    def focal(self, side: float, name: str, unit: float = 1.0) -> float:
        """Focal length at which a side of so many pixels fills the field of view `name`."""
        return side / 2 / math.tan(self.angle(name, unit) / 2)

    def array(self, name: str, *shape: int, or_shape: tuple[int, ...] = ()) -> NDArray[np.float64]:
        """Finite numbers in the shape given, or in the other one if there are as many; nested or not."""
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
    ) -> Camera:
        """The camera with a rotation freed of rounding; K is fx, fy, cx, cy."""
        if broken := lens_rule(K, size, position):
            raise self.fail(broken)
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
        if (longest := np.abs(rotation).max()) > _MAX_PLACE:  # for which the factors may not be found
            raise self.fail(f"the rotation must not scale or mirror, got an entry of {longest:.4g}")
        left, stretch, right = np.linalg.svd(rotation)
        nearest = np.asarray(left @ right)
        is_mirrored = np.linalg.det(nearest) < 0
        if np.abs(stretch - 1).max() > _NEAR_RIGID or is_mirrored:
            found = ", ".join(f"{value:.4g}" for value in stretch) + " long"
            found += " and mirrored" if is_mirrored else ""
            raise self.fail(f"the rotation must not scale or mirror, got axes {found}")
        return nearest


def lens_rule(K: Sequence[float], size: Sequence[float], place: ArrayLike) -> str | None:
    """What a camera breaks that could not be drawn with, in words; None where nothing.

    Args:
        K: fx, fy, cx, cy, pixels.
        size: width and height, pixels.
        place: numbers of its position or translation, world units.
    """
    if max(size) > 1 << 20:  # first: it may have hundreds of digits, and others follow from it
        return f"the size must be that of a picture, got more than {1 << 20} pixels along a side"
    least, most = _LENSES
    if not all(least <= focal <= most for focal in K[:2]):
        return f"the focal length must be {least:g} to {most:g} pixels, got {min(K[:2]):g} and {max(K[:2]):g}"
    if not all(abs(value) <= most for value in K[2:]):
        return f"the principal point must lie within {most:g} pixels, got {K[2]:g}, {K[3]:g}"
    if not (farthest := np.abs(place).max()) <= _MAX_PLACE:
        return f"the position must lie within {_MAX_PLACE:g} of the origin, got {farthest:g}"
    broken = size_rule(max(1, round(size[0])), max(1, round(size[1])))
    return f"the size {broken}" if broken else None


def warn_of_distortion(path: Path, model: str, found: dict[str, float]) -> None:
    """Warn once that the lens distortion of a file, by name of the coefficient, was left out."""
    listed = ", ".join(f"{name} = {value:g}" for name, value in found.items())
    message = f"the distortion of camera model {model} was ignored ({listed}); pictures are a pinhole's"
    warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=4)
