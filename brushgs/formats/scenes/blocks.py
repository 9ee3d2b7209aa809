"""Rows of a scene file a block at a time, for scenes that are larger than memory.

Binary PLY of both layouts, .splat and .ksplat are read as they lie in the file, and ASCII PLY in order. Of
SPZ the decompressed bytes are in memory, 19 to 64 a Gaussian; of SOG, glTF and USD all numbers of one file,
56 to 236 bytes a Gaussian: a large scene in these is best in several files.
"""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import fields, replace

import numpy as np

from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import STANDARD
from brushgs.formats.scenes.fill import RowSource
from brushgs.formats.scenes.scene_file import SceneFile

BLOCK_ROWS = 1 << 18  # of a scene without spherical harmonics 15 MB, and some 100 MB of work on them
SAMPLE_ROWS = 1 << 18  # of a whole scene, about
_RUN = 1 << 12  # rows of a sample that lie together: a page of the file is not read for one of them


def open_rows(file: SceneFile) -> RowSource:
    """The rows of a file of any format.

    Raises:
        SceneError: if it is damaged.
    """
    if file.open_rows is not None:
        return file.open_rows()
    whole, _ = file.read_columns(encoding=STANDARD, is_raw=True)

    def decode(start: int, stop: int, out: Columns) -> None:
        part = whole.part(start, stop)
        for field in fields(Columns):
            if (column := getattr(out, field.name)) is not None:
                column[:] = getattr(part, field.name)

    num_terms = whole.sh.shape[1]
    return RowSource(
        len(whole.means),
        num_terms,
        lambda: nullcontext(decode),
        block_rows=_RUN,
        num_rest=num_terms - 1,
        is_sequential=False,
        is_logit=True,
        encoding=STANDARD,
        is_whole=True,
    )


def read_blocks(
    rows: RowSource, start: int, stop: int, block_rows: int = BLOCK_ROWS
) -> Iterator[tuple[Columns, Dropped]]:
    """Read rows `start` to `stop`, so many at a time.

    Args:
        rows: of a file; where they are sequential, `start` must be 0.
        start: the first row.
        stop: the row after the last one.
        block_rows: of each block but the last.

    Yields:
        The rows that can be drawn, activated, with all bands of spherical harmonics; and the dropped ones.

    Raises:
        SceneError: if the file is damaged.
    """
    with _kept_open(rows) as source:
        for first in range(start, stop, block_rows):
            count = min(block_rows, stop - first)
            yield source.read(Columns.empty(count, rows.num_terms), first_row=first)


def sample_rows(rows: RowSource, count: int) -> Columns:
    """About so many rows, evenly from all of a file, activated; where they are sequential the first ones.

    Of the spherical harmonics only the first band.
    """
    num_runs = min(max(1, count // _RUN), -(-rows.num_rows // _RUN))
    if rows.is_sequential:
        return _first_band(next(read_blocks(rows, 0, min(num_runs * _RUN, rows.num_rows)))[0])
    starts = np.linspace(0, max(rows.num_rows - _RUN, 0), num_runs).astype(int).tolist()
    blocks = (next(read_blocks(rows, first, min(first + _RUN, rows.num_rows)))[0] for first in starts)
    return Columns.joined([_first_band(block) for block in blocks])


def _first_band(block: Columns) -> Columns:
    return replace(block, sh=block.sh[:, :1].copy())


@contextmanager
def _kept_open(rows: RowSource) -> Iterator[RowSource]:
    """The same rows, of a decoder that is opened once where it must go on from block to block."""
    if not rows.is_sequential:
        yield rows
        return
    with rows.open_decoder() as decode:
        yield replace(rows, open_decoder=lambda: nullcontext(decode))
