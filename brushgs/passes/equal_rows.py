"""Rows that are equal in all columns given, found by a 64-bit hash of their bits; and that hash."""

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array

_ODD = 0x9E3779B97F4A7C15  # 2^64 over the golden ratio: its multiples are distributed evenly


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
    flat = [values for column in columns for values in column.reshape(len(column), -1).T]
    for place, values in enumerate(flat, 1):
        bits = (values.astype(np.float32) + np.float32(0)).view(np.uint32)  # -0 is 0
        mixed = (bits.astype(np.uint64) + np.uint64(place * _ODD % 2**64)) * np.uint64(_ODD)
        hashes = (hashes ^ mixed ^ (mixed >> np.uint64(29))) * np.uint64(_ODD)
        hashes ^= hashes >> np.uint64(32)
    return hashes
