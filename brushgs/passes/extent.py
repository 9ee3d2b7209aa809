"""Centre and radius of a scene, robust against outliers."""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import in_turn
from brushgs.values.arrays import Array

ROWS_FOR_THREADS = 200_000  # with fewer, starting threads costs as much as it saves


def robust_frame(means: Array) -> tuple[NDArray[np.float64], float]:
    """Centre [3] and radius of the box that holds 98 % of the points along each axis, world units.

    Args:
        means: [N, 3] points.

    Returns:
        The middle of the 1st and 99th percentiles, and half the diagonal between them. If that is zero,
        the box of all points is used, and a radius of 1 if that is zero too: the radius is always > 0.
    """
    if len(means) == 0:
        return np.zeros(3), 1.0
    ends = in_turn(
        lambda axis: np.percentile(means[:, axis].astype(np.float64), (1, 99)),
        range(3),
        at_once=3 if len(means) > ROWS_FOR_THREADS else 1,
    )
    low, high = np.stack(list(ends), axis=1)
    radius = 0.5 * float(np.linalg.norm(high - low))
    if radius > 0:
        return 0.5 * (low + high), radius
    low, high = means.min(axis=0).astype(np.float64), means.max(axis=0).astype(np.float64)
    radius = 0.5 * float(np.linalg.norm(high - low))
    return 0.5 * (low + high), radius if radius > 0 else 1.0
