"""The header of a PLY file: elements, properties, comments, and where the data begins."""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.scenes.stored import MAX_TEXT
from brushgs.formats.scenes.view_comments import PREFIX
from brushgs.values.notes import Training

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_MAX_HEADER = 1 << 20  # bytes; real headers have 2 KiB, so a megabyte without its end is no header
STROKES = "strokes of brushgs"  # the comment on Gaussians that are strokes: painting keeps all of them
# Blanks are bounded: two unbounded runs of them in a row would take quadratic time.
_UP = re.compile(r"\b(?:vertical|up)[ _-]?axis\s{0,9}[:=]?\s{0,9}([+-]?)([xyz])\b", re.IGNORECASE)
# How a scene was trained, in the words of Brush, and in those of Postshot, where 1 is "mip".
_TRAINED = re.compile(
    r"SplatRenderMode\s{0,9}:\s{0,9}(default|mip|2dgs)|antialiased\s{0,9}([01])", re.IGNORECASE
)
_TRAINING: dict[str, Training] = {
    **{"default": "default", "0": "default"},
    **{"mip": "antialiased", "1": "antialiased", "2dgs": "2dgs"},
}
BRUSH = "brush"  # the column of bytes that holds the brush of each stroke: a row of the brushes in a comment
MIP = "SplatRenderMode: mip"  # the comment on antialiased Gaussians
# Scenes have at most 62 properties and a handful of elements; the time for either is quadratic.
_MAX_PROPERTIES, _MAX_ELEMENTS = 1000, 100


