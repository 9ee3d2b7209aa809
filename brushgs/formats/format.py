"""What a file format is, and how its files are recognised: by bytes, name, fields, members.

Help texts read the table that is made of these: so this imports nothing heavy.
"""

import math
import os
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from brushgs.formats.files import is_dir, is_plain

NUM_FIRST_BYTES = 64  # enough to recognise a file by
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
ZIP_BEGINNINGS = b"PK\x03\x04", b"PK\x05\x06"  # the latter of an empty archive
_MAX_JSON_BYTES = 1 << 25  # searched for keys
_MAX_DIRECTORY_BYTES = 1 << 20  # at the end of a zip archive
_MAX_HEADER = 1 << 20  # bytes of a PLY header, as `ply_header` reads it
_PIECE = 1 << 14  # bytes read at a time: those of trainers have 2 KiB
_PICKLES = b"\x80\x02\x8a\nl\xfc\x9cF", b"\x80\x02}", b"\x80\x04\x95", b"\x80\x05\x95"
PICKLE_SUFFIXES = ".pth", ".pt", ".ckpt", ".pkl", ".pickle"
COLMAP_FILES = tuple(
    stem + suffix for stem in ("cameras", "images", "points3D") for suffix in (".bin", ".txt")
)
SPLAT_ROW_SIZE = 32  # position and scales as float32; red, green, blue, opacity and w, x, y, z as bytes
_ROW = struct.Struct("<6f4B4B")
_MIN_ROWS = 8  # fewer may be plausible by chance
_NUM_INSPECTED = 64  # rows, from the first to the last
_LARGEST = 1e6  # of a coordinate or a scale; scenes in metres stay far below
# Writers normalise rotations, then round them to steps of 1/128: in three files they are 0.986 to 1.015 long.
_LENGTHS = 0.95, 1.05
_KSPLAT = struct.Struct("<4s4IH")  # version, most sections, sections, most Gaussians, Gaussians, level
_KSPLAT_VERSION = b"\0\1\0\0"
_MAX_LEVEL = 2
Matcher = Callable[[Path, bytes], bool]  # (path, first bytes; none of a folder) -> whether it is of a format


def any_of(*matchers: Matcher) -> Matcher:
    """Recognises what one of several recognises."""
    return lambda path, begin: any(matches(path, begin) for matches in matchers)


Kind = Literal[
    "scene", "clip", "camera", "guides", "picture", "drawing", "layered", "video", "style", "marks"
]
Function: TypeAlias = str | Callable[..., Any] | None


class Format(NamedTuple):
    """A file format.

    Attributes:
        name: in words; of scenes and clips as a sentence has it after an article, "a PLY file".
        kind: what its files hold; "clip" is a scene that moves.
        suffixes: of its files, in lower case, the usual one first; none of a folder.
        matches: whether a path with these first bytes is of this format; a folder has no first bytes. Guides
            and styles go by their suffix, and cameras in JSON by `key`.
        read: None if it is not read. A scene: `open_scene(path) -> SceneFile`, of one that `has_levels`
            `open_scene(path, lod)`, the level or None for its default. A clip: `(path) -> MovingScene`. A
            camera: `(path, content) -> CameraFile`, the content that of JSON, else None. Guides:
            `(path, content) -> Guides`. A picture: `check(path, file, max_pixels)` before OpenImageIO decodes
            it, where its decoder takes memory before it reports the size; "" if there is no need.
        write: None if it is not written. A scene: `write_scene(gaussians, path, stored)`, which returns the
            rows in the order of the file, None where that is theirs. A picture:
            `(frame, path, background, **options)`, with `bits` where several are offered and `shot` where it
            `holds_metadata`.
        note: which files of the format are read or written, for help texts.
        cure: of what is not read, what to do instead: one clause.
        package: that decodes or encodes it and may not be installed, as it is imported; empty for none.
        written: the suffixes that are written, where these are not all.
        rounds: of scenes, whether what is written is rounded beyond float32, so that its error is worth
            telling.
        has_levels: of scenes, whether it may hold several levels of detail.
        is_alone: of scenes, whether a file is taken only by its name, not as one of the scenes in a folder.
        key: of cameras in JSON, a field that such a file has at its top, "" for a list.
        file: usual name of a file, where it is more than a suffix.
        bits: of pictures, of each channel, that may be asked for, the usual number first.
        is_linear: of pictures, whether it holds linear light; else it is display-encoded.
        holds_depth: of pictures, whether a frame's depth is written.
        holds_alpha: of pictures, whether transparency is written.
        holds_metadata: of pictures and videos, whether it says how it was painted, see `pictures.metadata`.
        takes_strips: of pictures, whether one is written a few rows at a time.
        codecs: of videos, names in `VIDEO_CODECS`, the usual one first.
        container: of videos, its name in libav.
        max_fps: of videos, frames a second.
    """

    name: str
    kind: Kind
    suffixes: tuple[str, ...]
    matches: Matcher = any_of()
    read: Function = None
    write: Function = None
    note: str = ""
    cure: str = ""
    package: str = ""
    written: tuple[str, ...] = ()
    rounds: bool = False
    has_levels: bool = False
    is_alone: bool = False
    key: str | None = None
    file: str = ""
    bits: tuple[int, ...] = (8,)
    is_linear: bool = False
    holds_depth: bool = False
    holds_alpha: bool = True
    holds_metadata: bool = True
    takes_strips: bool = False
    codecs: tuple[str, ...] = ()
    container: str = ""
    max_fps: int = 1000


