"""Read the cameras of a COLMAP sparse model (cameras and images, binary or text).

As here, COLMAP has x right, y down, z forward and pixel centers at +0.5; an image stores camera from world.
Points are skipped. Formats: colmap.github.io/format.html.
"""

import math
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, NamedTuple, TypeVar

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile, camera_of, warn_of_distortion
from brushgs.formats.files import open_plain
from brushgs.formats.format import MODEL_FOLDERS
from brushgs.values.camera import Camera
from brushgs.values.quats import rotation_matrices

T = TypeVar("T")
_Entries = Callable[[Path, BinaryIO], Iterator[T]]
# Names and parameters, indexed by the number in binary files; parameters are None if it is no pinhole.
MODELS: list[tuple[str, str | None]] = [
    ("SIMPLE_PINHOLE", "f cx cy"),
    ("PINHOLE", "fx fy cx cy"),
    ("SIMPLE_RADIAL", "f cx cy k1"),
    ("RADIAL", "f cx cy k1 k2"),
    ("OPENCV", "fx fy cx cy k1 k2 p1 p2"),
    ("OPENCV_FISHEYE", None),
    ("FULL_OPENCV", "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6"),
    ("FOV", None),
    ("SIMPLE_RADIAL_FISHEYE", None),
    ("RADIAL_FISHEYE", None),
    ("THIN_PRISM_FISHEYE", None),
    ("RAD_TAN_THIN_PRISM_FISHEYE", None),
]
_PARAMETERS = dict(MODELS)
_SUFFIXES = (".bin", ".txt")  # if a folder has both, the binary files are read, as COLMAP does

_COUNT = struct.Struct("<Q")
_CAMERA = struct.Struct("<iiQQ")  # id, model, width, height; then the parameters
_IMAGE = struct.Struct("<i7di")  # id, quaternion w x y z, translation, camera id; then name, points
_POINT_BYTES = 24
_MIN_CAMERA_BYTES = _CAMERA.size + 3 * 8
_MIN_IMAGE_BYTES = _IMAGE.size + 1 + _COUNT.size
_MAX_NAME = 65536  # bytes
_MAX_LINE = 1 << 17  # bytes of a line of text with an image and its name; lines of points may be longer
# A view takes some 1.2 kB in memory and as little as 73 bytes in a file; large captures have some 10,000.
_MAX_ENTRIES = 50_000


class _Lens(NamedTuple):
    """A camera of a model; `values` maps parameter names of `MODELS` to numbers."""

    model: str
    size: tuple[int, int]
    values: dict[str, float]

    @property
    def intrinsics(self) -> tuple[float, ...]:
        """fx, fy, cx, cy, pixels."""
        focal = self.values.get("f", 0.0)
        return *(self.values.get(name, focal) for name in ("fx", "fy")), self.values["cx"], self.values["cy"]


class _Image(NamedTuple):
    name: str
    quat: tuple[float, ...]
    translation: tuple[float, ...]
    camera_id: int


def read(path: Path, content: object = None) -> CameraFile:
    """Read the views of a sparse model, sorted by image name.

    Distortion of the models SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV is ignored with one SceneWarning.
    `path` is the folder of a model, one of its files, or a folder with the model in `sparse/0` or the like.

    Raises SceneError if there is no model, it is damaged, or a camera is no pinhole.
    """
    try:
        cameras_file, images_file = _find(path)
        lenses = dict(_entries(cameras_file, _binary_lenses, _text_lenses))
        images = sorted(_entries(images_file, _binary_images, _text_images), key=lambda image: image.name)
    except OSError as error:
        place = Path(error.filename or path)
        raise SceneError(place, f"cannot be read ({error.strerror}); check the path") from None
    if not images:
        raise SceneError(images_file, "holds no images; the reconstruction found none, run it again")
    cameras = [_camera(images_file, image, lenses) for image in images]
    used = (lenses[number] for number in sorted({image.camera_id for image in images}))
    warn_of_distortion(cameras_file, ((lens.model, lens.values) for lens in used))
    return CameraFile(cameras, names=tuple(image.name for image in images))


