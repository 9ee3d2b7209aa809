"""Robust middle and radius of a scene, and nearest neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from brushgs.arrays import Array
from brushgs.passes.extent import robust_frame
from brushgs.threads import num_threads_or_default

# A tenth of the rows at each end may lie anywhere without changing the core.
CORE_PERCENTILES = (10, 90)
NUM_NEIGHBOURS = 16


@dataclass(frozen=True)
class Core:
    """Middle [3] and half diagonal of the box of the middle 80 % along each axis, world units."""

    center: NDArray[np.float64]
    radius: float

    @classmethod
    def of(cls, means: Array) -> "Core":
        """The core of points [N, 3]; where it has no extent, the radius is that of `robust_frame`."""
        low, high = np.percentile(means.astype(np.float64), CORE_PERCENTILES, axis=0)
        radius = 0.5 * float(np.linalg.norm(high - low))
        return cls(0.5 * (low + high), radius if radius > 0 else robust_frame(means)[1])

    def distances(self, means: Array) -> NDArray[np.float64]:
        """[N] distances from the middle, in radii."""
        return np.asarray(np.linalg.norm(means - self.center, axis=1) / self.radius)


def nearest(points: Array, queries: Array, count: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distances and rows [Q, count] of the points nearest to each query, nearest first."""
    tree = cKDTree(points)
    distances, rows = tree.query(queries, k=range(1, count + 1), workers=num_threads_or_default(None))
    return distances, rows