class VideoCodec(NamedTuple):
    """How the pictures of a video are encoded."""

    name: str  # in words, for help and error texts
    write: str = "pictures.libav:EncodedVideo"  # `open_writer(stack, film)`, which returns a `VideoWriter`
    bits: tuple[int, ...] = (8,)  # of each channel, that may be asked for, the usual number first
    holds_alpha: bool = False  # whether transparency may be written
    min_side: int = 1  # pixels along a side, at least
    max_side: int | None = None  # at most; None if the codec has no limit that matters
    has_even_sides: bool = False  # whether width and height must be even


def begins_with(*beginnings: bytes) -> Matcher:
    """Recognises files by their first bytes, whatever they are called."""
    return lambda path, begin: begin.startswith(beginnings)


def has_suffix(*suffixes: str) -> Matcher:
    """Recognises files by their name: for formats that have no unmistakable beginning."""
    return lambda path, begin: path.suffix.lower() in suffixes


def is_json_with(*keys: str, file: str | None = None) -> Matcher:
    """Recognises JSON files by keys that occur in them at any place.

    Args:
        keys: all must occur.
        file: name of such a file; a folder that holds it is recognised too.
    """
    marks = [f'"{key}"'.encode() for key in keys]

    def matches(path: Path, begin: bytes) -> bool:
        if not begin:  # a folder
            if file is None or not is_plain(path / file):
                return False
            path = path / file
        elif not begin.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(b"{"):
            return False
        try:
            with path.open("rb") as opened:
                content = opened.read(_MAX_JSON_BYTES)
        except OSError:
            return False
        return all(mark in content for mark in marks)

    return matches


def is_zip_with(name: str, *suffixes: str) -> Matcher:
    """Recognises zip archives by their suffix, or by the name of a member.

    Args:
        name: end of the name of a member, which stands in the directory at the end of an archive.
        suffixes: with which a damaged archive is recognised too.
    """

    def matches(path: Path, begin: bytes) -> bool:
        if not begin.startswith(ZIP_BEGINNINGS):
            return False
        if path.suffix.lower() in suffixes:
            return True
        try:
            with path.open("rb") as opened:
                opened.seek(max(0, opened.seek(0, 2) - _MAX_DIRECTORY_BYTES))
                return name.encode() in opened.read()
        except OSError:
            return False

    return matches


def is_colmap(path: Path, begin: bytes) -> bool:
    """Recognises the folder of a COLMAP model, and its files by their names."""
    return path.name in COLMAP_FILES or is_dir(path)