def _find(path: Path) -> tuple[Path, Path]:
    """The files of cameras and images of the model at a path."""
    if not path.exists():
        raise SceneError(path, "there is no such file; check the path")
    places = [(path.parent, path.suffix)]
    if path.is_dir():
        places = [(path / place, suffix) for place in MODEL_FOLDERS for suffix in _SUFFIXES]
    pairs = [(folder / f"cameras{suffix}", folder / f"images{suffix}") for folder, suffix in places]
    for pair in pairs:
        if pair[0].exists() and pair[1].exists():
            return pair
    for cameras_file, images_file in pairs:
        if cameras_file.exists() or images_file.exists():
            missing = images_file if cameras_file.exists() else cameras_file
            raise SceneError(missing, "there is no such file, but a sparse model needs it; copy it too")
    what = "is a folder without" if path.is_dir() else "is not beside the cameras and images of"
    raise SceneError(path, f"{what} a COLMAP model (cameras.bin and images.bin, or .txt); check the path")


def _entries(path: Path, binary: _Entries[T], text: _Entries[T]) -> Iterator[T]:
    """Yield the entries of a binary or text file, at most `_MAX_ENTRIES`."""
    with open_plain(path) as file:
        for number, entry in enumerate((binary if path.suffix == ".bin" else text)(path, file)):
            if number == _MAX_ENTRIES:
                raise SceneError(path, f"must hold at most {_MAX_ENTRIES} entries; take a part of the model")
            yield entry


def _camera(path: Path, image: _Image, lenses: dict[int, _Lens]) -> Camera:
    lens, quat = lenses.get(image.camera_id), np.array([image.quat])
    if lens is None:
        fault = f"camera {image.camera_id} is not in the cameras file; copy both files from one model"
    elif not np.isfinite(quat).all() or not quat.any():
        fault = f"the quaternion must be finite and not zero, got {image.quat}; export the model again"
    elif not all(map(math.isfinite, image.translation)):
        fault = f"the translation must be finite, got {image.translation}; export the model again"
    else:
        try:
            return camera_of(rotation_matrices(quat)[0], image.translation, lens.intrinsics, lens.size)
        except ValueError as error:
            fault = f"{error}; export the model again"
    raise SceneError(path, f"image {image.name[:80]!r}: {fault}")


def _lens(path: Path, number: int, model: str, size: tuple[int, int], values: tuple[float, ...]) -> _Lens:
    """A checked camera of the model."""
    lens = _Lens(model, size, dict(zip((_PARAMETERS[model] or "").split(), values, strict=True)))
    if min(size) < 1:
        fault = f"the size must be at least 1x1, got {size[0]}x{size[1]}"
    elif not all(map(math.isfinite, values)):
        fault = f"the parameters must be finite, got {values}"
    elif min(lens.intrinsics[:2]) <= 0:
        fault = f"the focal length must be above 0, got {min(lens.intrinsics[:2]):g}"
    else:
        return lens
    raise SceneError(path, f"camera {number}: {fault}; export the model again")


def _check_model(path: Path, number: int, model: str) -> list[str]:
    """The names of the parameters of a pinhole model. Raises SceneError for other models."""
    if parameters := _PARAMETERS.get(model):
        return parameters.split()
    known = ", ".join(name for name, parameters in MODELS if parameters)
    cure = f"a pinhole is needed ({known}): undistort the images with `colmap image_undistorter`"
    is_known = model in _PARAMETERS
    what = (
        f"camera model {model} is not a pinhole" if is_known else f"{model[:40]} is not a known camera model"
    )
    raise SceneError(path, f"camera {number}: {what}; {cure}")


def _binary_lenses(path: Path, file: BinaryIO) -> Iterator[tuple[int, _Lens]]:
    reader = _Reader(path, file)
    for _ in range(reader.count("cameras", _MIN_CAMERA_BYTES)):
        number, model_id, width, height = reader.read(_CAMERA)
        model = MODELS[model_id][0] if 0 <= model_id < len(MODELS) else f"number {model_id}"
        values = reader.read(struct.Struct(f"<{len(_check_model(path, number, model))}d"))
        yield number, _lens(path, number, model, (width, height), values)


