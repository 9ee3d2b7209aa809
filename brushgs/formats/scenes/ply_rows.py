"""Rows of one element of a PLY file, block by block, in any of the three encodings.

A block is a structured array with one field per scalar property. All blocks are read into one buffer, so a
file is never in memory beside what is made of it, and a block is still in the cache when it is decoded.
"""

import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import BinaryIO, Protocol

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.scenes.ply_header import Element, Header

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
