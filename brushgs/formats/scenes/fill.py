"""The rows of a scene file are read into columns block by block, by several threads for large files.

Each block is decoded at its place in the finished columns and checked while it is in the cache. Rows that
cannot be drawn leave gaps, which are closed in place at the end, so that a scene is never in memory twice.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass

import numpy as np

from brushgs.core.threads import num_threads_or_default
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped, drop_faults
from brushgs.formats.scenes.encoding import Encoding

_ROWS_PER_THREAD = 100_000  # below this, a thread costs more than it saves
_MAX_THREADS = 4  # more only wait for memory

Decoder = Callable[[int, int, Columns], None]  # (start, stop, where to write raw values)


def fill(
    columns: Columns,
    open_decoder: Callable[[], AbstractContextManager[Decoder]],
    *,
    block_rows: int,
    num_rest: int,
    is_sequential: bool,
    is_logit: bool,
    encoding: Encoding,
    is_raw: bool,
    first_row: int = 0,
) -> tuple[Columns, Dropped]:
    """Fill columns block by block; the result does not depend on the number of threads.

    Args:
        columns: as many rows as the file has, or as are wanted of it.
        open_decoder: context that gives a function which decodes rows `start` to `stop` of the file into the
            columns handed to it; entered once per thread, with floating-point warnings off.
        block_rows: rows decoded at a time.
        num_rest: f_rest coefficients per channel in the file, for the names of columns in messages.
        is_sequential: whether rows must be decoded in order, so by one thread.
        is_logit: whether opacities are decoded to logits; else they are 0 to 1.
        encoding: what the decoded values mean.
        is_raw: whether to keep all rows as decoded: nothing is checked, dropped or activated.
        first_row: of the file, that the columns begin with.

    Returns:
        The rows that can be drawn, in order, as views of `columns`; and the dropped ones.
    """
    from concurrent.futures import ThreadPoolExecutor

    num_rows = len(columns.means)
    num_threads = 1 if is_sequential else _count_threads(num_rows)
    blocks_per_thread = -(-num_rows // (num_threads * block_rows))

    def work(part: int) -> list[tuple[int, int, Dropped]]:
        first = part * blocks_per_thread * block_rows
        last = min(first + blocks_per_thread * block_rows, num_rows)
        done = []
        # Values beyond float32 become infinity and NaN stays NaN: both are found below.
        with np.errstate(all="ignore"), open_decoder() as decode:
            for start in range(first, last, block_rows):
                stop = min(start + block_rows, last)
                block, dropped = columns.part(start, stop), Dropped()
                row = first_row + start
                decode(row, first_row + stop, block)
                if not is_raw:
                    block, dropped = activate_rows(
                        block, encoding, first_row=row, num_rest=num_rest, is_logit=is_logit
                    )
                done.append((start, len(block.means), dropped))
        return done

    with ThreadPoolExecutor(num_threads) as pool:
        parts = list(pool.map(work, range(num_threads)))
    return _close_gaps(columns, (block for part in parts for block in part))


@dataclass(frozen=True)
class RowSource:
    """The rows of a file, of which any can be read: what `fill` takes, but for the columns.

    Attributes:
        num_rows: that the file has.
        num_terms: spherical-harmonic terms that are decoded.
        open_decoder: see `fill`, as all that follow.
        block_rows: rows decoded at a time.
        num_rest: f_rest coefficients per channel in the file.
        is_sequential: whether rows must be decoded in order.
        is_logit: whether opacities are decoded to logits.
        encoding: what the decoded values mean.
        is_whole: whether all of the file is in memory, since its rows cannot be read apart.
    """

    num_rows: int
    num_terms: int
    open_decoder: Callable[[], AbstractContextManager[Decoder]]
    block_rows: int
    num_rest: int
    is_sequential: bool
    is_logit: bool
    encoding: Encoding
    is_whole: bool = False

    def read(self, columns: Columns, *, first_row: int = 0, is_raw: bool = False) -> tuple[Columns, Dropped]:
        """`fill` columns with rows from `first_row` on."""
        return fill(
            columns,
            self.open_decoder,
            block_rows=self.block_rows,
            num_rest=self.num_rest,
            is_sequential=self.is_sequential,
            is_logit=self.is_logit,
            encoding=self.encoding,
            is_raw=is_raw,
            first_row=first_row,
        )


def activate_rows(
    rows: Columns, encoding: Encoding, *, first_row: int, num_rest: int, is_logit: bool
) -> tuple[Columns, Dropped]:
    """Turn raw values into scales and opacities, in place.

    Args:
        rows: raw values, overwritten.
        encoding: what they mean.
        first_row: row of the file that they begin with, for messages.
        num_rest: f_rest coefficients per channel in the file, for the names of columns in messages.
        is_logit: whether opacities are logits once `encoding` is applied; else they are 0 to 1.

    Returns:
        The rows that can be drawn, in order, as views of `rows`; and the dropped ones.
    """
    with np.errstate(all="ignore"):
        rows.standardize(encoding)
        dropped = drop_faults(rows, first_row, num_rest)
        kept = rows.part(0, len(rows.means) - dropped.num_rows)
        kept.activate(is_logit=is_logit)
    return kept, dropped


def _count_threads(num_rows: int) -> int:
    return max(1, min(num_threads_or_default(None), _MAX_THREADS, num_rows // _ROWS_PER_THREAD))


def _close_gaps(columns: Columns, blocks: Iterator[tuple[int, int, Dropped]]) -> tuple[Columns, Dropped]:
    """Move the kept rows of each block together, in place: a copy of the scene would double its memory."""
    total, dropped = 0, Dropped()
    for start, num_kept, block_dropped in blocks:
        if total < start:
            columns.move(slice(start, start + num_kept), total)
        total += num_kept
        dropped.add(block_dropped)
    return columns.part(0, total), dropped
