"""The description of a file format, and matchers that recognize its files: by bytes, name, fields, members.

Help texts read the table of formats, so this module imports nothing heavy.
"""

import math
import os
import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

from brushgs.formats.files import is_dir, is_plain

NUM_FIRST_BYTES = 64  # enough to recognize a file by
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
ZIP_BEGINNINGS = b"PK\x03\x04", b"PK\x05\x06"  # the latter for an empty archive
_MAX_JSON_BYTES = 1 << 25  # searched for keys
_MAX_DIRECTORY_BYTES = 1 << 20  # at the end of a zip archive
_USUAL_HEADER, _MAX_HEADER = 1 << 14, 1 << 20  # bytes of a PLY header: trainers write 2 KiB
_PICKLES = b"\x80\x02\x8a\nl\xfc\x9cF", b"\x80\x02}", b"\x80\x04\x95", b"\x80\x05\x95"
PICKLE_SUFFIXES = ".pth", ".pt", ".ckpt", ".pkl", ".pickle"
MODEL_FOLDERS = ("", "sparse/0/", "sparse/", "colmap/sparse/0/", "0/")  # of COLMAP, in that of a capture
SPLAT_ROW_SIZE = 32  # position and scales as float32; red, green, blue, opacity and w, x, y, z as bytes
_ROW = struct.Struct("<6f4B4B")
_MIN_ROWS = 8  # fewer may be plausible by chance
_NUM_INSPECTED = 64  # rows, from the first to the last
_LARGEST = 1e6  # of a coordinate or a scale; scenes in meters stay far below
# Writers normalize quaternions, then round them to steps of 1/128: in three files lengths are 0.986 to 1.015.
_LENGTHS = 0.95, 1.05
_KSPLAT = struct.Struct("<4s4IH")  # version, most sections, sections, most Gaussians, Gaussians, level
_KSPLAT_VERSION = b"\0\1\0\0"
_MAX_LEVEL = 2
Matcher = Callable[[Path, bytes], bool]  # (path, first bytes; empty for a folder) -> whether the format fits


def any_of(*matchers: Matcher) -> Matcher:
    """Match files that any of the matchers accepts."""
    return lambda path, begin: any(matches(path, begin) for matches in matchers)


Kind = Literal[
    "scene", "clip", "camera", "guides", "picture", "drawing", "layered", "video", "style", "marks"
]
Function: TypeAlias = str | Callable[..., Any] | None


