"""Find the files of a scene and their formats, and join their notes.

The content of a file decides its format; known files that are no scenes are refused with a message that says
what they are. A folder stands for the scenes in it.
"""

import os
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import check_plain, is_dir, open_plain
from brushgs.formats.format import BYTE_ORDER_MARK, NUM_FIRST_BYTES, ZIP_BEGINNINGS, Format
from brushgs.formats.registry import SCENES_READ, find_read, formats_of, function_of, suffixes_of
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.rows import SceneFile
from brushgs.options.scene_source import expand
from brushgs.options.table import listed
from brushgs.values.gaussians import SH_TERMS
from brushgs.values.notes import LoadNotes, Training

# First bytes of files that are no scenes -> a clause that says what they are, and the cure.
_NO_SCENES = {
    b"version https://git-lfs": "is a git-LFS pointer, not the scene itself; run 'git lfs pull'",
    b"{": "is JSON, but of no SOG scene (meta.json, lod-meta.json) and no glTF model; name the scene itself",
    b"[": "is JSON, as lists of cameras are, not a scene; name the scene itself",
    b"<": "is a web page or XML, not a scene: the download went wrong; download the file itself",
}


def find_format(path: Path) -> Format:
    """The format of a scene file or of a folder that holds a scene.

    Raises:
        SceneError: if there is no such file, it may not be read, or its format is not read; the message says
            what it is, and the cure.
    """
    scene_format = match_format(path)
    if scene_format is None:
        check_plain(path, "scene file")  # refuses folders
        raise SceneError(path, _what_it_is(path, _first_bytes(path)))
    return scene_format


def match_format(path: Path) -> Format | None:
    """`find_format`, but None if the format is not read, as for a folder of scene files.

    Raises SceneError if there is no such file or it may not be read.
    """
    begin = _first_bytes(path)
    return find_read("scene", path, begin) if begin or is_dir(path) else None


def _first_bytes(path: Path) -> bytes:
    if is_dir(path):
        return b""
    with open_plain(path, "scene file", buffering=0) as file:
        return file.read(NUM_FIRST_BYTES)


def _what_it_is(path: Path, begin: bytes) -> str:
    """A clause that says what an unreadable file is, and the cure."""
    if not begin:
        return "is empty; copy or download it again"
    text = begin.removeprefix(BYTE_ORDER_MARK).lstrip()
    for first_bytes, message in _NO_SCENES.items():
        if text.startswith(first_bytes):
            return message
    if begin.startswith(ZIP_BEGINNINGS):
        from brushgs.formats.scenes.sog_meta import open_files

        with open_files(path):  # raises an error that says what the archive holds
            pass
    for known in formats_of("scene"):
        if known.matches(path, begin):
            return f"is a {known.name}, which is not read; {known.cure}"
    return f"is of no scene format that is read: it begins with {begin[:8]!r}; export it as {SCENES_READ}"


_DEEP, _FAR = 3, 1000  # levels of folders, and entries, searched for a scene to name in a message
_IN_FOLDERS = [row for row in formats_of("scene", is_read=True) if not row.is_alone]
_OWN_SUFFIXES = {s for s in suffixes_of(_IN_FOLDERS) if s != ".json"}  # suffixes used only by scenes


def find_parts(paths: Iterable[Path]) -> list[Path]:
    """The scene files and scene folders that the paths stand for, in order.

    A pattern such as tiles/*.ply stands for its matches, see `expand`. A folder that is a scene, such as an
    unpacked .sog, stands for itself. Any other folder stands for the scenes directly in it. Matches and
    entries are sorted by name with numbers by value, so that tile_10 follows tile_9. Hidden files and files
    that neither are scenes nor have the suffix of one are skipped.

    Raises:
        SceneError: if a folder holds no scene; the message says what was looked for. Files are not checked.
    """
    found = (sorted(expand(path), key=lambda entry: natural_key(str(entry))) for path in paths)
    return [part for expanded in found for path in expanded for part in _parts_of(path)]


def natural_key(name: str) -> tuple[list[str | int], str]:
    """Sort key for names: numbers by value, letters without regard to case; ties by character."""
    pieces = re.split("([0-9]+)", name)
    return [int(piece) if index % 2 else piece.casefold() for index, piece in enumerate(pieces)], name


