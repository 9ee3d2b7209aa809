"""Rows with labels -> the rows of each label, and weighted sums over them, in threads.

Sums run in float64, in row order: equal input gives equal output, bit for bit, for any number of threads.
"""

from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F64, Array


@dataclass(frozen=True, eq=False)
class Groups:
    """The rows of each of k labels.

    Attributes:
        rows: [N] int32 the rows of label 0, of label 1 and so on, each ascending.
        begins: [k + 1] int64, start of the rows of each label.
    """

    rows: NDArray[np.int32]
    begins: NDArray[np.int64]

    @classmethod
    def of(cls, labels: NDArray[np.integer[Any]], num: int) -> "Groups":
        """Groups of labels [N], each 0 to num - 1."""
        return cls(*_core.group_rows(np.ascontiguousarray(labels, np.int32), num))

    @classmethod
    def ascending(cls, begins: NDArray[np.integer[Any]]) -> "Groups":
        """Groups of ascending labels, which begin at `begins` [k + 1]; the last is the number of rows."""
        return cls(np.arange(begins[-1], dtype=np.int32), np.ascontiguousarray(begins, np.int64))

    def __len__(self) -> int:
        return len(self.begins) - 1

    @property
    def firsts(self) -> NDArray[np.int32]:
        """The first row of each label, [k]; every label must have one."""
        return self.rows[self.begins[:-1]]

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Number of rows of each label, [k]."""
        return np.diff(self.begins)

    def sums(self, values: Array, weights: F64, num_threads: int | None = None) -> F64:
        """Sums [k, ...] of weight [N] x value [N, ...] by label; 0 for a label without rows."""
        return self.totals_and_sums(values, weights, num_threads)[1]

    def totals_and_sums(self, values: Array, weights: F64, num_threads: int | None = None) -> tuple[F64, F64]:
        """Sums [k] of the weights, and `sums`."""
        flat = np.ascontiguousarray(values.reshape(len(values), prod(values.shape[1:])))
        threads = num_threads_or_default(num_threads)
        weights = np.ascontiguousarray(weights)
        totals, sums = _core.sum_groups(flat, weights, self.rows, self.begins, threads)
        return totals, sums.reshape(len(self), *values.shape[1:])


def add_rows(totals: F64, rows: NDArray[np.int32], values: Array) -> None:
    """`totals[rows] += values`, also for repeated rows; for 10^6 rows 7 times as fast as NumPy.

    Args:
        totals: [N, ...] C-contiguous, changed in place.
        rows: [n] 0 to N - 1.
        values: [n, ...] float32 or float64.
    """
    assert totals.flags.c_contiguous  # else its reshaped copy would grow
    width = prod(totals.shape[1:])
    _core.add_rows(
        totals.reshape(len(totals), width), rows, np.ascontiguousarray(values.reshape(len(rows), width))
    )


def compacted(labels: NDArray[np.integer[Any]]) -> tuple[NDArray[np.int32], int]:
    """The labels [N], any integers, renumbered from 0 in ascending order, and their number."""
    if not len(labels):
        return np.zeros(0, np.int32), 0
    low, high = int(labels.min()), int(labels.max())
    if high - low > 4 * len(labels):  # too sparse for a table
        used, compact = np.unique(labels, return_inverse=True)
        return compact.astype(np.int32), len(used)
    ranks = np.zeros(high - low + 1, np.int32)
    places = labels - labels.dtype.type(low) if low else labels
    ranks[places] = 1
    num = int(ranks.sum())
    np.cumsum(ranks, out=ranks)
    ranks -= 1
    return ranks[places], num
