"""Find the format of a file, and list formats in a sentence.

Other packages add formats by entry points of the group `brushgs.formats`, each a `Format` or a tuple of them;
see `examples/format_plugin`. They are tried if no format of our own table matches.
"""

import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, get_args

from brushgs.errors import SceneWarning
from brushgs.formats.format import Format, Function, Kind
from brushgs.formats.table import FORMATS, VIDEO_CODECS
from brushgs.options.page import QUAD_SUFFIXES
from brushgs.options.table import listed

GROUP = "brushgs.formats"  # of entry points


def formats_of(kind: Kind, *, is_read: bool = False, is_written: bool = False) -> tuple[Format, ...]:
    """The formats of our table of one kind; if `is_written`, only written ones with the suffixes written."""
    rows = (row for row in FORMATS if row.kind == kind)
    if is_written:
        rows = (row._replace(suffixes=row.written or row.suffixes) for row in rows if row.write)
    return tuple(row for row in rows if row.read is not None or not is_read)


def suffixes_of(formats: Iterable[Format]) -> tuple[str, ...]:
    """All suffixes of the formats, in order."""
    return tuple(suffix for row in formats for suffix in row.suffixes)


def by_suffix(formats: Iterable[Format], path: str | Path) -> Format | None:
    """The format with the longest suffix that the file name ends with; None if there is none."""
    name = Path(path).name.lower()
    found = [(len(s), row) for row in formats for s in row.suffixes if name.endswith(s) and name != s]
    return max(found, key=lambda pair: pair[0])[1] if found else None


def find_read(kind: Kind, path: Path, begin: bytes) -> Format | None:
    """The readable format that matches a path with these first bytes; None if there is none."""
    own = next((row for row in _READ[kind] if row.matches(path, begin)), None)
    others = (row for row in added(kind) if row.read is not None) if own is None else ()
    return own or next((row for row in others if row.matches(path, begin)), None)


def find_written(kind: Kind, path: str | Path) -> Format | None:
    """The format to write a file in, by suffix; None if no format has it.

    If the name ends with several suffixes, the longest decides: ".compressed.ply" before ".ply".
    """
    own = by_suffix(_WRITTEN[kind], path)
    if own is not None or any(by_suffix(rows, path) for rows in _WRITTEN.values()):
        return own
    return by_suffix((row for row in added(kind) if row.write), path)


def function_of(reference: Function) -> Callable[..., Any]:
    """The function that reads or writes a format; a reference "module:function" is imported."""
    if callable(reference):
        return reference
    assert reference, "the caller knows that there is one"
    module, _, name = reference.partition(":")
    found: Callable[..., Any] = getattr(import_module(f"brushgs.formats.{module}"), name)
    return found


def is_written(path: Path, suffixes: tuple[str, ...]) -> bool:
    """Whether a file has one of these suffixes, or one that another package adds to the same kind."""
    if path.suffix.lower() in suffixes:
        return True
    kinds: tuple[Kind, ...] = ("scene", "picture")
    return any(suffixes_of(_WRITTEN[kind]) == suffixes and find_written(kind, path) for kind in kinds)


def format_lines() -> Iterator[str]:
    """Yield the lines of a table of formats: kind, whether read or written, suffixes, name and note."""
    for kind in get_args(Kind):
        for row in (*formats_of(kind), *added(kind)):
            done = [word for word, way in (("read", row.read), ("written", row.write)) if way is not None]
            does = ", ".join(done) or "refused"
            note = row.note or " or ".join(VIDEO_CODECS[name].name for name in row.codecs)
            about = f"{row.name}: {note}" if note else row.name
            yield f"{kind:8}{does:15}{' '.join(row.suffixes) or '(folder)':28}{about}"


def added(kind: Kind) -> tuple[Format, ...]:
    """The formats of one kind that other packages add."""
    return tuple(row for row in _plugged() if row.kind == kind)


