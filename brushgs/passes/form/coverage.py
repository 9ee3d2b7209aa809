"""Coverage of each stroke by its nearest neighbors: the share of light that they stop.

A stroke is viewed along its thinnest axis, perpendicular to its surface. Only its nearest neighbors
count, so deep stacks of faint strokes are underestimated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

NUM_NEIGHBORS = 16  # per stroke


@dataclass(frozen=True, eq=False)
class Coverage:
    """Strokes in float64, and the rows of their nearest others.

    Attributes:
        means: [k, 3].
        scales: [k, 3] ascending, as visible in pictures (see `finest`).
        axes: [k, 3, 3] as columns, in the order of the scales.
        sizes: [k] root of the product of the two largest scales, world units.
        neighbors: [k, n] int32, nearest first, n = 16 or k - 1 if that is less.
    """

    means: F64
    scales: F64
    axes: F64
    sizes: F64
    neighbors: NDArray[np.int32]

    @classmethod
    def of(cls, strokes: Gaussians) -> "Coverage":
        """Find the neighbors of k strokes."""
        order = np.argsort(strokes.scales, axis=1)
        seen = seen_scales(strokes.scales, finest_of(strokes))
        scales = np.take_along_axis(seen, order, axis=1)
        axes = np.take_along_axis(rotation_matrices(strokes.quats), order[:, None, :], axis=2)
        means = strokes.means.astype(np.float64)
        sizes = np.sqrt(scales[:, 1]) * np.sqrt(scales[:, 2])
        return cls(means, scales, axes, sizes, nearest_others(means, NUM_NEIGHBORS))

    def passed(self, opacities: F64, rows: Rows | None = None, *, num_others: int = NUM_NEIGHBORS) -> F64:
        """Transmittance of the neighbors at the center of strokes, 0 to 1.

        Args:
            opacities: [k] of each stroke as a neighbor.
            rows: [n] requested strokes; None for all.
            num_others: number of neighbors; more than 16 need another search.

        Returns:
            [n]; 1 without neighbors.
        """
        rows = np.arange(len(self.means)) if rows is None else rows
        passed, _, _ = _core.cover(
            means=self.means,
            scales=self.scales,
            axes=self.axes,
            opacities=opacities,
            rows=rows,
            neighbors=self._neighbors_of(rows, num_others),
            num_touching=0,
            touch=0.0,
            num_threads=num_threads_or_default(None),
        )
        return np.asarray(passed)

    def _neighbors_of(self, rows: Rows, count: int) -> NDArray[np.int32]:
        if count <= NUM_NEIGHBORS:
            return self.neighbors[rows, :count]
        found = nearest(self.means, self.means[rows], min(count + 1, len(self.means)))[1]
        return found.astype(np.int32)


def nearest_others(means: F64, count: int) -> NDArray[np.int32]:
    """Rows [k, n] of the nearest neighbors of each of k points, n = `count`, or k - 1 if that is less."""
    neighbors = np.empty((len(means), max(0, min(count, len(means) - 1))), dtype=np.int32)
    if neighbors.size:
        _core.neighbors(means, neighbors, num_threads_or_default(None))
    return neighbors
