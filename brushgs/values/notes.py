"""Facts about a scene's files beside its Gaussians."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from brushgs.values.camera import Camera, FirstView

# Training methods that change how Gaussians are drawn: "antialiased" is Mip-Splatting and trainers with the
# same opacity compensation, "2dgs" has flat discs.
Training = Literal["default", "antialiased", "2dgs"]


@dataclass(frozen=True)
class LoadNotes:
    """Facts about the files of a scene, and what was dropped without changing the picture.

    Attributes:
        format: layout and encoding in words, such as "PLY, binary little-endian"; for several files their
            number, and each format once.
        rows_read: Gaussians in the files.
        rows_dropped: Gaussians dropped because they cannot be drawn (reported by a SceneWarning).
        sh_degree_stored: highest SH degree in the files, 0 to 3.
        sh_degree_used: degree that was loaded; lower than stored if all higher bands are zero.
        up: up axis given by the files, "+x" to "-z"; None if none is given or they differ.
        is_strokes: whether every file states that its Gaussians are strokes made by brushgs.
        training: how the scene was trained, as far as the files state it.
        unknown: names of columns or extensions that were not read, safe to print.
        files: one description per file if there are several; else empty.
        scene: name of the scene that strokes were made of; None if not stated, or for several files.
        first_view: first view of that scene; None if not stated, or for several files.
        brushes: names or paths of the brushes of the strokes; empty if not stated, or for several files.
        moment: moment of a moving scene that was read, seconds from its start; None for a still scene.
        moments_per_second: rate of a moving scene stored as one file per moment; else None.
        is_timed: whether the files give the duration of a moving scene; if not, seconds are nominal.
        rows_each: mean number of file rows per Gaussian: above 1 if a scene larger than memory was merged
            while reading.
        camera_folders: folders to search for the scene's cameras; empty if cameras are not sought.
        photograph: camera of the photograph that the scene was predicted from; None for other scenes, and for
            several files.
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
    photograph: Camera | None = None
