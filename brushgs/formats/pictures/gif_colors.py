"""The palette of a GIF: chosen from how often each colour occurs in all frames together.

A colour counts by the square root of its area, so that a small red flower keeps its red beside a large wall.
"""

import numpy as np
from numpy.typing import NDArray

_BITS = 5  # of each channel; colours that agree in them are merged before the palette is chosen
_LLOYD_STEPS = 10


class ColorCounts:
    """How often each of the 2^24 colours was seen."""

    def __init__(self) -> None:
        self._counts = np.zeros(1 << 24, np.int32)

    def add(self, pixels: NDArray[np.uint8]) -> None:
        """Count every fourth pixel of a picture, uint8 [H, W, 3]; all of one below 2 x 2."""
        step = 2 if min(pixels.shape[:2]) >= 2 else 1
        red, green, blue = np.moveaxis(pixels[::step, ::step].astype(np.int32), -1, 0)
        colors, counts = np.unique(red << 16 | green << 8 | blue, return_counts=True)
        self._counts[colors] += counts.astype(np.int32)

    def palette(self, num_colors: int) -> NDArray[np.uint8]:
        """[n, 3] at most so many colours that represent all; the most frequent one is among them."""
        seen = np.flatnonzero(self._counts)
        counts = self._counts[seen].astype(np.float64)
        colors = np.stack([seen >> 16, seen >> 8 & 255, seen & 255], axis=1)
        if len(colors) <= num_colors:
            return colors.astype(np.uint8)
        most_frequent = colors[np.argmax(counts)]
        groups = np.unique(colors >> (8 - _BITS), axis=0, return_inverse=True)[1].ravel()
        total = np.bincount(groups, counts)
        points = _sums(groups, colors * counts[:, None], len(total)) / total[:, None]
        chosen = _centers(points, np.sqrt(total), num_colors - 1)
        return np.unique(np.rint([most_frequent, *chosen]).astype(np.uint8), axis=0)


def _centers(
    points: NDArray[np.float64], weights: NDArray[np.float64], num_centers: int
) -> NDArray[np.float64]:
    """[n, 3] cluster centres: the widest group is split until there are enough, then Lloyd steps follow."""
    from scipy.spatial import KDTree

    groups = np.zeros(len(points), np.int64)
    spreads = {0: _spread(points, weights)}
    while len(spreads) < min(num_centers, len(points)):
        widest = max(spreads, key=lambda group: spreads[group][0])
        _, axis, middle = spreads[widest]
        rows = np.flatnonzero(groups == widest)
        groups[rows[points[rows, axis] > middle]] = new = len(spreads)
        for group in (widest, new):
            spreads[group] = _spread(points[groups == group], weights[groups == group])
    for _ in range(_LLOYD_STEPS):
        total = np.bincount(groups, weights, minlength=len(spreads))
        centers = _sums(groups, points * weights[:, None], len(total))[total > 0] / total[total > 0, None]
        groups = KDTree(centers).query(points)[1]
    return np.asarray(centers)


def _spread(points: NDArray[np.float64], weights: NDArray[np.float64]) -> tuple[float, int, float]:
    """The widest axis of a group: its sum of squared distances from the mean, its index, and the mean."""
    means = weights @ points / weights.sum()
    squares = weights @ (points - means) ** 2
    axis = int(np.argmax(squares))
    return float(squares[axis]), axis, float(means[axis])


def _sums(groups: NDArray[np.int64], values: NDArray[np.float64], num_groups: int) -> NDArray[np.float64]:
    """[num_groups, 3] sums of the rows of each group."""
    return np.stack([np.bincount(groups, column, minlength=num_groups) for column in values.T], axis=1)
