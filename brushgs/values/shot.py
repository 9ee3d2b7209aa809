"""What is known of a picture beside its pixels.

OpenEXR holds all of it; `brushgs.formats.pictures.metadata` says what the other formats hold.
"""

import re
from dataclasses import dataclass
from pathlib import PurePath
from typing import Literal

from brushgs.values.camera import Camera
from brushgs.values.part import Part

_FOLDERS = re.compile(r"[^,:()=]*[/\\]")  # of a file within a value such as mask:shots/a.png


def without_folders(word: str) -> str:
    """A word of a command line with its files by their names alone."""
    return _FOLDERS.sub("", word.rstrip("/\\")) or "."


@dataclass(frozen=True)
class Origin:
    """How a picture came about."""

    # that painted it, such as "brushgs render truck.splat --look ink": options that are not the usual ones,
    # files by their names, without folders
    command: str
    inputs: str = ""  # a digest of the files that it names


@dataclass(frozen=True)
class Panorama:
    """How a picture lies on a sphere, and where its eyes are.

    Attributes:
        degrees: width of the picture of one eye: 360, 180, or None for a perspective picture.
        eyes: None for one; "side": the left one left; "top": the left one above.
    """

    degrees: Literal[360, 180] | None = None
    eyes: Literal["side", "top"] | None = None

    @property
    def is_photo_sphere(self) -> bool:
        """Whether the tags of pictures can say what it is: these know one eye."""
        return self.degrees == 360 and self.eyes is None


@dataclass(frozen=True, eq=False)
class Shot:
    """Where a picture stands in a film, and how it was seen. What is None is not known and not written.

    Raises:
        ValueError: if `fps` is not above 0.
    """

    camera: Camera | None = None  # that sees the picture
    number: int | None = None  # of the frame, as in the name of its file
    fps: float | None = None  # frames a second
    # the file with the names of the strokes of all frames (`write_manifest`), as it is named from the folder
    # of the picture; None where the names stand in the picture itself
    manifest: PurePath | None = None
    # how it was painted, which its metadata say; see `brushgs.formats.pictures.metadata`
    origin: Origin | None = None
    dpi: float | None = None  # pixels per inch on paper
    part: Part | None = None  # the part of the view of the camera that the picture is
    panorama: Panorama | None = None  # of a sphere or of two eyes

    def __post_init__(self) -> None:
        if self.fps is not None and not 0 < self.fps < float("inf"):
            raise ValueError(f"Shot: fps must be > 0, got {self.fps}")
