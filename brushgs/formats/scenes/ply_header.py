"""Read PLY files: the header (elements, properties, comments), and rows of an element in all three encodings.

A block of rows is a structured array with one field per scalar property. All blocks are read into one buffer,
so that the file is never in memory beside the scene, and a block is still in the cache when it is decoded.
This is own code because plyfile, under the GPL, takes 1.45 s for 62 columns that this reads in 0.05.
`Stored` is JSON in header comments, split into lines that every reader accepts.
"""

import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.scenes.stored import Stored, content_of, text_of
from brushgs.values.arrays import F64
from brushgs.values.notes import Training

PREFIX = "comment brushgs "
_LINE = 180  # characters of JSON a line: some readers accept 255 a word and 1024 a line


def comment_lines(stored: Stored) -> list[str]:
    """The comment lines for `stored`, in ASCII and without newlines; empty if nothing is stored.

    Raises ValueError if the names of the brushes are too long.
    """
    text = text_of(content_of(stored))
    return [PREFIX + text[start : start + _LINE] for start in range(0, len(text), _LINE)]


_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
_MAX_HEADER = 1 << 20  # bytes; real headers have 2 KiB, so a megabyte without an end is no header
STROKES = "strokes of brushgs"  # comment that marks Gaussians as strokes: painting keeps all of them
# Runs of blanks are bounded, because two adjacent unbounded ones would take quadratic time.
_UP = re.compile(r"\b(?:vertical|up)[ _-]?axis\s{0,9}[:=]?\s{0,9}([+-]?)([xyz])\b", re.IGNORECASE)
# Comments on the training by Brush, and by Postshot, where 1 is "mip".
_TRAINED = re.compile(
    r"SplatRenderMode\s{0,9}:\s{0,9}(default|mip|2dgs)|antialiased\s{0,9}([01])", re.IGNORECASE
)
_TRAINING: dict[str, Training] = {
    **{"default": "default", "0": "default"},
    **{"mip": "antialiased", "1": "antialiased", "2dgs": "2dgs"},
}
BRUSH = "brush"  # byte column with the brush of each stroke: a row number of the brushes in a comment
MIP = "SplatRenderMode: mip"  # comment that marks antialiased Gaussians
# Scenes have at most 62 properties and a few elements; parsing takes quadratic time in either.
_MAX_PROPERTIES, _MAX_ELEMENTS = 1000, 100


