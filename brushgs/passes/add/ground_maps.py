"""Square maps of level ground around the foot of a subject."""

from typing import NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.values.arrays import F64


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

    def sums(self, level: F64, values: F64) -> F64:
        """[side, side] sums of values [n] at level points [n, 2]: right and away from the foot."""
        level, values = np.ascontiguousarray(level), np.ascontiguousarray(values, np.float64)
        return np.asarray(_core.map_sums(level, values, self.side, self.half)).reshape(self.side, self.side)

    def samples(self, values: F64, level: F64) -> F64:
        """[n] bilinear samples of [side, side] values at level points [n, 2]; beyond, those at the border."""
        values, level = np.ascontiguousarray(values), np.ascontiguousarray(level)
        return np.asarray(_core.map_samples(values, self.half, level))


def blurred(values: F64, sigma: float) -> F64:
    """A map [h, w] blurred by a Gaussian of `sigma` cells; zero outside."""
    found = _core.map_blurred(np.ascontiguousarray(values, np.float64), sigma)
    return np.asarray(found).reshape(values.shape)
