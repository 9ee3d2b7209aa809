"""The columns of a scene while a file is read into them.

Blocks of a file are decoded into their place in the finished columns, by several threads for large
files. What a block holds is checked while it lies in the cache; rows that cannot be drawn leave gaps,
which are closed in place at the end, so that a scene never lies in memory twice.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F32
from brushgs.io.scenes.dropped import Dropped, drop_faults
from brushgs.io.scenes.encoding import STANDARD, Encoding
from brushgs.scene import Gaussians
from brushgs.threads import num_threads_or_default

_ROWS_PER_THREAD = 100_000  # below this, a thread costs more than it brings
_MAX_THREADS = 4  # more only wait for memory


@dataclass
class Columns:
    """Arrays to be filled; scales and opacities hold logs and logits until `activate`."""

    means: F32  # [n, 3]
    quats: F32  # [n, 4]
    scales: F32  # [n, 3]
    opacities: F32  # [n]
    sh: F32  # [n, k, 3]

    @classmethod
    def empty(cls, num_rows: int, num_terms: int) -> "Columns":
        """Columns for so many rows, not yet written to."""
        shapes = (3,), (4,), (3,), (), (num_terms, 3)
        return cls(*(np.empty((num_rows, *shape), np.float32) for shape in shapes))

    def part(self, start: int, stop: int) -> "Columns":
        """Rows `start` to `stop` as views."""
        return Columns(*(getattr(self, field.name)[start:stop] for field in fields(self)))

    def move(self, rows: NDArray[np.bool_] | slice, start: int) -> None:
        """Copy the rows chosen to `start` and after."""
        for field in fields(self):
            column = getattr(self, field.name)
            chosen = column[rows]
            column[start : start + len(chosen)] = chosen

    def activate(self, *, is_logit: bool) -> None:
        """Turn log-scales into scales and logits into opacities, in place.

        1 / (1 + exp(-x)) is sound at both ends: an exp that overflows gives 0, infinity gives 1.
        """
        np.exp(self.scales, out=self.scales)
        if is_logit:
            np.negative(self.opacities, out=self.opacities)
            np.exp(self.opacities, out=self.opacities)
            self.opacities += 1
            np.reciprocal(self.opacities, out=self.opacities)

    def gaussians(self) -> Gaussians:
        """The finished scene, without a copy."""
        return Gaussians(self.means, self.quats, self.scales, self.opacities, self.sh)


Decoder = Callable[[int, int, Columns], None]  # (start, stop, where to write raw values)


def fill(
    columns: Columns,
    open_decoder: Callable[[], AbstractContextManager[Decoder]],
    *,
    block_rows: int,
    num_rest: int,
    is_sequential: bool,
    is_logit: bool,
    encoding: Encoding = STANDARD,
    is_raw: bool = False,
) -> tuple[Columns, Dropped]:
    """Fill columns block by block; the result does not depend on the number of threads.

    Args:
        columns: as many rows as the file has.
        open_decoder: gives a function that decodes rows `start` to `stop` of the file into the
            columns handed to it; called once per thread, with floating-point warnings off.
        block_rows: rows decoded at a time.
        num_rest: f_rest coefficients per channel in the file, for the names of columns.
        is_sequential: the decoder must be called in order, so by one thread.
        is_logit: opacities come as logits, not as they are.
        encoding: what the raw values are.
        is_raw: whether all rows are wanted as the file has them: nothing is checked, left out or decoded.

    Returns:
        The rows that can be drawn, in order, as views of `columns`, and what was left out.
    """
    from concurrent.futures import ThreadPoolExecutor

    num_rows = len(columns.means)
    num_threads = 1 if is_sequential else _count_threads(num_rows)
    blocks_per_thread = -(-num_rows // (num_threads * block_rows))

    def work(part: int) -> list[tuple[int, int, Dropped]]:
        first = part * blocks_per_thread * block_rows
        last = min(first + blocks_per_thread * block_rows, num_rows)
        done = []
        # Values beyond float32 become infinity and NaN stays NaN: both are looked for below.
        with np.errstate(all="ignore"), open_decoder() as decode:
            for start in range(first, last, block_rows):
                stop = min(start + block_rows, last)
                block = columns.part(start, stop)
                decode(start, stop, block)
                if is_raw:
                    done.append((start, stop - start, Dropped()))
                    continue
                if not encoding.is_standard:
                    encoding.standardize(block)
                dropped = drop_faults(block, start, num_rest)
                kept = stop - start - dropped.num_rows
                block.part(0, kept).activate(is_logit=is_logit)
                done.append((start, kept, dropped))
        return done

    with ThreadPoolExecutor(num_threads) as pool:
        parts = list(pool.map(work, range(num_threads)))
    return _close_gaps(columns, (block for part in parts for block in part))


def _count_threads(num_rows: int) -> int:
    return max(1, min(num_threads_or_default(None), _MAX_THREADS, num_rows // _ROWS_PER_THREAD))


def _close_gaps(columns: Columns, blocks: Iterator[tuple[int, int, Dropped]]) -> tuple[Columns, Dropped]:
    """Move the rows kept of each block together, in place: a copy of the scene would double its memory."""
    total, dropped = 0, Dropped()
    for start, kept, lost in blocks:
        if total < start:
            columns.move(slice(start, start + kept), total)
        total += kept
        dropped.add(lost)
    return columns.part(0, total), dropped
