"""A COLMAP sparse model (cameras and images, binary or text) becomes a list of `Camera`.

COLMAP's cameras have x right, y down, z forward and pixel centres at +0.5, as here; an image stores
camera from world. Points are skipped. Formats: colmap.github.io/format.html.
"""

import math
import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, TypeVar

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile, lens_rule, warn_of_distortion
from brushgs.formats.files import open_plain
from brushgs.values.camera import Camera
from brushgs.values.quats import rotation_matrices

T = TypeVar("T")
# In the order of their numbers in binary files: name and parameters; None: no pinhole.
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
_MODEL_FOLDERS = ("", "sparse/0", "sparse", "colmap/sparse/0", "0")  # in the folder of a capture

_COUNT = struct.Struct("<Q")
_CAMERA = struct.Struct("<iiQQ")  # id, model, width, height; then the parameters
_IMAGE = struct.Struct("<i7di")  # id, quaternion w x y z, translation, camera id; then name, points
_POINT_BYTES = 24
_MIN_CAMERA_BYTES = _CAMERA.size + 3 * 8
_MIN_IMAGE_BYTES = _IMAGE.size + 1 + _COUNT.size
_MAX_NAME = 65536  # bytes
_MAX_LINE = 1 << 17  # bytes of a line of text: an image and its name; lines of points may be longer
# A view takes some 1.2 kB in memory and may take 73 bytes in a file; large captures have some ten thousand.
_MAX_ENTRIES = 50_000


@dataclass(frozen=True, slots=True)
class _Lens:
    model: str
    width: int
    height: int
    values: dict[str, float]  # by the names in `MODELS`

    def matrix(self) -> list[list[float]]:
        value = self.values
        fx, fy = value.get("fx", value.get("f", 0.0)), value.get("fy", value.get("f", 0.0))
        return [[fx, 0, value["cx"]], [0, fy, value["cy"]], [0, 0, 1]]


@dataclass(frozen=True, slots=True)
class _Image:
    name: str
    quat: tuple[float, ...]
    translation: tuple[float, ...]
    camera_id: int


def read(path: Path, content: object = None) -> CameraFile:
    """The views of a sparse model, sorted by the name of the image.

    Distortion of the models SIMPLE_RADIAL, RADIAL, OPENCV and FULL_OPENCV is ignored with one SceneWarning.

    Args:
        path: a model's folder, one of its files, or a folder with the model in `sparse/0`.
        content: unused; it is for formats in JSON.

    Raises:
        SceneError: if there is no model, it is damaged, or a camera is no pinhole.
    """
    with _as_scene_error(path):
        cameras_file, images_file = _find(path)
    is_binary = cameras_file.suffix == ".bin"
    read_lenses, read_images = (_binary_lenses, _binary_images) if is_binary else (_text_lenses, _text_images)
    with _as_scene_error(cameras_file), open_plain(cameras_file) as file:
        lenses = dict(_bounded(cameras_file, read_lenses(cameras_file, file)))
    with _as_scene_error(images_file), open_plain(images_file) as file:
        images = list(_bounded(images_file, read_images(images_file, file)))
    if not images:
        raise SceneError(images_file, "holds no images; the reconstruction found none, run it again")
    images.sort(key=lambda image: image.name)
    cameras = [_camera(images_file, image, lenses) for image in images]
    _warn(cameras_file, [lenses[number] for number in sorted({image.camera_id for image in images})])
    return CameraFile(cameras, names=tuple(image.name for image in images))


def _bounded(path: Path, entries: Iterator[T]) -> Iterator[T]:
    """The entries of a file, at most `_MAX_ENTRIES`."""
    for number, entry in enumerate(entries):
        if number == _MAX_ENTRIES:
            raise SceneError(path, f"must hold at most {_MAX_ENTRIES} entries; take a part of the model")
        yield entry


def _warn(path: Path, lenses: list[_Lens]) -> None:
    """Warn of lens distortion, which is ignored."""
    found: dict[str, tuple[float, str]] = {}
    for lens in lenses:
        for name, value in lens.values.items():
            if name[0] in "kp" and value:
                found.setdefault(name, (value, lens.model))
    if found:
        model = next(iter(found.values()))[1]
        warn_of_distortion(path, model, {name: value for name, (value, _) in found.items()})


def _find(path: Path) -> tuple[Path, Path]:
    """The two files of the model that a path leads to."""
    if not path.is_dir():
        if not path.exists():
            raise SceneError(path, "there is no such file; check the path")
        places = [(path.parent, path.suffix)]
    else:
        places = [(path / place, suffix) for place in _MODEL_FOLDERS for suffix in _SUFFIXES]
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


@contextmanager
def _as_scene_error(path: Path) -> Iterator[None]:
    """Errors of the file system as a SceneError."""
    try:
        yield
    except OSError as error:
        raise SceneError(path, f"cannot be read ({error.strerror}); check the path") from None


