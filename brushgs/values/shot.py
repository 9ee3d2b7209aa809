"""Metadata of a picture.

OpenEXR stores all of it; for other formats see `brushgs.formats.pictures.metadata`.
"""

import re
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

from brushgs.values.camera import Camera
from brushgs.values.part import Part

_FOLDERS = re.compile(r"[^,:()=]*[/\\]")  # folders of a file, also within a value such as mask:shots/a.png


def without_folders(word: str) -> str:
    """A word of a command line with the folders of its files removed."""
    return _FOLDERS.sub("", word.rstrip("/\\")) or "."


@dataclass(frozen=True)
class Origin:
    """How a picture was made."""

    # the command, such as "brushgs render truck.splat --look ink": without default options, and files without
    # folders
    command: str
    inputs: str = ""  # digest of the files that it names


@dataclass(frozen=True)
class Panorama:
    """Spherical projection and stereo layout of a picture.

    Attributes:
        degrees: angle of view of the width of one eye: 360, 180, or None for a perspective picture.
        eyes: None for one eye; "side": side by side, left eye first; "top": left eye above the right.
    """

    degrees: Literal[360, 180] | None = None
    eyes: Literal["side", "top"] | None = None

    @property
    def is_photo_sphere(self) -> bool:
        """Whether Photo Sphere tags can describe it: these support a full sphere with one eye only."""
        return self.degrees == 360 and self.eyes is None


@dataclass(frozen=True, eq=False)
class Shot:
    """Metadata of a picture: its camera, origin, and place in a film. None: unknown, and not written.

    Raises:
        ValueError: if `fps` is not above 0.
    """

    camera: Camera | None = None  # of the picture
    number: int | None = None  # frame number, as in the file name
    fps: float | None = None  # frames per second
    # file with the stroke names of all frames (`write_manifest`), relative to the folder of the picture; None
    # if each picture stores its names
    manifest: PurePath | None = None
    origin: Origin | None = None  # how it was made, see `brushgs.formats.pictures.metadata`
    dpi: float | None = None  # pixels per inch on paper
    part: Part | None = None  # part of the camera's view that the picture covers; None for all
    panorama: Panorama | None = None  # of a spherical or stereo picture

    def __post_init__(self) -> None:
        if self.fps is not None and not 0 < self.fps < float("inf"):
            raise ValueError(f"Shot: fps must be > 0, got {self.fps}")