def _parts_of(path: Path) -> list[Path]:
    if not is_dir(path) or match_format(path) is not None:
        return [path]
    entries = _entries(path)
    if parts := [Path(entry) for entry in entries if _is_part(entry)]:
        return parts
    deeper = _scene_below(path)
    cure = "name the scene file" if deeper is None else f"did you mean {deeper}?"
    found = f"none of the {len(entries)} entries of the folder is"
    found = found if entries else "is an empty folder: it should hold"
    raise SceneError(path, f"{found} {listed(suffixes_of(_IN_FOLDERS))}; {cure}")


def _is_part(entry: "os.DirEntry[str]") -> bool:
    """Whether a folder entry is a scene or has the suffix of one: an empty tile is refused, not skipped."""
    try:
        if entry.is_dir():
            return match_format(Path(entry)) is not None
        if not entry.is_file():  # false for broken links too
            return False
    except OSError:
        return False
    suffix = f".{entry.name.rpartition('.')[2].lower()}"
    if suffix in _OWN_SUFFIXES:
        return True
    found = match_format(Path(entry))
    return found is not None and not found.is_alone


def _entries(folder: Path) -> "list[os.DirEntry[str]]":
    """The entries of a folder that are not hidden, in natural order.

    `os.scandir` tells files from folders, so that 100,000 frames need no call each.
    """
    try:
        with os.scandir(folder) as listed:
            entries = [entry for entry in listed if not entry.name.startswith(".")]
    except OSError as error:
        raise SceneError(folder, f"cannot be read ({error.strerror}); check its permissions") from None
    return sorted(entries, key=lambda entry: natural_key(entry.name))


def _scene_below(path: Path) -> Path | None:
    """The last scene by name in nested folders, as trainers make them; None if there is none."""
    found: list[Path] = []
    num_seen = 0
    for folder, folders, files in os.walk(path):
        num_seen += len(folders) + len(files)
        if len(Path(folder).relative_to(path).parts) >= _DEEP or num_seen > _FAR:
            folders.clear()
        suffixes = suffixes_of(_IN_FOLDERS)
        found += [Path(folder, name) for name in files if Path(name).suffix.lower() in suffixes]
    found.sort(key=lambda file: natural_key(str(file)), reverse=True)
    return next((file for file in found if match_format(file) is not None), None)


_LONGEST_NAME = 40  # characters of a column name


def join_notes(files: Sequence[SceneFile], *, rows_dropped: int, sh_degree_used: int) -> LoadNotes:
    """The joint notes of the files of one scene.

    If files disagree, a SceneWarning says so, and what is done.
    """
    formats = list(dict.fromkeys(file.format for file in files))
    is_one = len(files) == 1
    return LoadNotes(
        format=formats[0] if is_one else f"{len(files)} files: {'; '.join(formats)}",
        rows_read=sum(file.num_rows for file in files),
        rows_dropped=rows_dropped,
        sh_degree_stored=SH_TERMS[max(file.num_terms for file in files)],
        sh_degree_used=sh_degree_used,
        up=_common_up(files),
        is_strokes=_are_strokes(files),
        training=_common_training(files),
        unknown=tuple(dict.fromkeys(_printable(name) for file in files for name in file.unknown)),
        files=() if is_one else tuple(f"{f.path.name}: {f.num_rows:,} rows, {f.format}" for f in files),
        scene=files[0].stored.scene if is_one else None,
        first_view=files[0].stored.first_view if is_one else None,
        brushes=files[0].stored.brushes if is_one else (),
        moment=files[0].moment if is_one else None,
        photograph=files[0].photograph if is_one else None,
    )


def _common_up(files: Sequence[SceneFile]) -> str | None:
    """The up axis on which all files that state one agree; None if they disagree or none states one."""
    named = {file.up: file.path.name for file in files if file.up is not None}
    if len(named) > 1:
        axes = listed([f"{up} ({name})" for up, name in named.items()], "and")
        _warn(files, f"the files name different axes as up, {axes}, and none is taken; state --up")
        return None
    return next(iter(named), None)


