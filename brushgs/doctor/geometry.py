"""Robust middle and radius of a scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.extent import robust_frame
from brushgs.values.arrays import Array

# Robust against a tenth of the rows at each end.
CORE_PERCENTILES = (10, 90)


@dataclass(frozen=True)
class Core:
    """Middle [3] and half diagonal of the box of the middle 80 % along each axis, world units."""

    center: NDArray[np.float64]
    radius: float

    @classmethod
    def of(cls, means: Array) -> "Core":
        """The core of points [N, 3]; without extent, the radius is that of `robust_frame`."""
        low, high = np.percentile(means.astype(np.float64), CORE_PERCENTILES, axis=0)
        radius = 0.5 * float(np.linalg.norm(high - low))
        return cls(0.5 * (low + high), radius if radius > 0 else robust_frame(means)[1])

    def distances(self, means: Array) -> NDArray[np.float64]:
        """[N] distances from the middle, in radii."""
        return np.asarray(np.linalg.norm(means - self.center, axis=1) / self.radius)
