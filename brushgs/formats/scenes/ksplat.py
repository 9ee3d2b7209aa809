"""The .ksplat format of GaussianSplats3D, version 0.1, compression levels 0 to 2.

A file has 4096 bytes of header, then a header of 1024 bytes for each section of Gaussians. A section holds
the lengths of its partly filled buckets, the centers of all its buckets, and its rows. Level 0 holds float32;
levels 1 and 2 hold positions as 16-bit offsets from bucket centers, and other numbers as half floats; level 2
holds spherical-harmonic coefficients as bytes. Colors and opacities are bytes at every level.
Source: https://github.com/mkkellogg/GaussianSplats3D.
"""

import struct
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import NoGaussiansError, SceneError
from brushgs.formats.files import cut_off, damaged, open_plain, read_exactly
from brushgs.formats.scenes.columns import Columns, Encoding, check_decoded_size
from brushgs.formats.scenes.rows import Decoder, RowSource, SceneFile
from brushgs.values.arrays import F32, U8

_HEADER_SIZE, _SECTION_SIZE = 4096, 1024
# Version; sections (capacity, used); Gaussians (capacity, used); level; smallest and largest coefficient.
_HEADER = struct.Struct("<BB2xIIIIH14x2f")
# Gaussians (used, capacity), rows per bucket, number of buckets, side of a bucket in space, bytes of a
# bucket, range of offsets, full and partly filled buckets, degree.
_SECTION = struct.Struct("<IIIIfH2xI4xIIH")
_VERSION = 0, 1
_MAX_LEVEL, _MAX_DEGREE = 2, 3
_BASE_SIZES, _REST_SIZES = (44, 24, 24), (4, 2, 1)  # by level: bytes of a row without coefficients, of one
_BUCKET_SIZE = 12
_DEFAULT_OFFSETS = 32767
_DEFAULT_LIMIT = 1.5  # a limit of 0 means this


class _Section(NamedTuple):
    """One section of a file."""

    num_rows: int  # number of Gaussians
    degree: int  # of spherical harmonics, 0 to 3
    row_size: int  # bytes
    offset: int  # byte offset of the rows in the file
    bucket_starts: NDArray[np.int64]  # [buckets] first row in the section of each bucket; empty at level 0
    bucket_centers: F32  # [buckets, 3]
    zero_offset: int  # stored value of an offset of 0
    offset_step: float  # length per unit of a stored offset


class _Header(NamedTuple):
    """All headers of a file."""

    level: int  # compression level, 0 to 2
    limits: tuple[float, float]  # smallest and largest spherical-harmonic coefficient, at level 2
    sections: tuple[_Section, ...]  # non-empty sections, at least one


def _read_header(path: Path, file: BinaryIO) -> _Header:
    """Read the headers and the buckets of a file."""
    size = file.seek(0, 2)
    major, minor, num_sections, _, _, stated, level, low, high = _HEADER.unpack(
        _read(path, file, size, 0, _HEADER.size, "its header")
    )
    if (major, minor) != _VERSION:
        rule = f"must have version 0.1, got {major}.{minor}"
        raise SceneError(path, f"is a .ksplat scene that {rule}; convert it with a newer GaussianSplats3D")
    if level > _MAX_LEVEL:
        raise damaged(path, f"the compression level must be 0 to {_MAX_LEVEL}, got {level}")
    start = _HEADER_SIZE + num_sections * _SECTION_SIZE
    what = f"{num_sections} section headers"
    table = _read(path, file, size, _HEADER_SIZE, num_sections * _SECTION_SIZE, what)
    sections = []
    for number in range(num_sections):
        fields = _SECTION.unpack_from(table, number * _SECTION_SIZE)
        section, start = _read_section(path, file, size, start, number, level, fields)
        if section.num_rows:
            sections.append(section)
    found = sum(section.num_rows for section in sections)
    if not found:
        raise NoGaussiansError(path, "holds no Gaussians: its sections are empty; export the scene again")
    if found != stated:
        rule = f"its header must count the {found} Gaussians of its sections, got {stated}"
        raise SceneError(path, f"{rule}; it is damaged: copy or export it again")
    return _Header(level, (low or -_DEFAULT_LIMIT, high or _DEFAULT_LIMIT), tuple(sections))


def _read_section(
    path: Path, file: BinaryIO, size: int, start: int, number: int, level: int, fields: tuple[Any, ...]
) -> tuple[_Section, int]:
    """Read the section whose data begins at byte `start`; also return the start of the next one."""
    num_rows, room, bucket_rows, num_buckets, block, bucket_size, offsets, *counts, degree = fields
    num_full, num_partial = counts
    if degree > _MAX_DEGREE:
        raise _damaged(path, number, f"spherical harmonics of degree {degree}")
    if num_rows > room:
        raise _damaged(path, number, f"{num_rows} Gaussians in the room of {room}")
    if level == 0:
        num_buckets = num_full = num_partial = 0
    elif num_buckets and bucket_size != _BUCKET_SIZE:
        raise _damaged(path, number, f"buckets of {bucket_size} bytes in place of {_BUCKET_SIZE}")
    if num_full + num_partial > num_buckets:
        raise _damaged(path, number, f"{num_full} full and {num_partial} other buckets of {num_buckets}")
    row_size = _BASE_SIZES[level] + _REST_SIZES[level] * 3 * ((degree + 1) ** 2 - 1)
    centers = start + 4 * num_partial
    rows = centers + _BUCKET_SIZE * num_buckets
    what = f"section {number} with {num_rows} Gaussians"
    if rows + row_size * num_rows > size:
        raise cut_off(path, f"{size} bytes do not hold {what}")
    lengths = np.frombuffer(_read(path, file, size, start, 4 * num_partial, what), "<u4")
    # The last of the starts is the end of the last bucket.
    starts = np.cumsum(np.concatenate([[0], np.full(num_full, bucket_rows), lengths]), dtype=np.int64)
    if level and starts[-1] < num_rows:
        raise _damaged(path, number, f"{num_rows} Gaussians in buckets for {starts[-1]}")
    middles = np.frombuffer(_read(path, file, size, centers, _BUCKET_SIZE * num_buckets, what), "<f4")
    zero = offsets or _DEFAULT_OFFSETS
    buckets = starts[:-1], middles.reshape(-1, 3), zero, block / 2 / zero
    return _Section(num_rows, degree, row_size, rows, *buckets), rows + row_size * room


