"""The headers of a .ksplat file: 4096 bytes, then 1024 bytes for each section of Gaussians.

A section holds the lengths of its partly filled buckets, the centres of all its buckets, and its rows. From
compression level 1 on, a position is an offset of 16 bits an axis from the centre of its bucket.
"""

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import NoGaussiansError, SceneError
from brushgs.formats.files import read_exactly

_HEADER_SIZE, _SECTION_SIZE = 4096, 1024
# Version, sections (room for, in use), Gaussians (likewise), level, smallest and largest coefficient.
_HEADER = struct.Struct("<BB2xIIIIH14x2f")
# Gaussians (in use, room for), rows and number of buckets, size of their block, bytes of a bucket, range of
# offsets, full and partly filled buckets, degree.
_SECTION = struct.Struct("<IIIIfH2xI4xIIH")
_VERSION = 0, 1
_MAX_LEVEL, _MAX_DEGREE = 2, 3
_BASE_SIZES, _REST_SIZES = (
    (44, 24, 24),
    (4, 2, 1),
)  # bytes of a row without coefficients, and of each, by level
_BUCKET_SIZE = 12
_DEFAULT_OFFSETS = 32767
_DEFAULT_LIMIT = 1.5  # a limit of 0 means this


@dataclass(frozen=True)
class Section:
    """One section of a file.

    Attributes:
        num_rows: Gaussians.
        degree: of their spherical harmonics, 0 to 3.
        row_size: bytes.
        offset: byte of the file at which the rows begin.
        bucket_starts: [buckets] row of the section at which each begins; none at level 0.
        bucket_centers: [buckets, 3].
        zero_offset: how an offset of 0 is stored.
        offset_step: length of a stored offset of 1.
    """

    num_rows: int
    degree: int
    row_size: int
    offset: int
    bucket_starts: NDArray[np.int64]
    bucket_centers: NDArray[np.float32]
    zero_offset: int
    offset_step: float


@dataclass(frozen=True)
class Header:
    """All headers of a file.

    Attributes:
        level: of compression, 0 to 2.
        limits: smallest and largest coefficient of spherical harmonics, at level 2.
        sections: those that hold Gaussians, at least one.
    """

    level: int
    limits: tuple[float, float]
    sections: tuple[Section, ...]


def read_header(path: Path, file: BinaryIO) -> Header:
    """Read the headers and the buckets of a file.

    Raises:
        SceneError: if they are damaged, the file is cut off, or its version is unknown.
    """
    size = file.seek(0, 2)
    major, minor, num_sections, _, _, stated, level, low, high = _HEADER.unpack(
        _read(path, file, size, 0, _HEADER.size, "its header")
    )
    if (major, minor) != _VERSION:
        rule = f"must have version 0.1, got {major}.{minor}"
        raise SceneError(path, f"is a .ksplat scene that {rule}; convert it with a newer GaussianSplats3D")
    if level > _MAX_LEVEL:
        rule = f"the compression level must be 0 to {_MAX_LEVEL}, got {level}"
        raise SceneError(path, f"{rule}; the header is damaged: copy or export it again")
    start = _HEADER_SIZE + num_sections * _SECTION_SIZE
    table = _read(
        path, file, size, _HEADER_SIZE, num_sections * _SECTION_SIZE, f"{num_sections} section headers"
    )
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
    return Header(level, (low or -_DEFAULT_LIMIT, high or _DEFAULT_LIMIT), tuple(sections))


def _read_section(
    path: Path, file: BinaryIO, size: int, start: int, number: int, level: int, fields: tuple[Any, ...]
) -> tuple[Section, int]:
    """A section whose data begins at byte `start`; and where the next one begins."""
    num_rows, room, bucket_rows, num_buckets, block, bucket_size, offsets, num_full, num_partial, degree = (
        fields
    )
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
        raise _cut_off(path, size, what)
    lengths = np.frombuffer(_read(path, file, size, start, 4 * num_partial, what), "<u4")
    # The last start is where the last bucket ends.
    starts = np.cumsum(np.concatenate([[0], np.full(num_full, bucket_rows), lengths]), dtype=np.int64)
    if level and starts[-1] < num_rows:
        raise _damaged(path, number, f"{num_rows} Gaussians in buckets for {starts[-1]}")
    section = Section(
        num_rows=num_rows,
        degree=degree,
        row_size=row_size,
        offset=rows,
        bucket_starts=starts[:-1],
        bucket_centers=np.frombuffer(
            _read(path, file, size, centers, _BUCKET_SIZE * num_buckets, what), "<f4"
        ).reshape(-1, 3),
        zero_offset=offsets or _DEFAULT_OFFSETS,
        offset_step=block / 2 / (offsets or _DEFAULT_OFFSETS),
    )
    return section, rows + row_size * room


def _read(path: Path, file: BinaryIO, size: int, start: int, length: int, what: str) -> bytearray:
    """Some bytes of the file, which are known to be there before memory is taken."""
    if start + length > size:
        raise _cut_off(path, size, what)
    content = bytearray(length)
    read_exactly(path, file, start, memoryview(content))
    return content


def _cut_off(path: Path, size: int, what: str) -> SceneError:
    return SceneError(path, f"is cut off: {size} bytes do not hold {what}; copy or download it again")


def _damaged(path: Path, number: int, fact: str) -> SceneError:
    return SceneError(path, f"is damaged: section {number} is said to have {fact}; copy or export it again")
