"""What reading a scene found beside the Gaussians themselves."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from brushgs.values.camera import FirstView

# How the Gaussians of a scene were trained, where that changes how they are drawn: "antialiased" are those of
# Mip-Splatting and of trainers with the same opacity compensation, "2dgs" flat discs.
Training = Literal["default", "antialiased", "2dgs"]


@dataclass(frozen=True)
class LoadNotes:
    """What the files of a scene held, and what was dropped from them without changing the picture.

    Attributes:
        format: layout and encoding in words, for example "PLY, binary little-endian"; with several files
            their number, and each format once.
        rows_read: Gaussians in the files.
        rows_dropped: those dropped because they cannot be drawn (a SceneWarning said why).
        sh_degree_stored: degree of the spherical harmonics in the files, 0 to 3, the highest of them.
        sh_degree_used: degree that was loaded; lower than stored where the bands above are all zero.
        up: axis that the files name as up, "+x" to "-z"; None if they name none, or different ones.
        is_strokes: whether every file states that its Gaussians are strokes that brushgs made.
        training: how the scene was trained, as far as the files state it.
        unknown: columns or extensions of the files that were not read, by name, safe to print.
        files: each of several files in words; empty for one.
        scene: name of the scene that strokes were made of; None if the file names none, and for several.
        first_view: how that scene is seen; None if the file does not say, and for several.
        brushes: names or paths of the brushes that the strokes have rows of; none if the file names none, and
            for several.
        moment: of a moving scene the moment that was read, seconds from its start; None for a scene at rest.
        moments_per_second: of a moving scene in a file a moment, as read; None for any other.
        is_timed: whether the files of a moving scene give its length in seconds; else these are nominal.
        rows_each: how many rows one of the Gaussians was made of on average: 1, or more where a scene larger
            than memory was merged while it was read.
        camera_folders: where cameras of the scene may lie; none where they are not sought.
    """

    format: str
    rows_read: int
    rows_dropped: int
    sh_degree_stored: int
    sh_degree_used: int
    up: str | None
    is_strokes: bool = False
    training: Training = "default"
    unknown: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    scene: str | None = None
    first_view: FirstView | None = None
    brushes: tuple[str, ...] = ()
    moment: float | None = None
    moments_per_second: float | None = None
    is_timed: bool = False
    rows_each: float = 1.0
    camera_folders: tuple[Path, ...] = ()
