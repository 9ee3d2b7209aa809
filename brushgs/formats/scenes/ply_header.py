"""PLY files: the header (elements, properties, comments), and rows of an element in any of three encodings.

A block of rows is a structured array with one field per scalar property. All blocks are read into one buffer,
so a file is never in memory beside what is made of it, and a block is still in the cache when it is decoded.
What `Stored` holds is JSON in header comments, in lines that every reader takes.
"""

import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.scenes.stored import MAX_TEXT, Stored, content_of, parse_text, text_of
from brushgs.values.notes import Training

PREFIX = "comment brushgs "
_LINE = 180  # characters of JSON a line: some readers take 255 a word and 1024 a line


def comment_lines(stored: Stored) -> list[str]:
    """The comments, in ASCII and without newlines; none where there is nothing to say.

    Raises:
        ValueError: if the names of the brushes are too long.
    """
    content = content_of(stored)
    text = text_of(content) if content else ""
    return [PREFIX + text[start : start + _LINE] for start in range(0, len(text), _LINE)]


def read_comments(text: str) -> Stored:
    """The content of the comments, their text joined without `PREFIX`.

    Raises:
        ValueError: if it is damaged.
    """
    return parse_text(text)


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


_LONGEST_LINE = 1 << 16  # bytes; a row of as many properties as a header may name has half of that
_PIECE = 1 << 18  # bytes of text parsed at a time: as words and numbers they take forty times as much


class RowReader(Protocol):
    """Reads rows of one element; a block is valid until the next call of `read`."""

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        """Rows `start` to `stop`, the last one excluded."""


def check_size(path: Path, header: Header, element: Element, size: int) -> None:
    """Compare the counts of a header with the size of the file, before memory is allocated.

    Args:
        path: the file, for the message.
        header: its header.
        element: the element that will be read.
        size: bytes of the whole file.

    Raises:
        SceneError: if the file is too short for the rows of `element`; says how many are complete and
            how many bytes are missing.
    """
    if header.is_ascii:
        # Every value takes a digit and a blank or newline; the last newline may be missing.
        start, row_size = header.data_offset, max(2 * len(element.names), 1)
        size += 1
    else:
        start, row_size = data_start(path, header, element), element.dtype.itemsize
    missing = start + element.count * row_size - size
    if missing > 0:
        num_complete = max(size - start, 0) // max(row_size, 1)
        at_least = "at least " if header.is_ascii else ""
        raise SceneError(
            path,
            f"is cut off: of {element.count} rows of element {element.name!r} {num_complete} are complete and"
            f" {at_least}{missing} bytes are missing; copy or export it again",
        )


def warn_of_surplus(path: Path, header: Header, size: int) -> None:
    """Warn of bytes after the last row: a sign of a wrong count or a faulty transfer."""
    if header.is_ascii or any(element.lists for element in header.elements):
        return
    end = header.data_offset + sum(element.count * element.dtype.itemsize for element in header.elements)
    if size > end:
        message = f"{path}: {size - end} bytes after the last row were ignored"
        doubt = "if the picture looks wrong, the file was changed in transfer: get it again in binary mode"
        warnings.warn(SceneWarning(f"{message}; {doubt}"), stacklevel=3)


def data_start(path: Path, header: Header, element: Element) -> int:
    """Byte at which the rows of an element of a binary file begin.

    Raises:
        SceneError: if a list, whose length is known from its data only, comes before or in the element.
    """
    start = header.data_offset
    for other in header.elements:
        if other.lists and (other.count or other is element):
            place = "in" if other is element else "before"
            raise SceneError(
                path,
                f"has the list property {other.lists[0]!r} of element {other.name!r} {place} element"
                f" {element.name!r}, so its rows cannot be found; export it without lists",
            )
        if other is element:
            break
        start += other.count * other.dtype.itemsize
    return start


