"""The hull of a subject: its size, and the points inside."""

import numpy as np

from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import FirstView


def size_of(view: FirstView) -> float:
    """The longest distance between two points of the subject, world units, > 0."""
    points = view.points
    lengths = np.linalg.norm(points[:, None] - points, axis=2)
    return max(float(lengths.max()), float(np.finfo(np.float64).tiny))


def in_hull(points: Array, corners: F64, margin: float) -> Mask:
    """[N] which points [N, 3] lie within a margin of the convex hull of others [m, 3]."""
    from scipy.spatial import ConvexHull, QhullError

    places = points.astype(np.float64)
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    inside = ((places >= low) & (places <= high)).all(axis=1)
    try:
        planes = ConvexHull(corners).equations
    except (QhullError, ValueError):  # flat, a line or a point: use its box
        return np.asarray(inside)
    rows = np.flatnonzero(inside)
    inside[rows] = (places[rows] @ planes[:, :3].T + planes[:, 3]).max(axis=1) <= margin
    return np.asarray(inside)