@cache
def _plugged() -> tuple[Format, ...]:
    """All formats of other packages; a SceneWarning names an entry point that cannot be used."""
    from importlib.metadata import entry_points  # takes as long as printing the help: imported only if needed

    rows: list[Format] = []
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.name):
        try:
            found = point.load()
            given = (found,) if isinstance(found, Format) else tuple(found)
            if fault := next((fault for row in given if (fault := _fault(row))), None):
                raise TypeError(fault)
        except Exception as error:
            why = str(error).splitlines()[0] if str(error) else type(error).__name__
            message = f"entry point {point.name!r} of {GROUP} cannot be used ({why}); update its package"
            warnings.warn(SceneWarning(message), stacklevel=2)
        else:
            rows += given
    return tuple(rows)


def _fault(row: object) -> str | None:
    """Why a format of another package cannot be used; None if it can."""
    if not isinstance(row, Format):
        return f"it must be a Format, got {type(row).__name__}"
    if row.kind not in get_args(Kind):
        return f"the kind of {row.name!r} must be {listed(get_args(Kind), 'or')}, got {row.kind!r}"
    if not all(s.startswith(".") and s == s.lower() for s in row.suffixes):
        return f"the suffixes of {row.name!r} must begin with a dot, in lower case"
    return None


_READ = {kind: formats_of(kind, is_read=True) for kind in get_args(Kind)}
_WRITTEN = {kind: formats_of(kind, is_written=True) for kind in get_args(Kind)}
SCENE_FORMATS, MOVING_FORMATS, PICTURE_FORMATS = _READ["scene"], _READ["clip"], _READ["picture"]
SCENE_SUFFIXES = suffixes_of(_WRITTEN["scene"])  # suffixes that a scene can be written to
# Suffixes that strokes are exported to as Gaussians; a .glb holds them as textured rectangles.
STROKE_SUFFIXES = tuple(suffix for suffix in SCENE_SUFFIXES if suffix not in QUAD_SUFFIXES)
PICTURE_SUFFIXES = suffixes_of(_WRITTEN["picture"])
DRAWING_SUFFIXES = suffixes_of(_WRITTEN["drawing"])  # of strokes as paths
LAYERED_SUFFIXES = suffixes_of(_WRITTEN["layered"])  # of layers for painting programs
VIDEO_FORMATS = _WRITTEN["video"]
VIDEO_SUFFIXES = suffixes_of(VIDEO_FORMATS)
# Camera files that trainers and captures put beside a scene: JSON files, and the folder of a COLMAP model.
FILES_BESIDE, MODEL_BESIDE = ("cameras.json", "transforms.json", "transforms_train.json"), "sparse/0"
BESIDE_READ = listed([*FILES_BESIDE, MODEL_BESIDE])
# Lists for help and error texts, such as ".ply (as 3DGS trainers write it, ...)" and ".mp4 (H.264 ...)".
SCENES_READ = listed([f"{row.suffixes[0]} ({row.note})" for row in SCENE_FORMATS])
MOVING_READ = listed([row.note for row in MOVING_FORMATS])
CAMERAS_READ = listed([row.name for row in _READ["camera"]])
GUIDES_READ = listed([f"{row.name} ({', '.join(row.suffixes)})" for row in _READ["guides"]])
PICTURES_READ = listed([row.name for row in PICTURE_FORMATS])
PICTURES_WRITTEN = listed([f"{row.suffixes[0]} ({row.note})" for row in _WRITTEN["picture"]])
_CODECS = {row.suffixes[0]: [VIDEO_CODECS[name].name for name in row.codecs] for row in VIDEO_FORMATS}
VIDEOS_WRITTEN = listed([f"{suffix} ({listed(names)})" for suffix, names in _CODECS.items()])


def takes_strips(path: str | Path) -> bool:
    """Whether a picture with this suffix is written a few rows at a time."""
    return bool(getattr(find_written("picture", path), "takes_strips", False))


def holds_depth(path: str | Path) -> bool:
    """Whether a picture with this suffix holds the depth of the frame."""
    return bool(getattr(find_written("picture", path), "holds_depth", False))


def is_drawing(path: str | Path) -> bool:
    """Whether a file with this suffix holds strokes as vector paths."""
    return find_written("drawing", path) is not None


def is_layered(path: str | Path) -> bool:
    """Whether a file with this suffix holds a painting as layers for painting programs."""
    return find_written("layered", path) is not None


def holds_alpha(path: str | Path) -> bool:
    """Whether a picture with this suffix holds the transparency of the frame."""
    return bool(getattr(find_written("picture", path), "holds_alpha", False))