@contextmanager
def open_rows(path: Path, header: Header, element: Element, block_rows: int) -> Iterator[RowReader]:
    """A reader of the rows of `element`, at most `block_rows` at a time.

    It has a file object of its own, so several threads can read at once. An ASCII reader must be asked for
    rows in order.
    """
    with open_plain(path, buffering=-1 if header.is_ascii else 0) as file:
        if header.is_ascii:
            yield _AsciiRows(path, file, header, element)
        else:
            yield _BinaryRows(path, file, header, element, block_rows)


class _BinaryRows:
    def __init__(self, path: Path, file: BinaryIO, header: Header, element: Element, block_rows: int) -> None:
        self._path, self._file, self._element = path, file, element
        self._start = data_start(path, header, element)
        self._buffer = np.empty(min(block_rows, element.count), dtype=element.dtype)

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        row_size = self._element.dtype.itemsize
        block = self._buffer[: stop - start]
        target = memoryview(block.view(np.uint8).data)
        read_exactly(self._path, self._file, self._start + start * row_size, target)
        return block


class _AsciiRows:
    def __init__(self, path: Path, file: BinaryIO, header: Header, element: Element) -> None:
        self._path, self._element, self._next = path, element, 0
        file.seek(header.data_offset)
        self._lines = self._read_lines(file)
        for other in header.elements:
            if other is element:
                break
            for _ in islice(self._lines, min(other.count, sys.maxsize)):
                pass

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        assert start == self._next, "lines of text can only be read in order"
        self._next = stop
        block = np.empty((stop - start, len(self._element.names)))
        done = 0
        while done < len(block):
            lines = self._take_piece(len(block) - done)
            if not lines:
                raise SceneError(
                    self._path,
                    f"is cut off: it ends after row {start + done} of {self._element.count} rows of"
                    f" element {self._element.name!r}; copy or export it again",
                )
            block[done : done + len(lines)] = self._numbers(lines, start + done)
            done += len(lines)
        return block.view(self._element.dtype)[:, 0]

    def _read_lines(self, file: BinaryIO) -> Iterator[bytes]:
        """Lines that are not blank, none longer than `_LONGEST_LINE`."""
        while line := file.readline(_LONGEST_LINE):
            if len(line) == _LONGEST_LINE:
                fault = f"has a line of more than {_LONGEST_LINE} bytes among its rows"
                raise SceneError(self._path, f"{fault}; it is damaged: export it again")
            if not line.isspace():
                yield line

    def _take_piece(self, num_lines: int) -> list[bytes]:
        """The next lines, at most so many, and at most about `_PIECE` bytes."""
        lines: list[bytes] = []
        size = 0
        for line in islice(self._lines, num_lines):
            lines.append(line)
            size += len(line)
            if size >= _PIECE:
                break
        return lines

    def _numbers(self, lines: list[bytes], start: int) -> NDArray[np.float64]:
        """[lines, properties] of some lines; the first is row `start`."""
        width = len(self._element.names)
        tokens = b" ".join(lines).split()
        try:
            values = np.array(list(map(float, tokens)))
        except ValueError:
            raise self._find_fault(lines, start) from None
        if len(values) != width * len(lines):
            raise self._find_fault(lines, start)
        return values.reshape(len(lines), width)

    def _find_fault(self, lines: list[bytes], start: int) -> SceneError:
        """What is wrong with the first line that is not a row of numbers."""
        names = self._element.names
        for row, line in enumerate(lines, start):
            tokens = line.split()
            if len(tokens) != len(names):
                fault = f"has {len(tokens)} values where the header names {len(names)} properties"
                return SceneError(self._path, f"row {row} {fault}; export it again")
            for name, token in zip(names, tokens, strict=True):
                try:
                    float(token)
                except ValueError:
                    text = token[:40].decode("latin-1")
                    fault = f"has {text!r} in column {name!r}, which is not a number"
                    return SceneError(self._path, f"row {row} {fault}; export it again")
        raise AssertionError("no line is at fault")