class Format(NamedTuple):
    """A file format.

    Attributes:
        name: in words; for scenes and clips without the article, as in "a PLY file".
        kind: what the files hold; "clip" is a moving scene.
        suffixes: in lower case, the usual one first; empty for folders.
        matches: whether a path with these first bytes has this format; a folder has no first bytes. Guides
            and styles are found by suffix instead, and cameras in JSON by `key`.
        read: None if the format is not read. Scenes: `open_scene(path) -> SceneFile`, or
            `open_scene(path, lod)` if `has_levels`, with the level or None for the default. Clips:
            `(path) -> MovingScene`. Cameras: `(path, content) -> CameraFile`, with the content of a JSON
            file, else None. Guides: `(path, content) -> Guides`. Pictures: `check(path, file, max_pixels)`,
            called before OpenImageIO decodes the file, for decoders that take memory before they report the
            size; "" if no check is needed.
        write: None if the format is not written. Scenes: `write_scene(gaussians, path, stored)`, which
            returns the row numbers in the order of the file, or None if the order is unchanged. Pictures:
            `(frame, path, background, **options)`, with `bits` if several are offered and `shot` if
            `holds_metadata`.
        note: which files of the format are read or written, for help texts.
        cure: what to do instead of reading a format that is not read: one clause.
        package: import name of the package that decodes or encodes the format and may be missing; else "".
        written: the suffixes that are written, if not all.
        rounds: scenes: whether writing rounds beyond float32, so that the error is worth reporting.
        has_levels: scenes: whether a file may hold several levels of detail.
        is_alone: scenes: whether a file is read only if it is named, not as one of the scenes in a folder.
        key: cameras in JSON: a field at the top of such a file; "" for a list.
        file: usual file name, if it is more than a suffix.
        bits: pictures: bits per channel that can be chosen, the default first.
        is_linear: pictures: whether values are linear light; else they are display-encoded.
        holds_depth: pictures: whether the depth of a frame is written.
        holds_alpha: pictures: whether transparency is written.
        holds_metadata: pictures and videos: whether the file records how it was painted, see
            `pictures.metadata`.
        takes_strips: pictures: whether a file is written a few rows at a time.
        codecs: videos: names in `VIDEO_CODECS`, the default first.
        container: videos: name of the container in libav.
        max_fps: videos: most frames a second.
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
    bits: tuple[int, ...] = (8,)  # per channel that can be chosen, the default first
    holds_alpha: bool = False  # whether transparency can be written
    min_side: int = 1  # least pixels along a side
    max_side: int | None = None  # most pixels along a side; None if the codec has no limit that matters
    has_even_sides: bool = False  # whether width and height must be even


def begins_with(*beginnings: bytes) -> Matcher:
    """Match files by their first bytes, whatever their name."""
    return lambda path, begin: begin.startswith(beginnings)


def has_suffix(*suffixes: str) -> Matcher:
    """Match files by suffix, for formats whose first bytes do not identify them."""
    return lambda path, begin: path.suffix.lower() in suffixes


def _read(path: Path, most: int, *, at_end: bool = False) -> bytes:
    """Up to `most` bytes from the start or the end of a file; none if it cannot be read."""
    try:
        with path.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - most) if at_end else 0)
            return file.read(most)
    except OSError:
        return b""


def is_json_with(*keys: str, file: str | None = None) -> Matcher:
    """Match JSON files that contain all of the keys, at any depth.

    Args:
        keys: the keys.
        file: name of such a file; a folder that holds it matches too.
    """
    marks = [f'"{key}"'.encode() for key in keys]

    def matches(path: Path, begin: bytes) -> bool:
        if not begin:  # a folder
            if file is None or not is_plain(path / file):
                return False
            path = path / file
        elif not begin.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(b"{"):
            return False
        content = _read(path, _MAX_JSON_BYTES)
        return all(mark in content for mark in marks)

    return matches


def is_zip_with(name: str, *suffixes: str) -> Matcher:
    """Match zip archives by their suffix, or by the name of a member.

    Args:
        name: end of the name of a member, as listed in the directory at the end of the archive.
        suffixes: an archive with one of these matches even if it is damaged.
    """

    def matches(path: Path, begin: bytes) -> bool:
        if not begin.startswith(ZIP_BEGINNINGS):
            return False
        return path.suffix.lower() in suffixes or name.encode() in _read(
            path, _MAX_DIRECTORY_BYTES, at_end=True
        )

    return matches


def is_ply_with(*names: str) -> Matcher:
    """Match PLY files whose header has all of the named properties."""

    def matches(path: Path, begin: bytes) -> bool:
        return begin.startswith((b"ply\n", b"ply\r")) and _properties(path).issuperset(names)

    return matches


def _properties(path: Path) -> set[str]:
    """Names of all properties in the header of a PLY file."""
    header = _read(path, _USUAL_HEADER)
    if b"end_header" not in header:
        header = _read(path, _MAX_HEADER)
    header = header.partition(b"end_header")[0]
    return {name.decode() for name in re.findall(rb"[\r\n]property[ \t]+\w+[ \t]+(\w+)", header)}


def holds(*patterns: str) -> Matcher:
    """Match folders that hold certain files, and files with one of these names.

    Args:
        patterns: glob patterns relative to the folder; at least one must match.
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
    """Match pickles, and PyTorch archives that contain one; none is ever unpickled.

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
    """Whether a file is a .splat scene: by its suffix or, if renamed, by plausible values in sampled rows.

    A row of random bytes is plausible with a probability of about 5e-4.
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
    """Whether all first bytes are text, as in a web page; floats always have bytes that are no text."""
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
