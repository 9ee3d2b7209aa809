"""Trace areas of a picture as closed polygons, by marching squares (Lorensen and Cline 1987)."""

import numpy as np

from brushgs.values.arrays import F64, Array

# For each of the 16 cases of a square (bit k: corner k is inside; corners go round from the upper left), the
# sides that its lines lead from and to, with the inside on their right: 0 top, 1 right, 2 bottom, 3 left.
_LINES = (
    *((), ((3, 0),), ((0, 1),), ((3, 1),), ((1, 2),), ((3, 0), (1, 2)), ((0, 2),), ((3, 2),)),
    *(((2, 3),), ((2, 0),), ((0, 1), (2, 3)), ((2, 1),), ((1, 3),), ((1, 0),), ((0, 3),), ()),
)


def outlines(values: Array, level: float = 0.5) -> F64:
    """The outlines of the areas where values are above a level.

    Args:
        values: [H, W] of the pixels; 0 is assumed outside.
        level: above 0.

    Returns:
        [K, 2] (x, y) in pixels, (0, 0) is the upper left corner of the picture: closed polygons, separated by
        NaN and filled by the even-odd rule.
    """
    padded = np.pad(values.astype(np.float64), 1)
    inside = padded > level
    corners = inside[:-1, :-1], inside[:-1, 1:], inside[1:, 1:], inside[1:, :-1]
    cases = np.sum([corner.astype(np.int64) << k for k, corner in enumerate(corners)], axis=0)
    follows: dict[tuple[int, int, int], tuple[int, int, int]] = {}
    for case, lines in enumerate(_LINES):
        rows, columns = np.nonzero(cases == case)
        for begin, end in lines:
            for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
                follows[_side(row, column, begin)] = _side(row, column, end)
    found: list[F64] = []
    while follows:
        first, at = follows.popitem()
        loop = [first]
        while at != first:
            loop.append(at)
            at = follows.pop(at)
        found += [_places(np.array(loop), padded, level), np.full((1, 2), np.nan)]
    return np.concatenate(found[:-1]) if found else np.empty((0, 2))


def _side(row: int, column: int, side: int) -> tuple[int, int, int]:
    """Key of a side, shared by adjacent squares: row and column where it starts, and 1 if it goes down."""
    return row + (side == 2), column + (side == 1), side % 2


def _places(sides: Array, padded: F64, level: float) -> F64:
    """[K, 2] where the level crosses sides [K, 3]."""
    rows, columns, leads_down = sides.T
    start, end = padded[rows, columns], padded[rows + leads_down, columns + 1 - leads_down]
    share = (level - start) / (end - start)
    # The center of pixel (0, 0) is at (0.5, 0.5), and the padding moves it by one.
    return np.stack([columns + share * (1 - leads_down) - 0.5, rows + share * leads_down - 0.5], axis=1)
