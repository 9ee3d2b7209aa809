"""The even margins around a reproduction: the paper of a scan, a mount, a plain frame."""

import numpy as np

from brushgs.passes.style.averages import averaged
from brushgs.values.arrays import F32, Array

MOST_SIDE = 1024  # pixels of the picture that is examined
EVEN = 0.06  # deviation from its median, 0 to 1, below which 99 % of a row of a margin lie
ALIKE = 0.1  # largest difference between margins at opposite sides, and between rows of one
LEAST = 0.005  # width of a margin, relative to the shorter side
KEPT = 0.3  # share of height and width that a painting has at least


def inside_margins(image: Array) -> tuple[slice, slice]:
    """Rows and columns of a picture without the margins that surround it, one within another.

    A margin has one color and goes all around: a plain sky, or a ground at three sides, is a part of the
    painting.

    Args:
        image: [H, W, C] display-encoded, 0 to 1.
    """
    small = averaged(image, MOST_SIDE)
    height, width = small.shape[:2]
    rows, columns = [0, height], [0, width]
    while widths := _margins(small[slice(*rows), slice(*columns)]):
        # One row more: it is mixed with what the margin surrounds.
        top, bottom, left, right = (one + 1 for one in widths)
        rows, columns = [rows[0] + top, rows[1] - bottom], [columns[0] + left, columns[1] - right]
        if rows[1] - rows[0] < KEPT * height or columns[1] - columns[0] < KEPT * width:
            return slice(0, image.shape[0]), slice(0, image.shape[1])
    step = image.shape[0] // height
    of_rows, of_columns = (
        slice(0, size) if (first, last) == (0, count) else slice(first * step, last * step)
        for (first, last), count, size in zip((rows, columns), (height, width), image.shape[:2], strict=True)
    )
    return of_rows, of_columns


def _margins(box: F32) -> list[int] | None:
    """Widths of the margins at the top, bottom, left and right; None unless there are four."""
    if min(box.shape[:2]) < 2:
        return None
    across = box.transpose(1, 0, 2)
    sides = box, box[::-1], across, across[::-1]
    colors = [np.median(side[0], axis=0) for side in sides]
    if any(np.abs(colors[one] - colors[one + 1]).max() > ALIKE for one in (0, 2)):
        return None
    widths = [_width(side, color) for side, color in zip(sides, colors, strict=True)]
    return widths if min(widths) >= max(LEAST * min(box.shape[:2]), 1) else None


def _width(side: F32, color: F32) -> int:
    """Number of even rows at the beginning that have about this color."""
    for row, pixels in enumerate(side):
        own = np.median(pixels, axis=0)
        if np.abs(own - color).max() > ALIKE or np.quantile(np.abs(pixels - own), 0.99) > EVEN:
            return row
    return len(side)
