"""Which files a scene lies in: those named, and in place of a folder the scenes in it."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.files import is_dir, is_plain
from brushgs.io.formats import in_words, suffixes_of
from brushgs.io.scenes.formats import SCENE_FORMATS
from brushgs.io.scenes.identify import match_format

_DEEP, _FAR = 3, 1000  # folders and entries in which a scene is searched, for the cure in a message
_OWN_SUFFIXES = {
    suffix for suffix in suffixes_of(SCENE_FORMATS) if suffix != ".json"
}  # of nothing but scenes
_FEWEST_FRAMES = 3
# Last words before the number, in names of files that hold the moments of a moving scene.
_WORDS_OF_FRAMES = {"", "f", "frame", "t", "time", "timestep"}


def find_parts(paths: Iterable[Path]) -> list[Path]:
    """The files and folders that are each of a scene format, in order.

    A folder that is a scene of itself, as those of .sog are, stands for itself. Any other stands for the
    scenes directly in it, by name: numbers by value, so that tile_10 follows tile_9. Hidden files and
    those that neither are scenes nor called so are passed over.

    Raises:
        SceneError: if a folder holds no scene; says what was looked for. Files are not checked here.
    """
    return [part for path in paths for part in _parts_of(path)]


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sorts names with the numbers in them by value, whatever the case; equal ones by character."""
    pieces = re.split("([0-9]+)", name)
    return [int(piece) if index % 2 else piece.casefold() for index, piece in enumerate(pieces)], name


def are_frames(parts: Sequence[Path]) -> bool:
    """Whether names such as frame_000, frame_001, ... suggest the moments of a moving scene."""
    found = [re.fullmatch("(.*?)([0-9]+)", part.name.split(".")[0]) for part in parts]
    if len(found) < _FEWEST_FRAMES or None in found:
        return False
    prefixes = {match[1] for match in found if match}
    numbers = [int(match[2]) for match in found if match]
    word = re.split("[^a-z]+", prefixes.pop().lower().rstrip("_- "))[-1]
    is_consecutive = numbers == list(range(numbers[0], numbers[0] + len(numbers)))
    return not prefixes and is_consecutive and word in _WORDS_OF_FRAMES


def _parts_of(path: Path) -> list[Path]:
    if not is_dir(path) or match_format(path) is not None:
        return [path]
    entries = _entries(path)
    parts = [entry for entry in entries if _is_part(entry)]
    if not parts:
        raise SceneError(path, _nothing_found(path, entries))
    return parts


def _is_part(entry: Path) -> bool:
    """Whether an entry of a folder is a scene, or called one: an empty tile is refused, not passed over."""
    if is_dir(entry):
        return match_format(entry) is not None
    return is_plain(entry) and (entry.suffix.lower() in _OWN_SUFFIXES or match_format(entry) is not None)


def _entries(folder: Path) -> list[Path]:
    """What lies in a folder and is not hidden, in natural order."""
    try:
        entries = [entry for entry in folder.iterdir() if not entry.name.startswith(".")]
    except OSError as error:
        raise SceneError(folder, f"cannot be read ({error.strerror}); check its permissions") from None
    return sorted(entries, key=lambda entry: natural_key(entry.name))


def _nothing_found(path: Path, entries: Sequence[Path]) -> str:
    """One clause: what was looked for, and the cure."""
    looked_for = in_words(suffixes_of(SCENE_FORMATS))
    found = f"none of the {len(entries)} entries of the folder is" if entries else "is an empty folder:"
    deeper = _scene_below(path)
    cure = "name the scene file" if deeper is None else f"did you mean {deeper}?"
    rule = f"{found} {looked_for}" if entries else f"{found} it should hold {looked_for}"
    return f"{rule}; {cure}"


def _scene_below(path: Path) -> Path | None:
    """The last file by name in the folders below that is called like a scene, as trainers nest them."""
    found: list[Path] = []
    num_seen = 0
    for folder, folders, files in os.walk(path):
        num_seen += len(folders) + len(files)
        if len(Path(folder).relative_to(path).parts) >= _DEEP or num_seen > _FAR:
            folders.clear()
        suffixes = suffixes_of(SCENE_FORMATS)
        found += [Path(folder, name) for name in files if Path(name).suffix.lower() in suffixes]
    return max(found, key=lambda file: natural_key(str(file)), default=None)
