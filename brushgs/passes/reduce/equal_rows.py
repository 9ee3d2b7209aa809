"""Rows that are equal in all columns given, found by a 64-bit hash of their bits; and that hash."""

from math import prod

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Array
from brushgs.values.hashing import GOLDEN, uniform


def equal_rows(*columns: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The first row of each group of equal rows, ascending, and for each row the index of its group.

    Different rows share a hash once in some 1e19 pairs: not in any scene that fits on a disk.
    """
    if not len(columns[0]):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    _, first, groups = np.unique(row_hashes(*columns), return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[groups.reshape(-1)]


def row_hashes(*columns: Array) -> NDArray[np.uint64]:
    """A hash [N] of the bits of each row of columns [N, ...], taken as float32; 0 and -0 are the same."""
    hashes = np.zeros(len(columns[0]), np.uint64)
    flat = [values for column in columns for values in column.reshape(len(column), prod(column.shape[1:])).T]
    for place, values in enumerate(flat, 1):
        bits = (values.astype(np.float32) + np.float32(0)).view(np.uint32)  # -0 is 0
        mixed = (bits.astype(np.uint64) + np.uint64(place * GOLDEN % 2**64)) * np.uint64(GOLDEN)
        hashes = (hashes ^ mixed ^ (mixed >> np.uint64(29))) * np.uint64(GOLDEN)
        hashes ^= hashes >> np.uint64(32)
    return hashes


def chances(places: Array, seed: int, draw: int) -> NDArray[np.float64]:
    """[N] uniform random numbers in [0, 1), one for each position: a hash of position and seed.

    Passes that must be independent use different draws: broken color 0 to 3, the choice of brushes 4, styles
    5 and 6.
    """
    states = (row_hashes(places) ^ np.uint64(seed * GOLDEN % 2**64)) + np.uint64((draw + 1) * GOLDEN % 2**64)
    return uniform(states)
