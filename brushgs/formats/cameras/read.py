"""A camera file of any format becomes a list of `Camera`; what all formats give and check is here too."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import is_dir, is_plain, read_whole
from brushgs.formats.format import Format
from brushgs.formats.registry import CAMERAS_READ, FILES_BESIDE, MODEL_BESIDE, added, formats_of, function_of
from brushgs.formats.schema import MAX_BYTES, check_memory, parse_checked, shown
from brushgs.options.choices import size_rule
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera


@dataclass(frozen=True)
class Motion:
    """A camera that is known at every moment, as an animation is."""

    seconds: float  # duration, > 0
    at: Callable[[F64], list[Camera]]  # its views at some moments, [T] seconds from the start, 0 to `seconds`

    def views(self, num_frames: int) -> list[Camera]:
        """Views equally far apart in time; the first and the last are the ends, of one it is the first."""
        return self.at(np.linspace(0.0, self.seconds, num_frames))


@dataclass(frozen=True)
class CameraFile:
    """What a camera file holds."""

    # its views, >= 1, in the order of the file; those of a COLMAP model by the name of the image
    cameras: list[Camera]
    # the key views that a camera path was made of; may be empty
    keys: list[Camera] = field(default_factory=list)
    fps: float | None = None  # frames a second, if the file states it
    is_loop: bool = False  # whether the file states that the first frame follows the last
    # of the pictures that the cameras took, as the file has them, one a camera; empty, also as a single name,
    # where it has none
    names: tuple[str, ...] = ()
    motion: Motion | None = None  # of an animated camera, whose frames are `cameras`
    choice: str = ""  # which camera of several this is, in words, such as "the animated camera 'Shot' of 3"


# Pixels and world units far beyond any camera: squares and quotients of larger numbers overflow.
FOCAL_LENGTHS, MAX_DISTANCE = (1e-3, 1e9), 1e15


def camera_of(
    rotation: F64,
    translation: ArrayLike,
    K: Sequence[float],
    size: Sequence[float],
    near: float = Camera.near,
) -> Camera:
    """A camera whose numbers a file states.

    Args:
        rotation: [3, 3] camera from world; x right, y down, z forward.
        translation: [3] likewise, world units.
        K: fx, fy, cx, cy, pixels.
        size: width and height, pixels; rounded.
        near: see `Camera`, world units.

    Raises:
        ValueError: if it cannot be used, with the rule that it breaks.
    """
    if broken := _lens_rule(K, size, translation):
        raise ValueError(broken)
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = rotation, translation
    matrix = np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1]], np.float64)
    return Camera(viewmat, matrix, round(size[0]), round(size[1]), float(near))


def _lens_rule(K: Sequence[float], size: Sequence[float], place: ArrayLike) -> str | None:
    """The rule that an unusable camera breaks, in words; None for a usable one."""
    if max(size) > 1 << 20:  # first: it may have hundreds of digits, and others follow from it
        return f"the size must be that of a picture, got more than {1 << 20} pixels along a side"
    least, most = FOCAL_LENGTHS
    if not all(least <= focal <= most for focal in K[:2]):
        return f"the focal length must be {least:g} to {most:g} pixels, got {min(K[:2]):g} and {max(K[:2]):g}"
    if not all(abs(value) <= most for value in K[2:]):
        return f"the principal point must lie within {most:g} pixels, got {K[2]:g}, {K[3]:g}"
    if not (farthest := np.abs(place).max()) <= MAX_DISTANCE:
        return f"the position must lie within {MAX_DISTANCE:g} of the origin, got {farthest:g}"
    broken = size_rule(max(1, round(size[0])), max(1, round(size[1])))
    return f"the size {broken}" if broken else None


def warn_of_distortion(path: Path, model: str, coefficients: dict[str, float]) -> None:
    """Warn once that the lens distortion of a file is ignored, if it has a coefficient that is not 0."""
    if not coefficients:
        return
    listed = ", ".join(f"{name} = {value:g}" for name, value in coefficients.items())
    message = f"the distortion of camera model {model} was ignored ({listed}); pictures are a pinhole's"
    warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=4)


def read_cameras(path: str | Path) -> CameraFile:
    """Read a camera file: its views as `brushgs.load_cameras` returns them, and what else a path states.

    Raises SceneError if the file is of no known format, or a field of a frame is missing or unusable.
    """
    camera_format, content = _identify(path := Path(path))
    file: CameraFile = function_of(camera_format.read)(path, content)
    return file


def _identify(path: Path) -> tuple[Format, bytes | None]:
    """The format of a file, and its bytes; None where the path shows the format."""
    known = formats_of("camera")
    by_path = next((row for row in known if row.matches(path, b"")), None)
    if by_path is None and path.suffix.lower() != ".json":
        by_path = next((row for row in added("camera") if row.matches(path, b"")), None)
    if by_path is not None:
        if by_path.read is None:
            raise SceneError(path, f"is {by_path.name}, which is not read; {by_path.cure}")
        return by_path, None
    cure = f"give {CAMERAS_READ}"
    content = read_whole(path, MAX_BYTES)
    check_memory(path, content)
    try:
        value = msgspec.json.decode(content, type=list[msgspec.Raw] | dict[str, msgspec.Raw])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        value = parse_checked(path, content, cure)
    for camera_format in known:
        key = camera_format.key
        if (key in value) if key and isinstance(value, dict) else (key == "" and isinstance(value, list)):
            return camera_format, content
    raise SceneError(path, f"is no camera file of a known format, got {shown(value)}; {cure}")


def find_beside(folders: Iterable[Path]) -> list[Path]:
    """The camera files in some folders, those of the first folder first; none is opened."""
    found = []
    for folder in folders:
        found += [path for name in FILES_BESIDE if is_plain(path := folder / name)]
        found += [path for path in (folder / MODEL_BESIDE,) if is_dir(path)]
    return found


def read_beside(path: Path) -> list[Camera]:
    """The cameras of such a file; what they are used for needs no lens, so its distortion is not told.

    Raises SceneError if it cannot be read, is too large, or is no camera file.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        return read_cameras(path).cameras


def name_beside(path: Path) -> str:
    """What such a file is called in messages."""
    return MODEL_BESIDE if path.name == "0" else path.name


def reason_of(error: SceneError) -> str:
    """Why a file cannot be used, without its path and the cure."""
    return str(error).removeprefix(f"{error.path}: ").split("; ")[0]
