"""Parts attached to the middle of an object: thin legs and tips that opacity quantiles miss."""

import numpy as np

from brushgs.core.native import core as _core
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians


def with_attached(gaussians: Gaussians, points: F64) -> F64:
    """Points of the middle of an object, with centers of Gaussians connected to their box by filled voxels.

    A voxel counts as filled if its paint covers 0.06 of its side: the legs of the chair (opacity 0.07) have
    0.1; its floaters are reached below 0.03.

    Args:
        gaussians: N Gaussians.
        points: [n, 3] centers of the middle.

    Returns:
        [n or more, 3].
    """
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    rows = _core.attached_rows(**gaussians.columns(), low=low, high=high)
    return np.concatenate([points, gaussians.means[rows].astype(np.float64)])