def _are_strokes(files: Sequence[SceneFile]) -> bool:
    """Whether all files hold strokes; warns if only some do."""
    strokes = [file.path.name for file in files if file.stored.is_strokes]
    if strokes and len(strokes) < len(files):
        what = f"{strokes[0]} holds strokes of brushgs and other files do not"
        _warn(files, f"{what}; all are painted as one scene that is no strokes yet")
    return len(strokes) == len(files)


def _common_training(files: Sequence[SceneFile]) -> Training:
    """The training of most Gaussians; the first one in a tie."""
    rows: Counter[Training] = Counter()
    for file in files:
        rows[file.training] += file.num_rows
    most = max(rows, key=lambda training: rows[training])
    if len(rows) > 1 and "antialiased" in rows:
        words = listed([f"{training} ({count:,} Gaussians)" for training, count in rows.items()], "and")
        _warn(files, f"the files were trained differently, {words}; all are drawn as {most}")
    return most


def _printable(name: str) -> str:
    """An untrusted name from a file, shortened and with unprintable characters replaced."""
    return "".join(c if c.isprintable() else "?" for c in name[:_LONGEST_NAME])


def _warn(files: Sequence[SceneFile], message: str) -> None:
    warnings.warn(SceneWarning(f"{files[0].path} and {len(files) - 1} more: {message}"), stacklevel=4)


# Limits for `warn_of_encoding`.
_MIN_ROWS = 10
_SIGMOID_OF_1 = 0.7310587
_MIN_SPREAD = 0.01  # range of opacities; scripts write equal ones, which fit either encoding
_BLINDING = 16.0  # a coefficient of 16 is five times as bright as white; trained scenes reach 12.6
_NUM_COLORS = 4096  # colors that are inspected


def open_file(path: Path, lod: int | None) -> SceneFile:
    """Read the header of one scene file or scene folder.

    Raises:
        NoGaussiansError: if it is valid but holds no Gaussians.
        SceneError: if its format is unknown, it is damaged, or `lod` is given for a scene without levels.
    """
    scene_format = find_format(path)
    open_scene = function_of(scene_format.read)
    if lod is not None and not scene_format.has_levels:
        fact = f"is a {scene_format.name}, which has no levels of detail"
        raise SceneError(path, f"{fact}; omit the level (lod)")
    file: SceneFile = open_scene(path, lod) if scene_format.has_levels else open_scene(path)
    return file


def drop_brushes(file: SceneFile, columns: Columns) -> None:
    """Drop the brushes of strokes, with a warning, if a row has a brush beyond those that the file names."""
    num_named = len(file.stored.brushes)
    if columns.brushes is None or not num_named:
        return
    if (row := int(columns.brushes.max(initial=0))) >= num_named:
        columns.brushes = None
        message = f"strokes have brush {row} and the header names {num_named}; brushes are dropped"
        warnings.warn(SceneWarning(f"{file.path}: {message}"), stacklevel=3)


def warn_of_encoding(path: Path, columns: Columns) -> None:
    """Warn if the numbers of a file are certainly not in the standard layout.

    A linear scale decoded as a log is at least 1; a linear opacity decoded as a logit is 0.5 to 0.7311. No
    trained scene has all of its rows in these ranges; a few rows made by hand may. Colors of 0 to 255
    decoded as coefficients are far too bright. The smallest and largest opacity, the smallest scale and some
    colors are inspected, which takes 1 % of the loading time.
    """
    if len(columns.means) < _MIN_ROWS:
        return
    suspects = []
    low, high = columns.opacities.min(), columns.opacities.max()
    if low >= 0.5 and high <= _SIGMOID_OF_1:
        are_scales_linear = columns.scales.min() >= 1
        if are_scales_linear or high - low > _MIN_SPREAD:
            suspects.append("scales and opacities" if are_scales_linear else "opacities")
    colors = columns.sh[:_NUM_COLORS, 0]
    if colors.min() >= 0 and colors.max() > _BLINDING:
        suspects.append("colors")
    if suspects:
        message = f"{' and '.join(suspects)} seem to be stored in another encoding, which paints a fog"
        cure = f"'brushgs doctor {path} --fix cured.ply' converts them"
        warnings.warn(SceneWarning(f"{path}: {message}; {cure}"), stacklevel=3)
