"""The interface of all scene formats: a `SceneFile` holds the header of a file and can read its rows.

A format decodes rows `start` to `stop` of its file into columns (`Decoder`); this module does the rest. Rows
are read block by block, by several threads for large files. Each block is decoded at its place in the final
columns and checked while it is in the cache. Dropped rows leave gaps, which are closed in place at the end,
so that a scene is never in memory twice.

Scenes larger than memory are read one block at a time. Binary PLY of both layouts, .splat, .ksplat and glTF
are read directly from the file, and ASCII PLY in order; USD is unpacked to arrays on the disk. SPZ keeps its
decompressed bytes in memory, 19 to 64 a Gaussian, and SOG its decoded pictures, 20 to 24 bytes a Gaussian.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from threading import Lock
from weakref import WeakValueDictionary

import numpy as np

from brushgs.core.threads import num_threads_or_default
from brushgs.formats.scenes.columns import STANDARD, Columns, Dropped, Encoding, drop_zero_bands, find_faults
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.values.camera import Camera
from brushgs.values.notes import Training

_ROWS_PER_THREAD = 100_000  # below this, a thread costs more than it saves
_MAX_THREADS = 4  # more threads only wait for memory
BLOCK_ROWS = 1 << 18  # without spherical harmonics 15 MB, and some 100 MB while they are processed
SAMPLE_ROWS = 1 << 18  # approximate rows of a sample of a whole scene
_RUN = 1 << 12  # adjacent rows of a sample: no page of the file is read for a single row

Decoder = Callable[[int, int, Columns], None]  # (start, stop, where to write raw values)


@dataclass(frozen=True)
class RowSource:
    """The rows of a file, which can be read in parts.

    `open_decoder` yields a function that decodes rows `start` to `stop` of the file into given columns; it is
    entered once per thread, with floating-point warnings off. The columns have `num_terms` terms, or only the
    used ones if the format has `count_used`.
    """

    num_rows: int
    num_terms: int  # spherical-harmonic terms of each row: 1, 4, 9 or 16
    open_decoder: Callable[[], AbstractContextManager[Decoder]]
    block_rows: int  # rows decoded at a time
    encoding: Encoding = STANDARD  # of the decoded values
    is_logit: bool = False  # whether opacities are logits once `encoding` is applied; else they are 0 to 1
    is_sequential: bool = False  # whether rows must be decoded in order, hence by one thread
    is_whole: bool = False  # whether opening reads the whole file, so that no other process should do it too
    has_brushes: bool = False  # whether the brush of each row is decoded
    # Counts terms up to the highest band that is not zero in every row, if the format can do so before rows
    # are decoded; otherwise zero bands are dropped afterwards.
    count_used: Callable[[], int] | None = None
    is_active: bool = False  # whether decoded values are already valid scales and opacities: no check needed
    num_dropped: int = 0  # undrawable rows that are already left out

    def read(self, columns: Columns, *, first_row: int = 0, is_raw: bool = False) -> tuple[Columns, Dropped]:
        """Fill columns block by block; the result does not depend on the number of threads.

        Args:
            columns: the target; its length is the number of rows to read.
            first_row: first row to read.
            is_raw: whether to keep all rows as log-scales and logits, neither checked nor activated.

        Returns:
            The rows that can be drawn, in order, as views of `columns`; and the dropped rows.

        Raises:
            SceneError: if the file is damaged.
        """
        from concurrent.futures import ThreadPoolExecutor

        num_rows, block_rows = len(columns.means), self.block_rows
        num_threads = 1 if self.is_sequential else _count_threads(num_rows)
        blocks_per_thread = -(-num_rows // (num_threads * block_rows))

        def work(part: int) -> list[tuple[int, int, Dropped]]:
            first = part * blocks_per_thread * block_rows
            last = min(first + blocks_per_thread * block_rows, num_rows)
            done = []
            # Values beyond float32 become infinity and NaN stays NaN: both are detected below.
            with np.errstate(all="ignore"), self.open_decoder() as decode:
                for start in range(first, last, block_rows):
                    stop = min(start + block_rows, last)
                    block, dropped = columns.part(start, stop), Dropped()
                    decode(first_row + start, first_row + stop, block)
                    if not (is_raw or self.is_active):
                        place = {"first_row": first_row + start, "num_rest": self.num_terms - 1}
                        block, dropped = activate_rows(block, self.encoding, **place, is_logit=self.is_logit)
                    done.append((start, len(block.means), dropped))
            return done

        with ThreadPoolExecutor(num_threads) as pool:
            parts = list(pool.map(work, range(num_threads)))
        kept, dropped = _close_gaps(columns, (block for part in parts for block in part))
        encoding = self.encoding if self.is_logit else replace(self.encoding, opacities="linear")
        if is_raw and not encoding.is_standard:
            kept.standardize(encoding)
        dropped.num_broken += self.num_dropped
        return kept, dropped


def activate_rows(
    rows: Columns,  # raw values, overwritten
    encoding: Encoding,
    *,
    first_row: int,  # row of the file at which they begin, for messages
    num_rest: int,  # f_rest coefficients per channel in the file, for messages
    is_logit: bool,  # as in `RowSource`
) -> tuple[Columns, Dropped]:
    """Convert raw values to scales and opacities. Returns views of the drawable rows, and dropped rows."""
    with np.errstate(all="ignore"):
        rows.standardize(encoding)
        keep, dropped = find_faults(rows, first_row, num_rest)
        if keep is not None:
            rows.move(keep, 0)
        kept = rows.part(0, len(rows.means) - dropped.num_rows)
        kept.activate(is_logit=is_logit)
    return kept, dropped


def _count_threads(num_rows: int) -> int:
    return max(1, min(num_threads_or_default(None), _MAX_THREADS, num_rows // _ROWS_PER_THREAD))


def _close_gaps(columns: Columns, blocks: Iterator[tuple[int, int, Dropped]]) -> tuple[Columns, Dropped]:
    """Move the kept rows of all blocks together, in place because a copy would double the memory."""
    total, dropped = 0, Dropped()
    for start, num_kept, block_dropped in blocks:
        if total < start:
            columns.move(slice(start, start + num_kept), total)
        total += num_kept
        dropped.add(block_dropped)
    return columns.part(0, total), dropped


def decoder_of_parts(
    parts: Sequence[tuple[int, Callable[[], Decoder]]],
) -> Callable[[], AbstractContextManager[Decoder]]:
    """An `open_decoder` for rows in several parts, each given by its number of rows and an opener.

    A part is opened when one of its rows is needed, and stays in memory until another part is opened; threads
    share it.
    """
    ends = list(accumulate(num_rows for num_rows, _ in parts))
    shared: WeakValueDictionary[int, Decoder] = WeakValueDictionary()
    latest: list[Decoder] = []
    lock = Lock()

    def opened(number: int) -> Decoder:
        with lock:
            decode = shared.get(number)
            if decode is None:
                latest.clear()  # free the previous part first
                decode = shared[number] = parts[number][1]()
                latest.append(decode)
            return decode

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        current: tuple[int, Decoder] | None = None

        def decode(start: int, stop: int, out: Columns) -> None:
            nonlocal current
            first = start
            while first < stop:
                number = bisect_right(ends, first)
                begin, last = ends[number] - parts[number][0], min(stop, ends[number])
                if current is None or current[0] != number:
                    current = None
                    current = number, opened(number)
                current[1](first - begin, last - begin, out.part(first - start, last - start))
                first = last

        yield decode

    return open_decoder


@dataclass(frozen=True)
class SceneFile:
    """A scene file whose header was read and is valid.

    `open_rows` opens the rows in the order of the file; it raises a SceneError if the file is damaged. If the
    format has no fixed encoding, it takes the encoding as an optional argument, by default the standard one.
    """

    path: Path  # the file, or the folder of a scene in several files
    format: str  # layout and encoding in words, such as "PLY, binary little-endian"
    num_rows: int  # number of Gaussians, >= 1
    num_terms: int  # stored spherical-harmonic terms of each Gaussian: 1, 4, 9 or 16
    open_rows: Callable[..., RowSource]
    has_fixed_encoding: bool = True  # whether the format defines the encoding
    up: str | None = None  # up axis stated by the file, "+x" to "-z"
    training: Training = "default"  # how the Gaussians were trained, if the file states it
    unknown: tuple[str, ...] = ()  # names of columns or extensions of the file that are not read
    stored: Stored = NOTHING  # what the file records of brushgs strokes and the scene they were made of
    moment: float | None = None  # time of this moment of a moving scene, seconds from its start
    photograph: Camera | None = None  # camera of the photograph from which the scene was predicted

    def read_columns(self, encoding: Encoding = STANDARD, *, is_raw: bool = False) -> tuple[Columns, Dropped]:
        """Read the drawable rows, activated, without bands of spherical harmonics that are zero in every row.

        Args:
            encoding: what the numbers mean; ignored if the format has a fixed encoding.
            is_raw: whether to return all rows and all terms in the standard layout (log-scales and logits),
                neither checked nor activated.

        Returns:
            The rows, and the dropped rows.

        Raises:
            SceneError: if the file is damaged.
        """
        rows = self.open_rows() if self.has_fixed_encoding else self.open_rows(encoding)
        is_counted = rows.count_used is not None and not is_raw
        num_terms = rows.count_used() if rows.count_used is not None and is_counted else rows.num_terms
        columns = Columns.empty(rows.num_rows, num_terms, has_brushes=rows.has_brushes)
        if not rows.has_brushes:
            columns.brushes = self.stored.rows_of_brushes(rows.num_rows)
        columns, dropped = rows.read(columns, is_raw=is_raw)
        if not (is_raw or is_counted):
            drop_zero_bands(columns)
        return self.stored.in_order(columns), dropped


def read_blocks(
    rows: RowSource, start: int, stop: int, block_rows: int = BLOCK_ROWS
) -> Iterator[tuple[Columns, Dropped]]:
    """Read rows `start` to `stop`, `block_rows` at a time; for a sequential source, `start` must be 0.

    Yields the drawable rows, activated, with all bands of spherical harmonics; and the dropped rows.
    Raises SceneError if the file is damaged.
    """
    with _kept_open(rows) as source:
        for first in range(start, stop, block_rows):
            count = min(block_rows, stop - first)
            yield source.read(Columns.empty(count, rows.num_terms), first_row=first)


def sample_rows(rows: RowSource, count: int) -> Columns:
    """About `count` activated rows spread evenly over a file, or the first rows if it is sequential.

    Only spherical-harmonic degree 0 is kept.
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
    """The same rows; for a sequential source, with one decoder that stays open from block to block."""
    if not rows.is_sequential:
        yield rows
        return
    with rows.open_decoder() as decode:
        yield replace(rows, open_decoder=lambda: nullcontext(decode))
