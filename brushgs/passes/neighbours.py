"""Nearest neighbours of points."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from brushgs.arrays import Array
from brushgs.threads import num_threads_or_default

NUM_NEIGHBOURS = 16


def nearest(points: Array, queries: Array, count: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Distances and rows [Q, count] of the points nearest to each query, nearest first."""
    tree = cKDTree(points)
    distances, rows = tree.query(queries, k=range(1, count + 1), workers=num_threads_or_default(None))
    return distances, rows