def _binary_images(path: Path, file: BinaryIO) -> Iterator[_Image]:
    reader = _Reader(path, file)
    for _ in range(reader.count("images", _MIN_IMAGE_BYTES)):
        _, *pose, camera_id = reader.read(_IMAGE)
        name = reader.name()
        num_points = reader.count(f"points of image {name[:80]!r}", _POINT_BYTES)
        file.seek(num_points * _POINT_BYTES, os.SEEK_CUR)
        yield _Image(name, tuple(pose[:4]), tuple(pose[4:]), camera_id)


class _Reader:
    """Reads a binary file record by record; counts are checked against the remaining bytes."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.path, self.file = path, file
        self.size = os.fstat(file.fileno()).st_size

    def read(self, record: struct.Struct) -> tuple[int, ...]:
        data = self.file.read(record.size)
        if len(data) < record.size:
            raise self._truncated()
        return record.unpack(data)

    def count(self, what: str, smallest: int) -> int:
        (number,) = self.read(_COUNT)
        if number * smallest > self.size - self.file.tell():
            message = f"claims {number} {what}, for which its {self.size:,} bytes are too few"
            raise SceneError(self.path, f"{message}; copy or export it again")
        return number

    def name(self) -> str:
        """Read a zero-terminated string."""
        start = self.file.tell()
        data = self.file.read(256)
        if b"\0" not in data:
            data += self.file.read(_MAX_NAME)
        if (end := data.find(b"\0")) < 0:
            if self.file.tell() == self.size:
                raise self._truncated()
            raise SceneError(self.path, f"has no image name at byte {start:,}; copy or export it again")
        self.file.seek(start + end + 1)
        return data[:end].decode("utf-8", "replace")

    def _truncated(self) -> SceneError:
        return SceneError(self.path, f"ends too early, after {self.size:,} bytes; copy or export it again")


def _text_lenses(path: Path, file: BinaryIO) -> Iterator[tuple[int, _Lens]]:
    for row, words in _text_rows(path, file):
        with _row_errors(path, row, "CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS"):
            number, model, width, height = int(words[0]), words[1], int(words[2]), int(words[3])
            values = tuple(map(float, words[4:]))
        num_expected = len(_check_model(path, number, model))
        if len(values) != num_expected:
            found = f"camera model {model} must have {num_expected} parameters, got {len(values)}"
            raise SceneError(path, f"line {row}: {found}; export the model again")
        yield number, _lens(path, number, model, (width, height), values)


def _text_images(path: Path, file: BinaryIO) -> Iterator[_Image]:
    for row, words in _text_rows(path, file, lines_per_row=2):
        with _row_errors(path, row, "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME"):
            int(words[0])
            pose = tuple(map(float, words[1:8]))
            camera_id, name = int(words[8]), " ".join(words[9:])
            if not name:
                raise ValueError("no name")
        yield _Image(name, pose[:4], pose[4:], camera_id)


def _text_rows(path: Path, file: BinaryIO, lines_per_row: int = 1) -> Iterator[tuple[int, list[str]]]:
    """Yield the number (from 1) and the words of each line that is neither empty nor a comment.

    With `lines_per_row` = 2, the second line of each row (points of an image, maybe empty) is skipped.
    """
    number = 0
    while line := file.readline(_MAX_LINE):
        number += 1
        if len(line) == _MAX_LINE:
            fault = f"line {number}: must have at most {_MAX_LINE} bytes"
            raise SceneError(path, f"{fault}; export the model as text again")
        words = line.decode("utf-8", "replace").split()
        if not words or words[0].startswith("#"):
            continue
        yield number, words
        for _ in range(lines_per_row - 1):
            number += 1
            while len(part := file.readline(_MAX_LINE)) == _MAX_LINE and not part.endswith(b"\n"):
                pass


@contextmanager
def _row_errors(path: Path, row: int, fields: str) -> Iterator[None]:
    try:
        yield
    except (ValueError, IndexError):
        raise SceneError(path, f"line {row}: must hold {fields}; export the model as text again") from None
