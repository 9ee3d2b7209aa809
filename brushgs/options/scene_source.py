"""The source of a scene: one value that all commands and reading functions pass on."""

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

_INNER_SUFFIXES = ".compressed", ".ftgs"  # before .ply: part of the format, not of the name
_INDEXES = (
    "meta.json",
    "lod-meta.json",
)  # index files of a scene that is named after its folder


class SceneSource(Options, frozen=True):
    """One scene, in one file, a folder or several of them.

    `paths` are files, folders or patterns such as frames/*.ply (see `expand`): parts that are joined in this
    order, or moments of a moving scene. Without a `time`, readers of one moment take the first. `memory` is
    in bytes. With `seeks_cameras`, camera files beside the scene decide its view, see `camera_folders`.

    Raises:
        ValueError: if there is no path, `lod` is negative, or rate or memory is not positive.
    """

    paths: tuple[Path, ...]
    NOT_IN_MEMORY: ClassVar = OF_SCENE_FILES
    # fmt: off
    lod: Annotated[int | None, option("level of detail, for scenes with several; 0 is the finest", ge=0,
        default="chosen by its size")] = None
    time: Annotated[Moment | None, option("moment of a moving scene, in seconds or as a share of its "
        "duration such as 40%; 'all' joins numbered files to one still scene #frame #moment",
        default="the first moment", metavar="S|PERCENT|all", read=Moment.parse, make=moment_value)] = None
    moments_per_second: Annotated[float | None, option("rate of a moving scene in numbered files, one per "
        "moment", gt=0,
        default=f"{MOMENTS_PER_SECOND:g}")] = None
    memory: Annotated[int | None, option("memory limit for making strokes, such as 8GB; larger scenes are "
        "read in blocks, merging neighbors of similar size and color #ram #large",
        default="3/4 of the machine's", metavar="SIZE", read=parse_memory)] = None
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
        """A source from one path, several, or a source; None keeps the source's own values."""
        if not isinstance(scene, SceneSource):
            paths = (scene,) if isinstance(scene, (str, Path)) else scene
            return cls(tuple(map(Path, paths)), lod, moments_per_second=moments_per_second)
        lod = scene.lod if lod is None else lod
        rate = scene.moments_per_second if moments_per_second is None else moments_per_second
        return msgspec.structs.replace(scene, lod=lod, moments_per_second=rate)

    @property
    def name(self) -> str:
        """Base name of outputs: "koala" for koala.compressed.ply, "tiles" for tiles/meta.json.

        Several paths are named after the first: "koala+2" for two more.
        """
        first, more = self.paths[0], len(self.paths) - 1
        return _name_of(first) + (f"+{more}" if more else "")

    def files(self) -> tuple[Path, ...]:
        """The paths and the contents of folders among them: files that outputs must not replace."""
        paths = [path for pattern in self.paths for path in expand(pattern)]
        return (*paths, *(file for path in paths for file in _files_in(path)))

    def camera_folders(self) -> tuple[Path, ...]:
        """Folders to search for cameras: the scene's own folders, then those of its files, then their
        parents.

        Empty if cameras are not sought.
        """
        if not self.seeks_cameras:
            return ()
        files = [Path(os.path.abspath(path)) for path in self.paths]  # noqa: PTH100  resolve follows links
        own = [path for path in files if os.path.isdir(path)]  # noqa: PTH112  accepts invalid names
        beside = [path.parent for path in files]
        above = [path.parent for path in beside if path not in own]
        return tuple(dict.fromkeys([*own, *beside, *above]))

    def __str__(self) -> str:
        return " ".join(map(str, self.paths))


# A scene argument: a file or folder, several of them, or a source.
SceneFiles = SceneSource | str | Path | Sequence[str | Path]


def expand(path: Path) -> tuple[Path, ...]:
    """The path itself or, if it is a pattern, its matches.

    A pattern contains *, ? or [ ] and is not the name of an existing file. Shells expand patterns too, but
    not in quotes and only up to some thousands of files. Hidden files do not match.
    """
    if not _is_pattern(path):
        return (path,)
    found = sorted(glob.iglob(str(path)))  # noqa: PTH207  that of Path finds hidden files too
    return tuple(map(Path, found)) or (path,)


def _is_pattern(path: Path) -> bool:
    text = str(path)
    return glob.has_magic(text) and "\0" not in text and not os.path.lexists(text)


def _files_in(folder: Path) -> list[Path]:
    """The contents of a folder; empty if it cannot be read (reading the scene reports that)."""
    try:
        return sorted(folder.iterdir())
    except (OSError, ValueError):
        return []


def _name_of(path: Path) -> str:
    if glob.has_magic(path.name) and _is_pattern(path):  # the text before the pattern, or the folder
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
