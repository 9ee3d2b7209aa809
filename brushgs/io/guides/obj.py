"""Guides as Wavefront OBJ: points `v x y z` and lines `l 1 2 3`; everything else in the file is skipped.

A comment `# reach 0.5` states how far the guides reach. Blender writes edges without faces as lines; its
exporter turns axes unless told otherwise: "Forward Y, Up Z" keeps them.
Source: Wavefront, Object Files, appendix B1 (indices count from 1, negative ones from the latest point).
"""

from array import array
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.io.guides.guide_file import CURE, Guides, guides_of
from brushgs.io.json_file import shown

MAX_POINTS = 1 << 19
MAX_LINES = 1 << 21
MAX_LINE = 1 << 16  # bytes of text; some ten thousand indices
EXAMPLE = "write points as 'v 0 1.5 2' and lines as 'l 1 2 3'"


def read(path: Path, content: bytes) -> Guides:
    """The guides of an OBJ file. Raises SceneError, see `read_guides`."""
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
        raise SceneError(path, f"holds no line, only {num_points} points; {CURE}, or {EXAMPLE}")
    if (last := max(segments)) >= num_points:
        fact = f"a line runs to point {last + 1} of {num_points}"
        raise SceneError(path, f"{fact}; {EXAMPLE}, numbered from 1")
    return guides_of(path, np.array(points).reshape(-1, 3), np.array(segments).reshape(-1, 2), reach)


def _lines(path: Path, content: bytes) -> Iterator[tuple[int, list[bytes]]]:
    """Number, from 1, and words of each line, at least one, which may be empty."""
    at, number = 0, 0
    while at < len(content):
        end = content.find(b"\n", at)
        end = len(content) if end < 0 else end
        number += 1
        if number > MAX_LINES:
            raise SceneError(path, f"has more than {MAX_LINES} lines of text; keep only the guides")
        if end - at > MAX_LINE:
            raise SceneError(path, f"line {number} has more than {MAX_LINE} bytes; split it")
        yield number, content[at:end].split() or [b""]
        at = end + 1


def _point(path: Path, number: int, words: list[bytes]) -> tuple[float, ...]:
    values = [_number(word) for word in words[:3]]
    if len(values) != 3 or None in values:
        raise SceneError(path, f"line {number} must hold three coordinates; {EXAMPLE}")
    return tuple(value for value in values if value is not None)


def _row(path: Path, number: int, word: bytes, num_points: int) -> int:
    """The row of a point by its index, which may be followed by one into texture coordinates."""
    text = word.split(b"/")[0]
    try:
        index = int(text) if len(text) <= 10 else 0
    except ValueError:
        index = 0
    row = index - 1 if index > 0 else num_points + index
    if index == 0 or row < 0:
        got = shown(text.decode("ascii", "replace"))
        raise SceneError(path, f"line {number}: {got} is no point; {EXAMPLE}, numbered from 1")
    return row


def _number(word: bytes) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None
