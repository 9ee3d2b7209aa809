"""Which files a scene lies in: those named, and in place of a folder the scenes in it."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.files import is_dir
from brushgs.formats.registry import SCENE_FORMATS, suffixes_of
from brushgs.formats.scenes.identify import match_format
from brushgs.options.scene_source import expand
from brushgs.options.table import listed

_DEEP, _FAR = 3, 1000  # folders and entries in which a scene is searched, for the cure in a message
_OWN_SUFFIXES = {s for s in suffixes_of(SCENE_FORMATS) if s != ".json"}  # of nothing but scenes


def find_parts(paths: Iterable[Path]) -> list[Path]:
    """The files and folders that are each of a scene format, in order.

    A pattern such as tiles/*.ply stands for what matches it, by name, see `expand`. A folder that is a scene
    of itself, as those of .sog are, stands for itself. Any other stands for the scenes directly in it, by
    name: numbers by value, so that tile_10 follows tile_9. Hidden files and those that neither are scenes nor
    called so are passed over.

    Raises:
        SceneError: if a folder holds no scene; says what was looked for. Files are not checked here.
    """
    found = (sorted(expand(path), key=lambda entry: natural_key(str(entry))) for path in paths)
    return [part for expanded in found for path in expanded for part in _parts_of(path)]


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sorts names with the numbers in them by value, whatever the case; equal ones by character."""
    pieces = re.split("([0-9]+)", name)
    return [int(piece) if index % 2 else piece.casefold() for index, piece in enumerate(pieces)], name


def _parts_of(path: Path) -> list[Path]:
    if not is_dir(path) or match_format(path) is not None:
        return [path]
    entries = _entries(path)
    parts = [Path(entry) for entry in entries if _is_part(entry)]
    if not parts:
        raise SceneError(path, _nothing_found(path, entries))
    return parts


def _is_part(entry: "os.DirEntry[str]") -> bool:
    """Whether an entry of a folder is a scene, or called one: an empty tile is refused, not passed over."""
    try:
        if entry.is_dir():
            return match_format(Path(entry)) is not None
        if not entry.is_file():  # also links to what is not there
            return False
    except OSError:
        return False
    suffix = f".{entry.name.rpartition('.')[2].lower()}"
    return suffix in _OWN_SUFFIXES or match_format(Path(entry)) is not None


def _entries(folder: Path) -> "list[os.DirEntry[str]]":
    """What lies in a folder and is not hidden, in natural order.

    Entries of a folder know what they are: 100,000 frames are not asked one by one.
    """
    try:
        with os.scandir(folder) as listed:
            entries = [entry for entry in listed if not entry.name.startswith(".")]
    except OSError as error:
        raise SceneError(folder, f"cannot be read ({error.strerror}); check its permissions") from None
    return sorted(entries, key=lambda entry: natural_key(entry.name))


def _nothing_found(path: Path, entries: "Sequence[os.DirEntry[str]]") -> str:
    """One clause: what was looked for, and the cure."""
    looked_for = listed(suffixes_of(SCENE_FORMATS))
    found = f"none of the {len(entries)} entries of the folder is" if entries else "is an empty folder:"
    deeper = _scene_below(path)
    cure = "name the scene file" if deeper is None else f"did you mean {deeper}?"
    rule = f"{found} {looked_for}" if entries else f"{found} it should hold {looked_for}"
    return f"{rule}; {cure}"


def _scene_below(path: Path) -> Path | None:
    """The last file by name in the folders below that is a scene by its content, as trainers nest them."""
    found: list[Path] = []
    num_seen = 0
    for folder, folders, files in os.walk(path):
        num_seen += len(folders) + len(files)
        if len(Path(folder).relative_to(path).parts) >= _DEEP or num_seen > _FAR:
            folders.clear()
        suffixes = suffixes_of(SCENE_FORMATS)
        found += [Path(folder, name) for name in files if Path(name).suffix.lower() in suffixes]
    found.sort(key=lambda file: natural_key(str(file)), reverse=True)
    return next((file for file in found if match_format(file) is not None), None)
