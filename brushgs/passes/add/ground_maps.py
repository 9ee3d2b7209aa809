"""Square maps of level ground around the foot of a subject."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from brushgs.values.arrays import F64, gaussian_weights


class Grid(NamedTuple):
    """Cells of level ground.

    Attributes:
        side: cells along each side.
        half: half a side, world units.
    """

    side: int
    half: float

    @property
    def cell(self) -> float:
        """Width of a cell, world units."""
        return 2 * self.half / self.side

    def cells(self, level: F64) -> F64:
        """[n, 2] fractional cells of level points [n, 2]: right and away from the foot."""
        return (level / self.half + 1) * (self.side / 2)

    def sums(self, level: F64, values: F64) -> F64:
        """[side, side] sums of values [n] at level points [n, 2]."""
        cells = np.floor(self.cells(level)).astype(np.int64)
        inside = ((cells >= 0) & (cells < self.side)).all(axis=1)
        flat = np.bincount(cells[inside] @ (self.side, 1), values[inside], self.side**2)
        return np.asarray(flat.reshape(self.side, self.side), np.float64)

    def samples(self, values: F64, level: F64) -> F64:
        """[n] bilinear samples of [side, side] values at level points [n, 2]; beyond, those at the border."""
        at = np.clip(self.cells(level) - 0.5, 0, self.side - 1)
        low = np.minimum(at.astype(np.int64), self.side - 2)
        (row, column), (down, across) = low.T, (at - low).T
        upper = values[row, column] * (1 - across) + values[row, column + 1] * across
        lower = values[row + 1, column] * (1 - across) + values[row + 1, column + 1] * across
        return np.asarray(upper * (1 - down) + lower * down)


def blurred(values: F64, sigma: float) -> F64:
    """A map [h, w] blurred by a Gaussian of `sigma` cells; zero outside.

    As matrix products: the import of scipy.ndimage takes 0.6 s, more than a whole stage.
    """
    height, width = values.shape
    return np.asarray(_weights(height, sigma) @ values @ _weights(width, sigma))


@lru_cache(maxsize=8)
def _weights(count: int, sigma: float) -> F64:
    """[count, count] weight of each cell at each other cell."""
    weights = gaussian_weights(count, sigma)
    return np.asarray(weights / weights.sum(axis=1).max())