@dataclass(frozen=True)
class Element:
    """One table of the file.

    Attributes:
        name: "vertex", "face", "chunk", ...
        count: number of rows, >= 0, as stated: `check_size` compares it with the size of the file.
        dtype: one field per scalar property, packed, in the byte order of the file.
        lists: names of the properties that are lists; with any, the row size varies.
    """

    name: str
    count: int
    dtype: np.dtype[Any]
    lists: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the scalar properties, in the order of the file."""
        return self.dtype.names or ()


@dataclass(frozen=True)
class Header:
    """What a PLY header states.

    Attributes:
        encoding: "ascii", "binary_little_endian" or "binary_big_endian".
        elements: in the order of the file.
        data_offset: byte at which the first row begins.
        up: axis that a comment names as up, "+x" to "-z", or None.
        is_strokes: whether a comment states that the rows are strokes, see `STROKES`.
        training: how the scene was trained, by the last comment that states it; None if none does.
        view_text: what comments state of the scene that they were made of, see `view_comments`; not parsed.
        comments: the other comments, and obj_info, with one blank between words.
    """

    encoding: str
    elements: tuple[Element, ...]
    data_offset: int
    up: str | None
    is_strokes: bool = False
    training: Training | None = None
    view_text: str = ""
    comments: tuple[str, ...] = ()

    @property
    def is_ascii(self) -> bool:
        """Whether rows are lines of text."""
        return self.encoding == "ascii"

    def find(self, name: str) -> Element | None:
        """The element of that name, or None."""
        return next((element for element in self.elements if element.name == name), None)


@dataclass
class _Draft:
    """A header while its lines are parsed."""

    path: Path
    encoding: str = ""
    elements: list[Element] = field(default_factory=list)
    properties: list[tuple[str, str]] = field(default_factory=list)  # of the element being read
    lists: list[str] = field(default_factory=list)
    up: str | None = None
    is_strokes: bool = False
    training: Training | None = None
    view_text: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)

    def close_element(self) -> None:
        """Give the last element its properties."""
        if self.elements:
            last = self.elements.pop()
            dtype = np.dtype(list(self.properties))
            self.elements.append(Element(last.name, last.count, dtype, tuple(self.lists)))
        self.properties, self.lists = [], []


def parse_header(file: BinaryIO, path: Path) -> Header:
    """Read the header of a PLY file, from its first byte.

    Lines may end in LF, CR LF or CR.

    Raises:
        SceneError: if the header has no end or a line of it cannot be understood; names the line.
    """
    begin = file.read(_MAX_HEADER)
    newline = b"\r\n" if begin.startswith(b"ply\r\n") else begin[3:4]
    end = begin.find(newline + b"end_header" + newline)
    if end < 0:
        raise SceneError(
            path, "the header has no 'end_header' line; the file is cut off or damaged: get it again"
        )
    draft = _Draft(path)
    for line in begin[:end].decode("latin-1").split(newline.decode())[1:]:
        _read_line(draft, line)
    draft.close_element()
    if not draft.encoding:
        raise SceneError(path, "the header has no 'format' line; the file is damaged: get it again")
    offset = end + 2 * len(newline) + len(b"end_header")
    view_text = "".join(draft.view_text)[: MAX_TEXT + 1]
    return Header(
        draft.encoding,
        tuple(draft.elements),
        offset,
        draft.up,
        draft.is_strokes,
        draft.training,
        view_text,
        tuple(draft.comments),
    )


def _read_line(draft: _Draft, line: str) -> None:
    """Add the content of one header line."""
    match line.split():
        case []:
            pass
        case ["comment", "brushgs", *_] if line.startswith(PREFIX):
            draft.view_text.append(line[len(PREFIX) :])
        case ["comment" | "obj_info", *words]:
            draft.is_strokes |= line == f"comment {STROKES}"
            draft.comments.append(" ".join(words))
            if trained := _TRAINED.fullmatch(" ".join(words)):
                draft.training = _TRAINING[(trained[1] or trained[2]).lower()]
            # Brush writes "Vertical axis: y" into scenes whose up is -y: without a sign, y is no direction.
            if (axis := _UP.search(line)) and (axis[1] or axis[2].lower() != "y"):
                draft.up = (axis[1] or "+") + axis[2].lower()
        case ["format", encoding, _] if encoding in _BYTE_ORDERS and not draft.elements:
            draft.encoding = encoding
        case ["element", name, count]:
            draft.close_element()
            _check_number(draft.path, "elements", len(draft.elements), _MAX_ELEMENTS)
            draft.elements.append(Element(name, _read_count(draft.path, name, count), np.dtype([])))
        case ["property", "list", _, _, name] if draft.elements:
            _check_number(draft.path, "list properties", len(draft.lists), _MAX_PROPERTIES)
            draft.lists.append(name)
        case ["property", type_name, name] if draft.elements:
            _add_property(draft, type_name, name)
        case _:
            raise SceneError(
                draft.path, f"the header line {line[:80]!r} is not PLY; the file is damaged: get it again"
            )


def _read_count(path: Path, name: str, count: str) -> int:
    """The number of rows of an element."""
    if not (count.isascii() and count.isdigit()):
        raise SceneError(
            path,
            f"element {name[:80]!r} must have a whole number of rows, got {count[:40]!r}; export it again",
        )
    return int(count[:40])


def _check_number(path: Path, what: str, number: int, most: int) -> None:
    """Refuse one more of something if there are `most` already."""
    if number >= most:
        raise SceneError(path, f"the header must name at most {most} {what}; export it as a 3DGS scene")


def _add_property(draft: _Draft, type_name: str, name: str) -> None:
    """Add one scalar column to the element being read."""
    if type_name not in _TYPES:
        known = ", ".join(t for t in _TYPES if not t[-1].isdigit())
        raise SceneError(
            draft.path,
            f"property {name[:80]!r} has the unknown type {type_name[:40]!r}; write it as one of {known}",
        )
    _check_number(draft.path, "properties of an element", len(draft.properties), _MAX_PROPERTIES)
    if any(name == other for other, _ in draft.properties):
        raise SceneError(draft.path, f"property {name[:80]!r} stands twice in the header; export it again")
    order = _BYTE_ORDERS.get(draft.encoding, "=")
    draft.properties.append((name, "f8" if draft.encoding == "ascii" else order + _TYPES[type_name]))
