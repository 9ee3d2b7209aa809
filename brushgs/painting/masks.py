"""Painted masks from files, each with the camera that its picture was made with."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from brushgs.colors import split_alpha
from brushgs.errors import SceneError
from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.read import read_cameras
from brushgs.io.formats import suffixes_of
from brushgs.io.pictures.formats import PICTURE_FORMATS, PICTURES_READ
from brushgs.io.pictures.images import read_image
from brushgs.passes.where.masks import MaskView
from brushgs.scene import Camera

SUFFIXES = suffixes_of(PICTURE_FORMATS)
SAME_SHAPE = 0.02  # by which the sides of a mask and of its camera may differ in ratio


@dataclass(frozen=True)
class MaskOpener:
    """Opens masks with the cameras of a file.

    Attributes:
        camera_file: in any format of `brushgs.io.cameras.formats`.
    """

    camera_file: Path

    @cached_property
    def _cameras(self) -> CameraFile:
        return read_cameras(self.camera_file)

    def __call__(self, path: Path) -> Sequence[MaskView]:
        """The masks of a picture, or of a folder of pictures: white is inside, alpha how much is known.

        A picture belongs to the camera whose picture had its name, without suffix; where no name is known,
        the pictures in the order of their names to the cameras in theirs.

        Raises:
            SceneError: if there is no picture, one cannot be read, or has no camera.
        """
        files = _pictures(path)
        cameras = self._cameras_of(path, files)
        return [_mask(file, camera) for file, camera in zip(files, cameras, strict=True)]

    def _cameras_of(self, path: Path, files: list[Path]) -> list[Camera]:
        cameras, name = self._cameras.cameras, self.camera_file.name
        by_name = dict(zip(map(_stem, self._cameras.names), cameras, strict=False))
        found = [by_name.get(_stem(file.name)) for file in files]
        if all(camera is not None for camera in found):
            return [camera for camera in found if camera is not None]
        if any(camera is not None for camera in found):
            lost = files[found.index(None)]
            raise SceneError(lost, f"{name} has no camera of this name; rename the mask as its picture")
        if len(files) != len(cameras):
            cure = "name each mask as the picture of its camera, or give one camera a mask, in the same order"
            raise SceneError(
                path, f"holds {len(files)} masks for the {len(cameras)} cameras of {name}; {cure}"
            )
        return cameras


def _pictures(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    files = [file for file in path.iterdir() if file.suffix.lower() in SUFFIXES]
    files = [file for file in files if not file.name.startswith(".")]
    if not files:
        raise SceneError(path, f"holds no masks; put pictures in it: {PICTURES_READ}")
    return sorted(files, key=_order)


def _order(file: Path) -> tuple[list[tuple[int, str]], str]:
    """By name, numbers in it by their value: 2.png before 10.png."""
    words = re.findall(r"[0-9]+|[^0-9]+", file.name)
    return [(int(word), "") if word.isdigit() else (-1, word) for word in words], file.name


def _stem(name: str) -> str:
    """The name of a picture without folders and suffixes of pictures: images/7.JPG.png -> 7."""
    name = name.replace("\\", "/").rsplit("/", 1)[-1].lower()
    while (stem := Path(name)).suffix in SUFFIXES and stem.stem:
        name = stem.stem
    return name


def _mask(file: Path, camera: Camera) -> MaskView:
    image = read_image(file)
    height, width, channels = image.shape
    rgb, known = split_alpha(image.reshape(-1, channels))
    ratio = (width / height) / (camera.width / camera.height)
    if not abs(ratio - 1) <= SAME_SHAPE:
        size = f"{width}x{height}, its camera {camera.width}x{camera.height}"
        raise SceneError(file, f"has other sides than its camera: {size}; paint it over the picture itself")
    shape = height, width
    inside = rgb.mean(axis=1).reshape(shape)
    says = np.ones(shape) if known is None else known.reshape(shape)
    return MaskView(_of_size(camera, width, height), inside, says)


def _of_size(camera: Camera, width: int, height: int) -> Camera:
    """The same view in a picture of another size, which shows the same."""
    K = camera.K.copy()
    K[0] *= width / camera.width
    K[1] *= height / camera.height
    return replace(camera, K=np.asarray(K), width=width, height=height)
