"""Where a scene comes from: one value that all commands, and all functions that read a scene, hand on."""

import glob
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, ClassVar

import msgspec

from brushgs.options.choices import MOMENTS_PER_SECOND
from brushgs.options.memory_size import parse_memory
from brushgs.options.moment import Moment, moment_value
from brushgs.options.table import OF_SCENE_FILES, Options, option

_INNER_SUFFIXES = ".compressed", ".ftgs"  # before .ply: of the layout, not of the name
_INDEXES = (
    "meta.json",
    "lod-meta.json",
)  # files that list those of a scene: it bears the name of their folder


class SceneSource(Options, frozen=True):
    """One scene, in one file, a folder or several of them.

    Its `paths` are files and folders, whose Gaussians are joined in this order, or which are the moments of
    a moving scene; also patterns such as frames/*.ply, see `expand`. A `time` of None is where the user
    names none: readers of one moment take the first. `memory` is in bytes. `seeks_cameras` tells whether
    cameras that lie beside the scene tell how it is seen, see `camera_folders`.

    Raises:
        ValueError: if there is no path, the level is below 0, or the rate or the memory is not above it.
    """

    paths: tuple[Path, ...]
    NOT_IN_MEMORY: ClassVar = OF_SCENE_FILES
    # fmt: off
    lod: Annotated[int | None, option("level of detail of a scene that has several; 0 is the finest", ge=0,
        default="chosen by its size")] = None
    time: Annotated[Moment | None, option("moment of a moving scene, in seconds or as a share of its "
        "duration such as 40%; 'all' takes numbered files for one scene at rest #frame #moment",
        default="the first moment", metavar="S|PERCENT|all", read=Moment.parse, make=moment_value)] = None
    moments_per_second: Annotated[float | None, option("rate of numbered files that are the moments of a "
        "moving scene; each is seen for 1/RATE of a second; other scenes have none", gt=0,
        default=f"{MOMENTS_PER_SECOND:g}")] = None
    memory: Annotated[int | None, option("memory that strokes may be made in, such as 8GB: a scene that "
        "takes more is read in blocks and neighbours of one size and colour are merged as they come #ram "
        "#large", default="3/4 of the machine's", metavar="SIZE", read=parse_memory)] = None
    # fmt: on
    seeks_cameras: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.paths:
            raise ValueError("scene must name at least one file, got none")
        if self.memory is not None and self.memory < 1:
            raise ValueError(f"memory must be above 0 bytes, got {self.memory}")

    @classmethod
    def of(
        cls, scene: "SceneFiles", *, lod: int | None = None, moments_per_second: float | None = None
    ) -> "SceneSource":
        """The source that one path, several or a source stand for; None keeps what a source says."""
        if not isinstance(scene, SceneSource):
            paths = (scene,) if isinstance(scene, (str, Path)) else scene
            return cls(tuple(map(Path, paths)), lod, moments_per_second=moments_per_second)
        lod = scene.lod if lod is None else lod
        rate = scene.moments_per_second if moments_per_second is None else moments_per_second
        return msgspec.structs.replace(scene, lod=lod, moments_per_second=rate)

    @property
    def name(self) -> str:
        """What outputs are called after: "koala" for koala.compressed.ply, "tiles" for tiles/meta.json.

        Several are called after the first: "koala+2" with two more.
        """
        first, more = self.paths[0], len(self.paths) - 1
        return _name_of(first) + (f"+{more}" if more else "")

    def files(self) -> tuple[Path, ...]:
        """The paths, and what lies in those that are folders: all that an output must not replace."""
        paths = [path for pattern in self.paths for path in expand(pattern)]
        return (*paths, *(file for path in paths for file in _files_in(path)))

    def camera_folders(self) -> tuple[Path, ...]:
        """Where cameras of the scene may lie: its folders, where it is one, those of its files, those above.

        Empty where cameras are not sought.
        """
        if not self.seeks_cameras:
            return ()
        files = [Path(os.path.abspath(path)) for path in self.paths]  # noqa: PTH100  resolve follows links
        own = [path for path in files if os.path.isdir(path)]  # noqa: PTH112  also of names that no file has
        beside = [path.parent for path in files]
        above = [path.parent for path in beside if path not in own]
        return tuple(dict.fromkeys([*own, *beside, *above]))

    def __str__(self) -> str:
        return " ".join(map(str, self.paths))


# What functions take for a scene: a file or folder, several of them, or a source.
SceneFiles = SceneSource | str | Path | Sequence[str | Path]


def expand(path: Path) -> tuple[Path, ...]:
    """The files and folders that a path stands for: itself, or what matches it if it is a pattern.

    A pattern has a *, ? or [ ], and nothing has it for a name. Shells expand patterns, but only up to some
    thousands of files, and not where they are quoted. Hidden files do not match.
    """
    if not _is_pattern(path):
        return (path,)
    found = sorted(glob.iglob(str(path)))  # noqa: PTH207  that of Path finds hidden files too
    return tuple(map(Path, found)) or (path,)


def _is_pattern(path: Path) -> bool:
    text = str(path)
    return glob.has_magic(text) and "\0" not in text and not os.path.lexists(text)


def _files_in(folder: Path) -> list[Path]:
    """What lies in a folder; nothing if it is none, or may not be read, which reading the scene will say."""
    try:
        return sorted(folder.iterdir())
    except (OSError, ValueError):
        return []


def _name_of(path: Path) -> str:
    if glob.has_magic(path.name) and _is_pattern(path):  # what stands before the pattern, or the folder
        before = re.split(r"[*?[]", path.name)[0].rstrip("_-. ")
        if before:
            return before
        path = path.absolute().parent
    elif path.name.lower() in _INDEXES:
        path = path.absolute().parent
    elif not path.is_dir():
        inner = Path(path.stem)
        return inner.stem if inner.suffix.lower() in _INNER_SUFFIXES else inner.name
    return path.name if path.name not in ("", "..") else path.resolve().name
