"""The scenes that the page may open: the first, those beside it, and dropped ones."""

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from types import MappingProxyType
from typing import IO

from brushgs.options.scene_source import SceneSource

MAX_DROPPED = 8  # scenes that are kept until the end


@dataclass(frozen=True)
class Opened:
    """A scene that can be opened.

    Attributes:
        name: for people.
        source: its files.
        folder: that was made for it, if it was dropped.
    """

    name: str
    source: SceneSource
    folder: Path | None = None


class Scenes:
    """The scenes by id; dropped ones are files in a folder. One thread at a time may add.

    Args:
        first: that is open.
        others: files and folders that are scenes.
        folder: for dropped scenes.
    """

    def __init__(self, first: SceneSource, others: Sequence[Path], folder: Path) -> None:
        self._folder = folder
        sources = [first, *(SceneSource.of(path) for path in others if (path,) != first.paths)]
        self._known = {token_hex(8): Opened(_shown(source), source) for source in sources}

    @property
    def known(self) -> Mapping[str, Opened]:
        """The scenes, the first one first."""
        return MappingProxyType(self._known)

    def add(self, name: str, content: IO[bytes]) -> str:
        """Store a dropped scene; returns its id.

        Raises:
            ValueError: if it is no scene, by its header, or there are too many.
        """
        if sum(one.folder is not None for one in self._known.values()) >= MAX_DROPPED:
            raise ValueError(f"at most {MAX_DROPPED} scenes can be dropped; start the viewer again")
        key = token_hex(8)
        folder = self._folder / key
        folder.mkdir()
        path = folder / plain_name(name)
        source = SceneSource((path,), seeks_cameras=False)
        try:
            with path.open("wb") as file:
                shutil.copyfileobj(content, file)
            _check(source)
        except (OSError, ValueError) as error:
            shutil.rmtree(folder)
            raise ValueError(f"{name}: {str(error).removeprefix(f'{path}: ')}") from None
        # A new dictionary: other threads may be reading the old one.
        self._known = {**self._known, key: Opened(name, source, folder)}
        return key

    def hide(self, sentence: str) -> str:
        """A sentence with the names of dropped scenes in place of their paths."""
        for one in self._known.values():
            if one.folder is not None:
                sentence = sentence.replace(str(one.source.paths[0]), one.name)
        return sentence


def _check(source: SceneSource) -> None:
    """Read the header of a scene. Raises SceneError if it is none."""
    from brushgs.formats.moving import open_moving
    from brushgs.formats.scenes.read import open_files

    if open_moving(source) is None:
        open_files(source, source.lod)


def _shown(source: SceneSource) -> str:
    return source.paths[0].name if len(source.paths) == 1 else source.name


def plain_name(name: str) -> str:
    """A safe file name with the suffixes of a name that the page gave: formats may depend on them."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", name)[-60:].lstrip(".-") or "dropped"
