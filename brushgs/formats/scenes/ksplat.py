"""The .ksplat format of GaussianSplats3D, version 0.1, of compression levels 0 to 2.

Level 0 holds float32; levels 1 and 2 hold offsets of 16 bits from the centres of buckets and half floats, and
level 2 coefficients of spherical harmonics as bytes. Colours and opacities are bytes at every level.
Source: https://github.com/mkkellogg/GaussianSplats3D.
"""

from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.scenes.columns import Columns, check_decoded_size
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.fill import Decoder, RowSource
from brushgs.formats.scenes.ksplat_header import Header, Section, read_header
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.used_terms import drop_zero_bands

_BLOCK_ROWS = 4096
_ENCODING = Encoding(scales="linear", colors="byte")


def open_scene(path: Path) -> SceneFile:
    """Read the headers of a .ksplat file.

    Raises:
        SceneError: if they are damaged, the file is cut off, or its version is unknown.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        header = read_header(path, file)
        size = file.seek(0, 2)
    num_rows = sum(section.num_rows for section in header.sections)
    num_terms = (max(section.degree for section in header.sections) + 1) ** 2
    check_decoded_size(path, num_rows, num_terms, size)
    return SceneFile(
        path=path,
        format=f".ksplat, compression level {header.level}",
        num_rows=num_rows,
        num_terms=num_terms,
        read_columns=partial(_read_columns, path, header, num_rows, num_terms),
        open_rows=partial(_open_rows, path, header, num_rows, num_terms),
    )


def _read_columns(
    path: Path, header: Header, num_rows: int, num_terms: int, *, encoding: Encoding, is_raw: bool
) -> tuple[Columns, Dropped]:
    """See `ColumnReader`."""
    rows = _open_rows(path, header, num_rows, num_terms)
    columns, dropped = rows.read(Columns.empty(num_rows, num_terms), is_raw=is_raw)
    if is_raw:
        columns.standardize(replace(_ENCODING, opacities="linear"))
    else:
        drop_zero_bands(columns)
    return columns, dropped


def _open_rows(path: Path, header: Header, num_rows: int, num_terms: int) -> RowSource:
    """See `SceneFile`."""
    ends = list(accumulate(section.num_rows for section in header.sections))

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        with open_plain(path, buffering=0) as file:
            buffer = np.empty(_BLOCK_ROWS * max(section.row_size for section in header.sections), np.uint8)

            def decode(start: int, stop: int, out: Columns) -> None:
                first = start
                while first < stop:  # a block may reach over several sections
                    number = bisect_right(ends, first)
                    section, end = header.sections[number], min(stop, ends[number])
                    row = first - (ends[number] - section.num_rows)
                    rows = buffer[: (end - first) * section.row_size]
                    read_exactly(path, file, section.offset + row * section.row_size, rows.data)
                    _decode(rows, header, section, row, out.part(first - start, end - start))
                    first = end

            yield decode

    return RowSource(
        num_rows,
        num_terms,
        open_decoder,
        block_rows=_BLOCK_ROWS,
        num_rest=num_terms - 1,
        is_sequential=False,
        is_logit=False,
        encoding=_ENCODING,
    )


def _decode(rows: NDArray[np.uint8], header: Header, section: Section, first: int, out: Columns) -> None:
    """Decode rows of one section; the first is its row `first`."""
    count = len(out.means)

    def view(dtype: str, offset: int, width: int) -> NDArray[Any]:
        """Values that lie side by side in each row, [rows, width]."""
        step = np.dtype(dtype).itemsize
        return np.ndarray((count, width), dtype, rows.data, offset, (section.row_size, step))

    if header.level == 0:
        positions, scales, quats, rgba = (
            view("<f4", 0, 3), view("<f4", 12, 3), view("<f4", 24, 4), view("u1", 40, 4)
        )  # fmt: skip
        _copy(positions, out.means)
    else:
        positions, scales, quats, rgba = (
            view("<u2", 0, 3), view("<f2", 6, 3), view("<f2", 12, 4), view("u1", 20, 4)
        )  # fmt: skip
        buckets = np.searchsorted(section.bucket_starts, np.arange(first, first + count), side="right") - 1
        _copy(positions, out.means)
        out.means -= section.zero_offset
        out.means *= np.float32(section.offset_step)
        out.means += section.bucket_centers[buckets]
    _copy(scales, out.scales)
    _copy(quats, out.quats)
    out.sh[:, 0] = rgba[:, :3]
    np.divide(rgba[:, 3], np.float32(255), out=out.opacities)
    num_rest = 3 * ((section.degree + 1) ** 2 - 1)
    rest = view(("<f4", "<f2", "u1")[header.level], 44 if header.level == 0 else 24, num_rest)
    if header.level == 2:
        low, high = header.limits
        rest = (np.arange(256) / 255 * (high - low) + low).astype(np.float32)[rest]
    _decode_rest(rest, section.degree, out.sh)


def _copy(values: NDArray[Any], out: NDArray[np.float32]) -> None:
    """Copy column by column: inner loops of length 3 and 4 take twice as long."""
    for column in range(values.shape[1]):
        out[:, column] = values[:, column]


def _decode_rest(rest: NDArray[Any], degree: int, sh: NDArray[np.float32]) -> None:
    """Coefficients lie band by band, within a band channel by channel. Terms that are not stored are 0."""
    start = 0
    for band in range(1, degree + 1):
        width = 2 * band + 1
        for channel in range(3):
            sh[:, band**2 : band**2 + width, channel] = rest[:, start : start + width]
            start += width
    sh[:, (degree + 1) ** 2 :] = 0
