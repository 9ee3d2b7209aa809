"""Center and radius of a scene, robust against outliers."""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import Array


def robust_frame(means: Array) -> tuple[NDArray[np.float64], float]:
    """Center [3] and radius of the box that holds 98 % of the points along each axis, world units.

    Args:
        means: [N, 3] points, float32 or float64.

    Returns:
        The middle of the 1st and 99th percentiles, and half the diagonal between them. If that is zero,
        the box of all points is used, and a radius of 1 if that is zero too: the radius is always > 0.
    """
    center, radius = _core.robust_extent(np.ascontiguousarray(means), num_threads_or_default(None))
    return np.asarray(center), float(radius)
