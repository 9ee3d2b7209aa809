"""Where a scene comes from: one value that all commands, and all functions that read a scene, hand on."""

import glob
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path

from brushgs.options.moment import Moment

_INNER_SUFFIXES = ".compressed", ".ftgs"  # before .ply: of the layout, not of the name
_INDEXES = (
    "meta.json",
    "lod-meta.json",
)  # files that list those of a scene: it bears the name of their folder


@dataclass(frozen=True)
class SceneSource:
    """One scene, in one file, a folder or several of them.

    Attributes:
        paths: files and folders, whose Gaussians are joined in this order, or which are the moments of a
            moving scene; also patterns such as frames/*.ply, see `expand`.
        lod: level of detail of a scene that has several, from 0, the finest; None for the default of its
            format.
        time: the moment of a moving scene; None where the user names none: readers of one moment take the
            first.
        moments_per_second: rate of numbered files that are the moments of a moving scene, above 0; None for
            24. Other scenes have none.
        memory: bytes that making strokes of it may take: larger scenes are read in blocks and merged; None
            for three quarters of what the machine has.
        seeks_cameras: whether cameras that lie beside it tell how it is seen, see `camera_folders`.

    Raises:
        ValueError: if there is no path, the level is below 0, or the rate or the memory is not above it.
    """

    paths: tuple[Path, ...]
    lod: int | None = None
    time: Moment | None = None
    moments_per_second: float | None = None
    memory: int | None = None
    seeks_cameras: bool = True

    def __post_init__(self) -> None:
        if not self.paths:
            raise ValueError("scene must name at least one file, got none")
        if self.lod is not None and self.lod < 0:
            raise ValueError(f"lod must be 0 or more, got {self.lod}")
        if self.moments_per_second is not None and not 0 < self.moments_per_second < inf:
            raise ValueError(f"moments-per-second must be above 0, got {self.moments_per_second:g}")
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
        return replace(scene, lod=lod, moments_per_second=rate)

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
