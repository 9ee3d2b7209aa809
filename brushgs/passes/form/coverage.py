"""Strokes and the nearest others of each: how much of the light the paint around a stroke stops.

A stroke is looked at along its thinnest axis, as the surface that it lies on is seen (see `gaps`). Only its
nearest others count, so where more faint strokes than that lie over each other, less is found than there is.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.form.gaps import squared_distances
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

NUM_NEIGHBORS = 16  # that are found for every stroke
ROWS_AT_A_TIME = 1 << 15  # in memory


@dataclass(frozen=True, eq=False)
class Coverage:
    """Strokes in float64, and the rows of their nearest others.

    Attributes:
        means: [k, 3].
        scales: [k, 3] ascending, as pictures show them (see `finest`).
        axes: [k, 3, 3] as columns, in the order of the scales.
        sizes: [k] root of the product of the two largest scales, world units.
        neighbors: [k, n] int32, nearest first, n = 16 or k - 1 where that is less.
    """

    means: F64
    scales: F64
    axes: F64
    sizes: F64
    neighbors: NDArray[np.int32]

    @classmethod
    def of(cls, strokes: Gaussians) -> "Coverage":
        """Find the neighbours of k strokes."""
        order = np.argsort(strokes.scales, axis=1)
        seen = seen_scales(strokes.scales, finest_of(strokes))
        scales = np.take_along_axis(seen, order, axis=1).astype(np.float64)
        axes = np.take_along_axis(rotation_matrices(strokes.quats), order[:, None, :], axis=2)
        means = strokes.means.astype(np.float64)
        sizes = np.sqrt(scales[:, 1]) * np.sqrt(scales[:, 2])
        return cls(means, scales, axes, sizes, nearest_others(means, NUM_NEIGHBORS))

    def passed(self, opacities: F64, rows: Rows | None = None, *, num_others: int = NUM_NEIGHBORS) -> F64:
        """Share of the light at the centre of strokes that their neighbours let through, 0 to 1.

        Args:
            opacities: [k] with which each stroke counts as a neighbour.
            rows: [n] of the strokes asked for; None for all.
            num_others: how many neighbours count; more than 16 take another search.

        Returns:
            [n]; 1 where there is no neighbour.
        """
        rows = np.arange(len(self.means)) if rows is None else rows
        passed = np.ones(len(rows))
        for first in range(0, len(rows), ROWS_AT_A_TIME):
            part = slice(first, first + ROWS_AT_A_TIME)
            for others in self._neighbors_of(rows[part], num_others).T:
                away = squared_distances(rows[part], others, self.means, self.scales, self.axes)
                stopped = opacities[others] * np.exp(-0.5 * away)
                passed[part] *= np.where(others == rows[part], 1.0, 1 - stopped)
        return passed

    def _neighbors_of(self, rows: Rows, count: int) -> NDArray[np.integer[Any]]:
        if count <= NUM_NEIGHBORS:
            return self.neighbors[rows, :count]
        return nearest(self.means, self.means[rows], min(count + 1, len(self.means)))[1]


def nearest_others(means: F64, count: int) -> NDArray[np.int32]:
    """Rows [k, n] of the others nearest to each of k points, n = `count`, or k - 1 where that is less."""
    neighbors = np.empty((len(means), max(0, min(count, len(means) - 1))), dtype=np.int32)
    if neighbors.size:
        _core.neighbors(means, neighbors, num_threads_or_default(None))
    return neighbors
