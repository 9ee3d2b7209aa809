"""Painted masks from files, each with the camera of its picture."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile, read_cameras
from brushgs.formats.files import exists
from brushgs.formats.pictures.images import read_image
from brushgs.formats.registry import PICTURE_FORMATS, PICTURES_READ, suffixes_of
from brushgs.values.arrays import Array
from brushgs.values.camera import Camera
from brushgs.values.colors import split_alpha

if TYPE_CHECKING:
    from brushgs.passes.where.masks import MaskView

SUFFIXES = suffixes_of(PICTURE_FORMATS)
SAME_SHAPE = 0.02  # tolerance in the aspect of a mask and its camera


@dataclass(frozen=True)
class MaskOpener:
    """Opens masks, or other pictures of a scene, with the cameras of a file.

    Attributes:
        camera_file: in any format that is read.
        what: kind of pictures, for messages.
    """

    camera_file: Path
    what: str = "mask"

    @cached_property
    def _cameras(self) -> CameraFile:
        return read_cameras(self.camera_file)

    def __call__(self, path: Path) -> "Sequence[MaskView]":
        """The masks of a picture, or of a folder of pictures: white is inside, alpha is certainty.

        Pictures and cameras are matched by picture name without suffix; without names, in sorted order.

        Raises:
            SceneError: if there is no picture, one cannot be read, or has no camera.
        """
        return [_mask(file, camera) for file, camera in self.pairs(path)]

    def pairs(self, path: Path) -> list[tuple[Path, Camera]]:
        """The files of a folder, or the one file, with their cameras, see `__call__`. Raises the same."""
        files = _pictures(path, self.what)
        return list(zip(files, self._cameras_of(path, files), strict=True))

    def _cameras_of(self, path: Path, files: list[Path]) -> list[Camera]:
        cameras, name = self._cameras.cameras, self.camera_file.name
        by_name = dict(zip(map(_stem, self._cameras.names), cameras, strict=False))
        found = [by_name.get(_stem(file.name)) for file in files]
        if all(camera is not None for camera in found):
            return [camera for camera in found if camera is not None]
        if any(camera is not None for camera in found):
            lost = files[found.index(None)]
            raise SceneError(
                lost, f"{name} has no camera of this name; name each {self.what} as the picture of its camera"
            )
        if len(files) != len(cameras):
            cure = f"name each {self.what} as the picture of its camera, or give each camera one, in order"
            raise SceneError(
                path, f"holds {len(files)} {self.what}s for the {len(cameras)} cameras of {name}; {cure}"
            )
        return cameras


def _pictures(path: Path, what: str) -> list[Path]:
    if not exists(path):
        raise SceneError(path, f"no such file or folder; give the {what}s, pictures or a folder of them")
    if not path.is_dir():
        return [path]
    files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES]
    files = [file for file in files if not file.name.startswith(".")]
    if not files:
        raise SceneError(path, f"holds no {what}s; put pictures in it: {PICTURES_READ}")
    return sorted(files, key=_order)


def _order(file: Path) -> tuple[list[tuple[int, str]], str]:
    """Sort key: by name, with numbers by value: 2.png before 10.png."""
    words = re.findall(r"[0-9]+|[^0-9]+", file.name)
    return [(int(word), "") if word.isdigit() else (-1, word) for word in words], file.name


def _stem(name: str) -> str:
    """The name of a picture without folders and suffixes of pictures: images/7.JPG.png -> 7."""
    name = name.replace("\\", "/").rsplit("/", 1)[-1].lower()
    while (stem := Path(name)).suffix in SUFFIXES and stem.stem:
        name = stem.stem
    return name


def _mask(file: Path, camera: Camera) -> "MaskView":
    from brushgs.passes.where.masks import MaskView

    rgb, known, own = open_with_camera(file, camera, "paint it over the picture itself")
    return MaskView(own, rgb.mean(axis=2), known)


def open_with_camera(file: Path, camera: Camera, cure: str) -> tuple[Array, Array, Camera]:
    """RGB [h, w, 3] and alpha [h, w] of a picture, and its camera in the size of the picture.

    Raises:
        SceneError: if it cannot be read, or differs in aspect from its camera; then with this cure.
    """
    image = read_image(file)
    height, width, _ = image.shape
    rgb, known = split_alpha(image)
    ratio = (width / height) / (camera.width / camera.height)
    if not abs(ratio - 1) <= SAME_SHAPE:
        size = f"{width}x{height}, its camera {camera.width}x{camera.height}"
        raise SceneError(file, f"has other sides than its camera: {size}; {cure}")
    return rgb, np.ones((height, width)) if known is None else known, _of_size(camera, width, height)


def _of_size(camera: Camera, width: int, height: int) -> Camera:
    """The same view in another picture size."""
    K = camera.K.copy()
    K[0] *= width / camera.width
    K[1] *= height / camera.height
    return replace(camera, K=np.asarray(K), width=width, height=height)
