"""Read a camera file of any format as a list of `Camera`; and the types and checks shared by all formats."""

import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

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


class Motion(NamedTuple):
    """An animated camera, which can be evaluated at any time."""

    seconds: float  # duration, > 0
    at: Callable[[F64], list[Camera]]  # views at times [T], 0 to `seconds` from the start

    def views(self, num_frames: int) -> list[Camera]:
        """Views equally spaced in time from the start to the end; a single view is at the start."""
        return self.at(np.linspace(0.0, self.seconds, num_frames))


@dataclass(frozen=True)
class CameraFile:
    """The content of a camera file."""

    # one or more views in the order of the file; sorted by image name for a COLMAP model
    cameras: list[Camera]
    # the keyframes of a camera path; may be empty
    keys: list[Camera] = field(default_factory=list)
    fps: float | None = None  # frames a second, if the file states it
    is_loop: bool = False  # whether the file states that the first frame follows the last
    # names of the pictures that the cameras took, as in the file, one per camera; "" if a camera has none;
    # empty if the format has none
    names: tuple[str, ...] = ()
    motion: Motion | None = None  # of an animated camera, whose frames are `cameras`
    choice: str = ""  # the chosen one of several cameras, such as "the animated camera 'Shot' of 3"


# Limits in pixels and world units, far beyond any camera: squares and quotients of larger numbers overflow.
FOCAL_LENGTHS, MAX_DISTANCE = (1e-3, 1e9), 1e15


def camera_of(
    rotation: F64,
    translation: ArrayLike,
    K: Sequence[float],
    size: Sequence[float],
    near: float = Camera.near,
) -> Camera:
    """Make a camera from the numbers of a file.

    Args:
        rotation: [3, 3] camera from world; x right, y down, z forward.
        translation: [3] camera from world, world units.
        K: fx, fy, cx, cy, pixels.
        size: width and height, pixels; rounded.
        near: see `Camera`, world units.

    Raises:
        ValueError: if a number is unusable; the message is the broken rule.
    """
    if broken := _lens_rule(K, size, translation):
        raise ValueError(broken)
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = rotation, translation
    matrix = np.array([[K[0], 0, K[2]], [0, K[1], K[3]], [0, 0, 1]], np.float64)
    return Camera(viewmat, matrix, round(size[0]), round(size[1]), float(near))


def _lens_rule(K: Sequence[float], size: Sequence[float], place: ArrayLike) -> str | None:
    """The rule that a camera breaks, in words; None if it is usable."""
    if max(size) > 1 << 20:  # check this first: it may have hundreds of digits, and others depend on it
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


def warn_of_distortion(path: Path, lenses: Iterable[tuple[str, dict[str, Any]]]) -> None:
    """Warn once that the lens distortion of a file is ignored; a lens is its model and its parameters.

    Parameters that are no numbers are skipped.
    """
    found: dict[str, tuple[float, str]] = {}
    for model, values in lenses:
        for name, value in values.items():
            if name[0] in "kp" and isinstance(value, int | float) and value:
                found.setdefault(name, (value, model))
    if found:
        listed = ", ".join(f"{name} = {value:g}" for name, (value, _) in found.items())
        model = next(iter(found.values()))[1]
        message = f"the distortion of camera model {model} was ignored ({listed}); pictures are a pinhole's"
        warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=4)


def read_cameras(path: str | Path) -> CameraFile:
    """Read a camera file: the views that `brushgs.load_cameras` returns, and further data of a camera path.

    Raises SceneError if the format is unknown, or a field of a frame is missing or unusable.
    """
    camera_format, content = _identify(path := Path(path))
    file: CameraFile = function_of(camera_format.read)(path, content)
    return file


def _identify(path: Path) -> tuple[Format, bytes | None]:
    """The format of a file, and its bytes if it is JSON; None if the format was found from the path."""
    known = formats_of("camera")
    by_path = next((row for row in known if row.matches(path, b"")), None)
    if by_path is None and path.suffix.lower() != ".json":
        by_path = next((row for row in added("camera") if row.matches(path, b"")), None)
    if by_path is not None:
        if by_path.read is None:
            raise SceneError(path, f"is {by_path.name}, which is not read; {by_path.cure}")
        return by_path, None
    cure = f"give {CAMERAS_READ}"
    if is_dir(path):
        raise SceneError(path, f"is a folder without cameras; {cure}")
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
    """The camera files in some folders, in the order of the folders; none is opened."""
    kinds = [(name, is_plain) for name in FILES_BESIDE] + [(MODEL_BESIDE, is_dir)]
    return [path for folder in folders for name, is_one in kinds if is_one(path := folder / name)]


def read_beside(path: Path) -> list[Camera]:
    """The cameras of a file of `find_beside`, without warnings: distortion does not matter for their use.

    Raises SceneError if it cannot be read, is too large, or is no camera file.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        return read_cameras(path).cameras


def name_beside(path: Path) -> str:
    """The name of a file of `find_beside` in messages."""
    return MODEL_BESIDE if path.name == "0" else path.name


def reason_of(error: SceneError) -> str:
    """Why a file cannot be used, without its path and the cure."""
    return error.message.split("; ")[0]
