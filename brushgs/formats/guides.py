"""Read files of guides: lines in space that strokes follow."""

from array import array
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from brushgs.errors import SceneError
from brushgs.formats.files import read_whole
from brushgs.formats.registry import GUIDES_READ, added, by_suffix, formats_of, function_of
from brushgs.formats.schema import SMALL_OBJECT, decode, refused, shown
from brushgs.values.arrays import F64, Rows

MAX_BYTES = 1 << 24  # of a file; 16 MiB are some 500,000 points, more than strokes
MAX_COORDINATE = 1e15  # world units, as for positions of cameras
CURE = "draw a line of two points or more"
# Limits for OBJ files.
MAX_POINTS = 1 << 19
MAX_LINES = 1 << 21
MAX_LINE = 1 << 16  # bytes of text; some ten thousand indices
_OBJ_EXAMPLE = "write points as 'v 0 1.5 2' and lines as 'l 1 2 3'"
_JSON_EXAMPLE = "write lines such as [[[0, 0, 0], [1, 0, 0]]]"


@dataclass(frozen=True, eq=False)
class Guides:
    """Lines in space that strokes follow, as segments."""

    starts: F64  # [S, 3] start points of the segments of all lines, world units
    ends: F64  # [S, 3] end points; no segment has length zero
    # Distance > 0, world units, at which a guide loses its influence; strokes on the guide follow it fully.
    # None for a tenth of the radius of the scene.
    reach: float | None = None


def guides_of(path: Path, points: F64, segments: Rows, reach: float | None) -> Guides:
    """The guides of a file, from its points [P, 3] and the rows [S, 2] of each segment's start and end point.

    Raises SceneError if a number is not finite or too large, or every segment has length zero.
    """
    bad = ~(np.abs(points) <= MAX_COORDINATE).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        rule = f"must have finite coordinates up to {MAX_COORDINATE:g}"
        raise SceneError(path, f"point {row + 1} {rule}, got {points[row].tolist()}; correct it")
    if reach is not None and not 0 < reach <= MAX_COORDINATE:
        raise refused(path, "'reach'", "a distance above 0 in world units", reach, "correct it")
    starts, ends = points[segments[:, 0]], points[segments[:, 1]]
    is_long = (starts != ends).any(axis=1)
    if not is_long.any():
        raise SceneError(path, f"holds no line; {CURE}")
    return Guides(starts[is_long], ends[is_long], reach)


_Point = Annotated[list[float], Meta(min_length=3, max_length=3, description="a point [x, y, z]")]
_Line = Annotated[list[_Point], Meta(description="a list of points [x, y, z]")]
_Lines = Annotated[list[_Line], Meta(description="a list of lines")]


class _File(Struct, forbid_unknown_fields=True):
    guides: _Lines
    reach: float | None = None


def read_lists(path: Path, content: bytes) -> Guides:
    """Read JSON: a list of lines, each a list of points [x, y, z]; or an object with "guides" and "reach".

    {"reach": 0.5, "guides": [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 2, 0], [0, 2, 1]]]}
    """
    if content.lstrip()[:1] == b"{":
        file = decode(path, content, _File, _JSON_EXAMPLE, object_bytes=SMALL_OBJECT)
    else:
        lines = decode(path, content, _Lines, _JSON_EXAMPLE, root="lines", object_bytes=SMALL_OBJECT)
        file = _File(lines)
    points: F64 = np.array([point for line in file.guides for point in line], dtype=np.float64)
    if not len(points):
        raise SceneError(path, f"holds no line; {CURE}")
    is_first = np.array([row == 0 for line in file.guides for row in range(len(line))])
    ends = np.flatnonzero(~is_first)
    segments = np.stack([ends - 1, ends], axis=1)
    return guides_of(path, points, segments, file.reach)


def read_obj(path: Path, content: bytes) -> Guides:
    """Read Wavefront OBJ: points `v x y z` and lines `l 1 2 3`; everything else in the file is skipped.

    A comment `# reach 0.5` states the reach of the guides. Blender writes edges without faces as lines; its
    exporter rotates the axes unless set to "Forward Y, Up Z".
    Source: Wavefront, Object Files, appendix B1 (indices count from 1, negative ones from the latest point).
    """
    points, segments = array("d"), array("q")  # arrays: a tuple of three floats takes 136 bytes
    num_points, reach = 0, None
    for number, (keyword, *words) in _lines(path, content):
        if keyword == b"v":
            points.extend(_point(path, number, words))
            num_points += 1
        elif keyword == b"l":
            rows = [_row(path, number, word, num_points) for word in words]
            for pair in pairwise(rows):
                segments.extend(pair)
        elif keyword == b"#" and len(words) == 2 and words[0].rstrip(b":=") == b"reach":
            reach = _number(words[1])
            if reach is None:
                raise SceneError(path, f"line {number}: 'reach' must be a number; write '# reach 0.5'")
        if max(num_points, len(segments) // 2) > MAX_POINTS:
            raise SceneError(path, f"holds more than {MAX_POINTS} points; simplify the lines")
    if not segments:
        raise SceneError(path, f"holds no line, only {num_points} points; {CURE}, or {_OBJ_EXAMPLE}")
    if (last := max(segments)) >= num_points:
        fact = f"a line runs to point {last + 1} of {num_points}"
        raise SceneError(path, f"{fact}; {_OBJ_EXAMPLE}, numbered from 1")
    return guides_of(path, np.array(points).reshape(-1, 3), np.array(segments).reshape(-1, 2), reach)


def _lines(path: Path, content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Yield the number (from 1) and the words of each line; an empty line has one empty word."""
    for number, line in enumerate(BytesIO(content), start=1):
        if number > MAX_LINES:
            raise SceneError(path, f"has more than {MAX_LINES} lines of text; keep only the guides")
        if len(line.removesuffix(b"\n")) > MAX_LINE:
            raise SceneError(path, f"line {number} has more than {MAX_LINE} bytes; split it")
        yield number, line.split() or [b""]


def _point(path: Path, number: int, words: list[bytes]) -> list[float]:
    values = [value for word in words[:3] if (value := _number(word)) is not None]
    if len(values) != 3:
        raise SceneError(path, f"line {number} must hold three coordinates; {_OBJ_EXAMPLE}")
    return values


def _row(path: Path, number: int, word: bytes, num_points: int) -> int:
    """The row of a point from its OBJ index; an index of texture coordinates after "/" is ignored."""
    index, text = 0, word.split(b"/")[0]
    with suppress(ValueError):
        index = int(text) if len(text) <= 10 else 0
    row = index - 1 if index > 0 else num_points + index
    if index == 0 or row < 0:
        got = shown(text.decode("ascii", "replace"))
        raise SceneError(path, f"line {number}: {got} is no point; {_OBJ_EXAMPLE}, numbered from 1")
    return row


def _number(word: bytes) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def read_guides(path: str | Path) -> Guides:
    """Read lines in space that strokes follow, in one of the formats of `GUIDES_READ`; the suffix decides.

    Raises SceneError if there is no such regular file, it is larger than 16 MiB, its format is unknown, it is
    damaged, it holds no line, or a number is not finite.
    """
    path = Path(path)
    guide_format = by_suffix(formats_of("guides"), path) or by_suffix(added("guides"), path)
    if guide_format is None:
        raise SceneError(path, f"is no file of guides of a known format; give {GUIDES_READ}")
    guides: Guides = function_of(guide_format.read)(path, read_whole(path, MAX_BYTES, "guides file"))
    return guides