def _read(path: Path, file: BinaryIO, size: int, start: int, length: int, what: str) -> bytearray:
    """Read `length` bytes from `start`; that they exist is checked before memory is allocated."""
    if start + length > size:
        raise cut_off(path, f"{size} bytes do not hold {what}")
    content = bytearray(length)
    read_exactly(path, file, start, memoryview(content))
    return content


def _damaged(path: Path, number: int, fact: str) -> SceneError:
    return SceneError(path, f"is damaged: section {number} is said to have {fact}; copy or export it again")


_BLOCK_ROWS = 4096
_ENCODING = Encoding(scales="linear", colors="byte")


def open_scene(path: Path) -> SceneFile:
    """Read the headers of a .ksplat file.

    Raises:
        SceneError: if they are damaged, the file is cut off, or its version is unknown.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        header = _read_header(path, file)
        size = file.seek(0, 2)
    num_rows = sum(section.num_rows for section in header.sections)
    num_terms = (max(section.degree for section in header.sections) + 1) ** 2
    check_decoded_size(path, num_rows, num_terms, size)
    open_rows = partial(_open_rows, path, header, num_rows, num_terms)
    return SceneFile(path, f".ksplat, compression level {header.level}", num_rows, num_terms, open_rows)


def _open_rows(path: Path, header: _Header, num_rows: int, num_terms: int) -> RowSource:
    """See `SceneFile.open_rows`."""
    ends = list(accumulate(section.num_rows for section in header.sections))

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        with open_plain(path, buffering=0) as file:
            buffer = np.empty(_BLOCK_ROWS * max(section.row_size for section in header.sections), np.uint8)

            def decode(start: int, stop: int, out: Columns) -> None:
                first = start
                while first < stop:  # a block may span several sections
                    number = bisect_right(ends, first)
                    section, end = header.sections[number], min(stop, ends[number])
                    row = first - (ends[number] - section.num_rows)
                    rows = buffer[: (end - first) * section.row_size]
                    read_exactly(path, file, section.offset + row * section.row_size, rows.data)
                    _decode(rows, header, section, row, out.part(first - start, end - start))
                    first = end

            yield decode

    return RowSource(num_rows, num_terms, open_decoder, _BLOCK_ROWS, _ENCODING)


def _decode(rows: U8, header: _Header, section: _Section, first: int, out: Columns) -> None:
    """Decode rows of one section, starting at row `first` of the section."""
    count = len(out.means)

    def view(dtype: str, offset: int, width: int) -> NDArray[Any]:
        """Adjacent values of each row, [rows, width]."""
        step = np.dtype(dtype).itemsize
        return np.ndarray((count, width), dtype, rows.data, offset, (section.row_size, step))

    position, number, size = ("<f4", "<f4", 4) if header.level == 0 else ("<u2", "<f2", 2)
    _copy(view(position, 0, 3), out.means)
    _copy(view(number, 3 * size, 3), out.scales)
    _copy(view(number, 6 * size, 4), out.quats)
    rgba = view("u1", 10 * size, 4)
    if header.level:
        buckets = np.searchsorted(section.bucket_starts, np.arange(first, first + count), side="right") - 1
        out.means -= section.zero_offset
        out.means *= np.float32(section.offset_step)
        out.means += section.bucket_centers[buckets]
    out.sh[:, 0] = rgba[:, :3]
    np.divide(rgba[:, 3], np.float32(255), out=out.opacities)
    num_rest = 3 * ((section.degree + 1) ** 2 - 1)
    rest = view(("<f4", "<f2", "u1")[header.level], _BASE_SIZES[header.level], num_rest)
    if header.level == 2:
        low, high = header.limits
        rest = (np.arange(256) / 255 * (high - low) + low).astype(np.float32)[rest]
    _decode_rest(rest, section.degree, out.sh)


def _copy(values: NDArray[Any], out: F32) -> None:
    """Copy column by column: inner loops of length 3 and 4 take twice as long."""
    for column in range(values.shape[1]):
        out[:, column] = values[:, column]


def _decode_rest(rest: NDArray[Any], degree: int, sh: F32) -> None:
    """Copy coefficients stored by band, then by channel; terms that are not stored become 0."""
    start = 0
    for band in range(1, degree + 1):
        width = 2 * band + 1
        for channel in range(3):
            sh[:, band**2 : band**2 + width, channel] = rest[:, start : start + width]
            start += width
    sh[:, (degree + 1) ** 2 :] = 0