def _camera(path: Path, image: _Image, lenses: dict[int, _Lens]) -> Camera:
    def fail(message: str) -> SceneError:
        return SceneError(path, f"image {image.name[:80]!r}: {message}")

    lens = lenses.get(image.camera_id)
    if lens is None:
        raise fail(f"camera {image.camera_id} is not in the cameras file; copy both files from one model")
    quat = np.array([image.quat])
    if not np.isfinite(quat).all() or not quat.any():
        raise fail(f"the quaternion must be finite and not zero, got {image.quat}; export the model again")
    if not all(map(math.isfinite, image.translation)):
        raise fail(f"the translation must be finite, got {image.translation}; export the model again")
    (fx, _, cx), (_, fy, cy), _ = lens.matrix()
    if broken := lens_rule((fx, fy, cx, cy), (lens.width, lens.height), image.translation):
        raise fail(f"{broken}; export the model again")
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = rotation_matrices(quat)[0], image.translation
    return Camera(viewmat, np.array(lens.matrix()), lens.width, lens.height)


def _lens(path: Path, number: int, model: str, width: int, height: int, values: tuple[float, ...]) -> _Lens:
    """A camera of the model, checked."""
    lens = _Lens(model, width, height, dict(zip((_PARAMETERS[model] or "").split(), values, strict=True)))
    K = lens.matrix()
    if width < 1 or height < 1:
        fault = f"the size must be at least 1x1, got {width}x{height}"
    elif not all(map(math.isfinite, values)):
        fault = f"the parameters must be finite, got {values}"
    elif K[0][0] <= 0 or K[1][1] <= 0:
        fault = f"the focal length must be above 0, got {min(K[0][0], K[1][1]):g}"
    else:
        return lens
    raise SceneError(path, f"camera {number}: {fault}; export the model again")


def _check_model(path: Path, number: int, model: str) -> list[str]:
    """The names of a pinhole model's parameters; refuses other models."""
    known = ", ".join(name for name, parameters in MODELS if parameters)
    cure = f"a pinhole is needed ({known}): undistort the images with `colmap image_undistorter`"
    if model not in _PARAMETERS:
        raise SceneError(path, f"camera {number}: {model[:40]} is not a known camera model; {cure}")
    parameters = _PARAMETERS[model]
    if parameters is None:
        raise SceneError(path, f"camera {number}: camera model {model} is not a pinhole; {cure}")
    return parameters.split()


def _binary_lenses(path: Path, file: BinaryIO) -> Iterator[tuple[int, _Lens]]:
    reader = _Reader(path, file)
    for _ in range(reader.count("cameras", _MIN_CAMERA_BYTES)):
        number, model_id, width, height = reader.read(_CAMERA)
        model = MODELS[model_id][0] if 0 <= model_id < len(MODELS) else f"number {model_id}"
        names = _check_model(path, number, model)
        yield number, _lens(path, number, model, width, height, reader.read(struct.Struct(f"<{len(names)}d")))


def _binary_images(path: Path, file: BinaryIO) -> Iterator[_Image]:
    reader = _Reader(path, file)
    for _ in range(reader.count("images", _MIN_IMAGE_BYTES)):
        _, *pose, camera_id = reader.read(_IMAGE)
        name = reader.name()
        reader.skip(reader.count(f"points of image {name[:80]!r}", _POINT_BYTES) * _POINT_BYTES)
        yield _Image(name, tuple(pose[:4]), tuple(pose[4:]), camera_id)


class _Reader:
    """A binary file read record by record: counts are compared with the number of bytes that are left."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self.path, self.file = path, file
        self.size = os.fstat(file.fileno()).st_size

    def num_left(self) -> int:
        return self.size - self.file.tell()

    def truncated(self) -> SceneError:
        return SceneError(self.path, f"ends too early, after {self.size:,} bytes; copy or export it again")

    def read(self, record: struct.Struct) -> tuple[int, ...]:
        data = self.file.read(record.size)
        if len(data) < record.size:
            raise self.truncated()
        return record.unpack(data)

    def count(self, what: str, smallest: int) -> int:
        (number,) = self.read(_COUNT)
        if number * smallest > self.num_left():
            message = f"claims {number} {what}, for which its {self.size:,} bytes are too few"
            raise SceneError(self.path, f"{message}; copy or export it again")
        return number

    def skip(self, num_bytes: int) -> None:
        self.file.seek(num_bytes, os.SEEK_CUR)

    def name(self) -> str:
        """A zero-terminated text."""
        start = self.file.tell()
        data = self.file.read(256)
        if b"\0" not in data:
            data += self.file.read(_MAX_NAME)
        end = data.find(b"\0")
        if end < 0:
            raise self.truncated() if self.num_left() == 0 else self._no_name(start)
        self.file.seek(start + end + 1)
        return data[:end].decode("utf-8", "replace")

    def _no_name(self, start: int) -> SceneError:
        return SceneError(self.path, f"has no image name at byte {start:,}; copy or export it again")


def _text_lenses(path: Path, file: BinaryIO) -> Iterator[tuple[int, _Lens]]:
    for row, words in _text_rows(path, file):
        with _row_errors(path, row, "CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS"):
            number, model, width, height = int(words[0]), words[1], int(words[2]), int(words[3])
            values = tuple(map(float, words[4:]))
        num_expected = len(_check_model(path, number, model))
        if len(values) != num_expected:
            found = f"camera model {model} must have {num_expected} parameters, got {len(values)}"
            raise SceneError(path, f"line {row}: {found}; export the model again")
        yield number, _lens(path, number, model, width, height, values)


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
    """Number from 1 and words of each line that is neither empty nor a comment.

    With two lines a row the second one holds the points of an image: it may be empty and is skipped.
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
