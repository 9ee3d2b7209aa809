"""Scenes that are stored in several parts, one after the other, are read into one set of columns."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped

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
