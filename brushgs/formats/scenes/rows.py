"""The contract of all scene formats: a `SceneFile` with its header read, whose rows can then be read.

Rows are read into columns block by block, by several threads for large files. Each block is decoded at its
place in the finished columns and checked while it is in the cache. Rows that cannot be drawn leave gaps,
which are closed in place at the end, so that a scene is never in memory twice.

Scenes that are larger than memory are read a block at a time. Binary PLY of both layouts, .splat and .ksplat
are read as they lie in the file, and ASCII PLY in order. Of SPZ the decompressed bytes are in memory, 19 to
64 a Gaussian; of SOG, glTF and USD all numbers of one file, 56 to 236 bytes a Gaussian: a large scene in
these is best in several files.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.dropped import Dropped, drop_faults
from brushgs.values.camera import FirstView
from brushgs.values.notes import Training

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


PartReader = Callable[[Columns], tuple[Columns, Dropped]]


def fill_parts(
    parts: Sequence[tuple[int, PartReader]], num_terms: int, brushes: NDArray[np.uint8] | None = None
) -> tuple[Columns, Dropped]:
    """Read parts into the columns of one scene.

    Args:
        parts: of each the number of rows and a function that fills columns of so many rows, as `fill` does.
        num_terms: spherical-harmonic terms of the scene; a part without the last of them sets these to 0.
        brushes: [rows of all parts] of strokes; None if there are none.

    Returns:
        The rows that can be drawn, in order, as views of one set of columns; and the dropped ones.
    """
    columns = Columns.empty(sum(num_rows for num_rows, _ in parts), num_terms)
    columns.brushes = brushes
    start, total, dropped = 0, 0, Dropped()
    for num_rows, read in parts:
        kept, part_dropped = read(columns.part(start, start + num_rows))
        if total < start:
            columns.move(slice(start, start + len(kept.means)), total)
        total += len(kept.means)
        dropped.add(_shifted(part_dropped, start))
        start += num_rows
    return columns.part(0, total), dropped


def _shifted(dropped: Dropped, start: int) -> Dropped:
    """The same rows, counted from the start of the scene."""
    broken, unrotated = dropped.broken, dropped.unrotated
    return replace(
        dropped,
        broken=None if broken is None else (broken[0] + start, *broken[1:]),
        unrotated=None if unrotated is None else unrotated + start,
    )


class ColumnReader(Protocol):
    """Reads all rows of one scene file."""

    def __call__(self, *, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
        """Read the rows, most simply through `fill`.

        Args:
            encoding: what the numbers mean; always the standard one if the format has a fixed encoding.
            is_raw: whether to return all rows and all terms as they would be in the standard layout
                (log-scales and logits), neither checked nor activated.

        Returns:
            The rows that can be drawn, activated, without bands of spherical harmonics that are zero
            throughout; and the dropped rows.

        Raises:
            SceneError: if the file is damaged.
        """


@dataclass(frozen=True)
class SceneFile:
    """A scene file whose header was read and is sound.

    Attributes:
        path: the file, or the folder of a scene in several files.
        format: layout and encoding in words, such as "PLY, binary little-endian".
        num_rows: Gaussians that it holds, >= 1.
        num_terms: spherical-harmonic terms stored of each: 1, 4, 9 or 16.
        read_columns: reads the rows.
        has_fixed_encoding: whether the format leaves no doubt what its numbers mean.
        up: axis that the file names as up, "+x" to "-z"; None if it names none.
        is_strokes: whether the file states that its Gaussians are strokes that brushgs made.
        training: how they were trained, as far as the file states it.
        unknown: columns or extensions of the file that are not read, by name.
        scene: name of the scene that strokes were made of; None if the file names none.
        first_view: how that scene is seen; None if the file does not say.
        brushes: names or paths of the brushes that strokes have rows of, as far as the file states them.
        moment: of a moving scene, whose moment this is: seconds from its start; None for a scene at rest.
        open_rows: gives rows in the standard encoding one block at a time, without what `read_columns` does
            to all of them: bands that are zero are decoded too, and strokes are in no order; raises a
            SceneError where that does. None for formats whose rows can only be decoded all at once.
    """

    path: Path
    format: str
    num_rows: int
    num_terms: int
    read_columns: ColumnReader
    has_fixed_encoding: bool = True
    up: str | None = None
    is_strokes: bool = False
    training: Training = "default"
    unknown: tuple[str, ...] = ()
    scene: str | None = None
    first_view: FirstView | None = None
    brushes: tuple[str, ...] = ()
    moment: float | None = None
    open_rows: Callable[[], RowSource] | None = None


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