@dataclass(frozen=True)
class Element:
    """One table of the file."""

    name: str  # "vertex", "face", "chunk", ...
    count: int  # stated number of rows, >= 0; `check_size` compares it with the size of the file
    properties: list[tuple[str, str]] = field(default_factory=list)  # names and types of scalar properties
    lists: list[str] = field(default_factory=list)  # names of list properties, which make the row size vary

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """One field per scalar property, packed, in the byte order of the file."""
        return np.dtype(self.properties)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the scalar properties, in the order of the file."""
        return self.dtype.names or ()


@dataclass
class Header:
    """A parsed PLY header."""

    encoding: str = ""  # "ascii", "binary_little_endian" or "binary_big_endian"
    elements: list[Element] = field(default_factory=list)  # in the order of the file
    data_offset: int = 0  # byte offset of the first row
    up: str | None = None  # up axis stated by a comment, "+x" to "-z"
    is_strokes: bool = False  # whether a comment states that the rows are strokes, see `STROKES`
    training: Training | None = None  # how the scene was trained, from the last comment that states it
    view_text: list[str] = field(default_factory=list)  # unparsed text of `comment_lines`
    comments: list[str] = field(default_factory=list)  # other comments and obj_info, words joined by a blank

    @property
    def is_ascii(self) -> bool:
        """Whether rows are lines of text."""
        return self.encoding == "ascii"

    def find(self, name: str) -> Element | None:
        """The element of that name, or None."""
        return next((element for element in self.elements if element.name == name), None)


def open_header(path: Path) -> tuple[Header, int]:
    """The header of a PLY file, and the bytes of the file. Raises SceneError as `parse_header` does."""
    with open_plain(path, "PLY file", buffering=0) as file:
        return parse_header(file, path), file.seek(0, 2)


def parse_header(file: BinaryIO, path: Path) -> Header:
    """Read the header of a PLY file, from its first byte.

    Lines may end in LF, CR LF or CR.

    Raises:
        SceneError: if the header has no end or a line is invalid; the message names the line.
    """
    begin = file.read(_MAX_HEADER)
    newline = b"\r\n" if begin.startswith(b"ply\r\n") else begin[3:4]
    end = begin.find(newline + b"end_header" + newline)
    if end < 0:
        fact = "the header has no 'end_header' line"
        raise SceneError(path, f"{fact}; the file is cut off or damaged: get it again")
    header = Header(data_offset=end + 2 * len(newline) + len(b"end_header"))
    for line in begin[:end].decode("latin-1").split(newline.decode())[1:]:
        _read_line(path, header, line)
    if not header.encoding:
        raise SceneError(path, "the header has no 'format' line; the file is damaged: get it again")
    return header


def _read_line(path: Path, header: Header, line: str) -> None:
    """Parse one header line into `header`."""
    match line.split():
        case []:
            pass
        case ["comment", "brushgs", *_] if line.startswith(PREFIX):
            header.view_text.append(line[len(PREFIX) :])
        case ["comment" | "obj_info", *words]:
            header.is_strokes |= line == f"comment {STROKES}"
            header.comments.append(" ".join(words))
            if trained := _TRAINED.fullmatch(" ".join(words)):
                header.training = _TRAINING[(trained[1] or trained[2]).lower()]
            # Brush writes "Vertical axis: y" into scenes whose up is -y, so y without a sign is ignored.
            if (axis := _UP.search(line)) and (axis[1] or axis[2].lower() != "y"):
                header.up = (axis[1] or "+") + axis[2].lower()
        case ["format", encoding, _] if encoding in _BYTE_ORDERS and not header.elements:
            header.encoding = encoding
        case ["element", name, count]:
            _check_number(path, "elements", header.elements, _MAX_ELEMENTS)
            header.elements.append(Element(name, _read_count(path, name, count)))
        case ["property", "list", _, _, name] if header.elements:
            _check_number(path, "list properties", header.elements[-1].lists, _MAX_PROPERTIES)
            header.elements[-1].lists.append(name)
        case ["property", type_name, name] if header.elements:
            _add_property(path, header, type_name, name)
        case _:
            raise SceneError(path, f"the header line {line[:80]!r} is not PLY; get the file again")


def _read_count(path: Path, name: str, count: str) -> int:
    """The number of rows of an element."""
    if not (count.isascii() and count.isdigit()):
        rule = f"element {name[:80]!r} must have a whole number of rows, got {count[:40]!r}"
        raise SceneError(path, f"{rule}; export it again")
    return int(count[:40])


def _check_number(path: Path, what: str, found: Sequence[object], most: int) -> None:
    """Refuse another item if there are `most` already."""
    if len(found) >= most:
        raise SceneError(path, f"the header must name at most {most} {what}; export it as a 3DGS scene")


def _add_property(path: Path, header: Header, type_name: str, name: str) -> None:
    """Add a scalar property to the last element."""
    properties = header.elements[-1].properties
    if type_name not in _TYPES:
        known = ", ".join(t for t in _TYPES if not t[-1].isdigit())
        fact = f"property {name[:80]!r} has the unknown type {type_name[:40]!r}"
        raise SceneError(path, f"{fact}; write it as one of {known}")
    _check_number(path, "properties of an element", properties, _MAX_PROPERTIES)
    if any(name == other for other, _ in properties):
        raise SceneError(path, f"property {name[:80]!r} stands twice in the header; export it again")
    order = _BYTE_ORDERS.get(header.encoding, "=")
    properties.append((name, "f8" if header.is_ascii else order + _TYPES[type_name]))


T = TypeVar("T", np.float32, np.float64)
_LONGEST_LINE = 1 << 16  # bytes; twice a row of the most properties that a header may name
_COLUMN_BYTES = 1 << 21  # of rows read at a time
_PIECE = 1 << 18  # bytes of text parsed at a time; words and numbers take forty times as much memory


def check_size(path: Path, header: Header, element: Element, size: int) -> None:
    """Check the counts of a header against the file `size` in bytes, before memory is allocated.

    Raises:
        SceneError: if the file is too short for the rows of `element`; the message says how many rows are
            complete and how many bytes are missing.
    """
    if header.is_ascii:
        # Every value takes at least a digit and a blank or newline; the last newline may be missing.
        start, row_size = header.data_offset, max(2 * len(element.names), 1)
        size += 1
    else:
        start, row_size = data_start(path, header, element), element.dtype.itemsize
    missing = start + element.count * row_size - size
    if missing > 0:
        num_complete = max(size - start, 0) // max(row_size, 1)
        fact = f"of {element.count} rows of element {element.name!r} {num_complete} are complete"
        lack = f"{'at least ' * header.is_ascii}{missing} bytes are missing"
        raise SceneError(path, f"is cut off: {fact} and {lack}; copy or export it again")


def warn_of_surplus(path: Path, header: Header, size: int) -> None:
    """Warn of bytes after the last row, a sign of a wrong count or a faulty transfer."""
    if header.is_ascii or any(element.lists for element in header.elements):
        return
    end = header.data_offset + sum(element.count * element.dtype.itemsize for element in header.elements)
    if size > end:
        message = f"{path}: {size - end} bytes after the last row were ignored"
        doubt = "if the picture looks wrong, the file was changed in transfer: get it again in binary mode"
        warnings.warn(SceneWarning(f"{message}; {doubt}"), stacklevel=3)


def data_start(path: Path, header: Header, element: Element) -> int:
    """Byte offset of the rows of an element of a binary file.

    Raises:
        SceneError: if the element or one before it has a list property, whose length is only in its data.
    """
    before = header.elements[: header.elements.index(element)]
    for other in (*before, element):
        if other.lists and (other.count or other is element):
            place = f"{'in' if other is element else 'before'} element {element.name!r}"
            fact = f"has the list property {other.lists[0]!r} of element {other.name!r} {place}"
            raise SceneError(path, f"{fact}, so its rows cannot be found; export it without lists")
    return header.data_offset + sum(other.count * other.dtype.itemsize for other in before)


@contextmanager
def open_rows(
    path: Path, header: Header, element: Element, block_rows: int
) -> "Iterator[_BinaryRows | _AsciiRows]":
    """Open a reader of blocks of up to `block_rows` rows; a block is valid until the next is read.

    Each reader has its own file object, so several threads can read at once. An ASCII reader must be asked
    for rows in order.
    """
    with open_plain(path, buffering=-1 if header.is_ascii else 0) as file:
        if header.is_ascii:
            yield _AsciiRows(path, file, header, element)
        else:
            yield _BinaryRows(path, file, header, element, block_rows)


def read_columns(
    path: Path, header: Header, element: Element, names: Sequence[str], dtype: type[T]
) -> NDArray[T]:
    """[number of names, rows] some columns of an element. Raises SceneError if rows are missing."""
    columns = np.empty((len(names), element.count), dtype)
    block_rows = max(_COLUMN_BYTES // max(element.dtype.itemsize, 1), 1)
    with open_rows(path, header, element, block_rows) as rows:
        for start in range(0, element.count, block_rows):
            block = rows.read(start, min(start + block_rows, element.count))
            for index, name in enumerate(names):
                columns[index, start : start + len(block)] = block[name]
    return columns


class _BinaryRows:
    def __init__(self, path: Path, file: BinaryIO, header: Header, element: Element, block_rows: int) -> None:
        self._path, self._file = path, file
        self._start = data_start(path, header, element)
        self._buffer = np.empty(min(block_rows, element.count), dtype=element.dtype)

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        block = self._buffer[: stop - start]
        place = self._start + start * block.itemsize
        read_exactly(self._path, self._file, place, memoryview(block.view(np.uint8).data))
        return block


class _AsciiRows:
    def __init__(self, path: Path, file: BinaryIO, header: Header, element: Element) -> None:
        self._path, self._element, self._next = path, element, 0
        file.seek(header.data_offset)
        self._lines = self._read_lines(file)
        num_before = sum(other.count for other in header.elements[: header.elements.index(element)])
        for _ in islice(self._lines, min(num_before, sys.maxsize)):
            pass

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        assert start == self._next, "lines of text can only be read in order"
        self._next = stop
        block = np.empty((stop - start, len(self._element.names)))
        done = 0
        while done < len(block):
            lines = self._take_piece(len(block) - done)
            if not lines:
                rows = f"row {start + done} of {self._element.count} rows of element {self._element.name!r}"
                raise SceneError(self._path, f"is cut off: it ends after {rows}; copy or export it again")
            block[done : done + len(lines)] = self._numbers(lines, start + done)
            done += len(lines)
        return block.view(self._element.dtype)[:, 0]

    def _read_lines(self, file: BinaryIO) -> Iterator[bytes]:
        """Yield lines that are not blank. Raises SceneError if one is too long, see `_LONGEST_LINE`."""
        while line := file.readline(_LONGEST_LINE):
            if len(line) == _LONGEST_LINE:
                fault = f"has a line of more than {_LONGEST_LINE} bytes among its rows"
                raise SceneError(self._path, f"{fault}; it is damaged: export it again")
            if not line.isspace():
                yield line

    def _take_piece(self, num_lines: int) -> list[bytes]:
        """The next lines: at most `num_lines`, and about `_PIECE` bytes."""
        lines: list[bytes] = []
        size = 0
        for line in islice(self._lines, num_lines):
            lines.append(line)
            size += len(line)
            if size >= _PIECE:
                break
        return lines

    def _numbers(self, lines: list[bytes], start: int) -> F64:
        """The numbers of some lines, [lines, properties]; the first line is row `start`."""
        with suppress(ValueError):
            values = np.array(list(map(float, b" ".join(lines).split())))
            return values.reshape(len(lines), len(self._element.names))
        raise self._find_fault(lines, start)

    def _find_fault(self, lines: list[bytes], start: int) -> SceneError:
        """The error for the first line that is not a row of numbers."""
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
