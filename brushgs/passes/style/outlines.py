"""Outlines of patches of pixels."""

import numpy as np

from brushgs.values.arrays import F64


def hull_area(u: F64, v: F64) -> float:
    """Area of the convex outline of pixels."""
    from scipy.spatial import ConvexHull

    corners = [np.stack([u + a, v + b], axis=1) for a in (-0.5, 0.5) for b in (-0.5, 0.5)]
    return float(ConvexHull(np.concatenate(corners)).volume)