def is_ply_with(*names: str) -> Matcher:
    """Recognises PLY files by names of properties, all of which their headers must hold."""

    def matches(path: Path, begin: bytes) -> bool:
        return begin.startswith((b"ply\n", b"ply\r")) and _properties(path).issuperset(names)

    return matches


def _properties(path: Path) -> set[str]:
    """Names of all properties in the header of a PLY file."""
    header = b""
    try:
        with path.open("rb", buffering=0) as file:
            while b"end_header" not in header and len(header) < _MAX_HEADER:
                piece = file.read(_PIECE)
                if not piece:
                    break
                header += piece
    except OSError:
        return set()
    header = header.partition(b"end_header")[0]
    return {name.decode() for name in re.findall(rb"[\r\n]property[ \t]+\w+[ \t]+(\w+)", header)}


def holds(*patterns: str) -> Matcher:
    """Recognises folders by files in them, and these files by their names.

    Args:
        patterns: of paths from the folder; one of them must be there.
    """
    names = {pattern.rpartition("/")[2] for pattern in patterns}

    def matches(path: Path, begin: bytes) -> bool:
        if not is_dir(path):
            return path.name in names
        try:
            return any(next(path.glob(pattern), None) is not None for pattern in patterns)
        except OSError:
            return False

    return matches


def is_pickle(*others: str) -> Matcher:
    """Recognises pickles, and archives that PyTorch keeps one in; none is opened as such.

    Args:
        others: suffixes of formats whose files may begin like a pickle.
    """

    def matches(path: Path, begin: bytes) -> bool:
        if is_dir(path):
            return False
        if begin.startswith(ZIP_BEGINNINGS):
            return is_zip_with("/data.pkl")(path, begin)
        suffix = path.suffix.lower()
        return suffix in PICKLE_SUFFIXES or (begin.startswith(_PICKLES) and suffix not in others)

    return matches


def is_splat(path: Path, begin: bytes) -> bool:
    """Whether a file is a .splat scene: by its suffix or, if it was renamed, by plausible rows throughout.

    Random bytes pass with a probability of about 5e-4 for each of the rows that are inspected.
    """
    return not _is_text(begin) and (path.suffix.lower() == ".splat" or _has_plausible_rows(path))


def is_ksplat(path: Path, begin: bytes) -> bool:
    """Whether a file is a .ksplat scene: by its suffix or, if renamed, by version, counts and level."""
    if path.suffix.lower() == ".ksplat" or len(begin) < _KSPLAT.size:
        return path.suffix.lower() == ".ksplat" and not _is_text(begin)
    version, most_sections, sections, most_rows, rows, level = _KSPLAT.unpack_from(begin)
    are_counts_plausible = 0 < sections <= most_sections < 1 << 16 and 0 < rows <= most_rows < 1 << 31
    return bool(version == _KSPLAT_VERSION and are_counts_plausible and level <= _MAX_LEVEL)


def _is_text(begin: bytes) -> bool:
    """Whether this is a web page or the like: floats always have bytes that are no text."""
    return all(32 <= byte < 127 or byte in b"\t\r\n" for byte in begin)


def _has_plausible_rows(path: Path) -> bool:
    try:
        with path.open("rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            num_rows = size // SPLAT_ROW_SIZE
            if size % SPLAT_ROW_SIZE or num_rows < _MIN_ROWS:
                return False
            for index in range(min(_NUM_INSPECTED, num_rows)):
                file.seek(SPLAT_ROW_SIZE * (index * num_rows // min(_NUM_INSPECTED, num_rows)))
                if not _is_plausible(file.read(SPLAT_ROW_SIZE)):
                    return False
    except OSError:
        return False
    return True


def _is_plausible(row: bytes) -> bool:
    if len(row) < SPLAT_ROW_SIZE:
        return False
    values = _ROW.unpack(row)
    length = math.hypot(*((byte - 128) / 128 for byte in values[10:]))
    return (
        all(abs(value) < _LARGEST for value in values[:3])  # False for NaN
        and all(0 <= value < _LARGEST for value in values[3:6])
        and max(values[3:6]) > 0
        and _LENGTHS[0] < length < _LENGTHS[1]
    )
