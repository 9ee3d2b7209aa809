"""Rows that are equal in all columns given, found by a 64-bit hash of their bits; and that hash."""

from math import prod

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import Array


def equal_rows(*columns: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first row of each group of equal rows, ascending, and for each row the index of its group.

    Different rows share a hash once in some 1e19 pairs: not in any scene that fits on a disk.
    """
    first, groups = _core.group_equal(row_hashes(*columns), num_threads_or_default(None))
    return np.asarray(first), np.asarray(groups)


def row_hashes(*columns: Array) -> NDArray[np.uint64]:
    """A hash [N] of the bits of each row of columns [N, ...], taken as float32; 0 and -0 are the same."""
    hashes, place = np.zeros(len(columns[0]), np.uint64), 1
    for column in columns:
        flat = column.reshape(len(column), prod(column.shape[1:]))
        _core.hash_rows(np.ascontiguousarray(flat, np.float32), place, hashes)
        place += flat.shape[1]
    return hashes


def chances(places: Array, seed: int, draw: int) -> NDArray[np.float64]:
    """[N] uniform random numbers in [0, 1), one for each position: a hash of position and seed.

    Passes that must be independent use different draws: broken color 0 to 3, the choice of brushes 4, styles
    5 and 6.
    """
    return np.asarray(_core.chances(row_hashes(places), seed, draw))
