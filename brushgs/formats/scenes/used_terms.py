"""Bands of spherical harmonics that are zero in every row are not loaded, which changes no picture."""

from collections.abc import Callable

import numpy as np

from brushgs.formats.scenes.columns import Columns

_BLOCK_ROWS = 1 << 14


def find_used_terms(num_terms: int, num_rows: int, is_used: Callable[[int, int, slice], bool]) -> int:
    """The number of terms up to the highest band that is not zero in every row.

    Args:
        num_terms: terms that are stored, 1, 4, 9 or 16.
        num_rows: rows that are stored.
        is_used: whether any of the terms `start` to `stop` is not zero in some rows; asked for blocks of rows
            until the answer is known, for most scenes once.
    """
    for degree in (3, 2, 1):
        start, stop = degree**2, (degree + 1) ** 2
        if stop <= num_terms and any(
            is_used(start, stop, slice(first, first + _BLOCK_ROWS))
            for first in range(0, num_rows, _BLOCK_ROWS)
        ):
            return stop
    return 1


def drop_zero_bands(columns: Columns) -> None:
    """Drop the highest bands that are zero in every row, for formats where only decoding shows it."""
    used = find_used_terms(
        columns.sh.shape[1],
        len(columns.sh),
        lambda start, stop, rows: bool(columns.sh[rows, start:stop].any()),
    )
    columns.sh = np.ascontiguousarray(columns.sh[:, :used])
