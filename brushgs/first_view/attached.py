"""Parts attached to the middle of an object: thin legs and tips that opacity quantiles miss."""

import numpy as np

from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

VOXELS = 48  # along the diagonal of the middle
FARTHEST = 0.35  # longest reach of a tip, in longest sides of the middle
LARGEST = 0.05  # diagonals; larger Gaussians are haze
# Painted area over the area of a voxel's side from which a voxel counts as filled, and the largest
# contribution of one Gaussian. The legs of the chair (opacity 0.07) have 0.1; its floaters are reached below
# 0.03.
FILLED, MOST_OF_ONE = 0.06, 0.05


def with_attached(gaussians: Gaussians, points: F64) -> F64:
    """Points of the middle of an object, with centers of Gaussians connected to their box by filled voxels.

    Args:
        gaussians: N Gaussians.
        points: [n, 3] centers of the middle.

    Returns:
        [n or more, 3].
    """
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    if not size > 0:
        return points
    border, voxel = FARTHEST * float((high - low).max()), size / VOXELS
    origin = low - border
    is_near = gaussians.scales.max(axis=1) < LARGEST * size
    is_inside = np.ones(len(gaussians), bool)
    for axis in range(3):
        column = gaussians.means[:, axis]
        is_near &= (column >= origin[axis]) & (column <= high[axis] + border)
        is_inside &= (column >= low[axis]) & (column <= high[axis])
    rows = np.flatnonzero(is_near & ~is_inside)
    if len(rows) == 0:
        return points
    means = gaussians.means[rows].astype(np.float64)
    shape = tuple(np.floor((high - low + 2 * border) / voxel).astype(int) + 1)
    cells = np.minimum(np.floor((means - origin) / voxel).astype(int), np.array(shape) - 1)
    keys = np.ravel_multi_index(tuple(cells.T), shape)
    painted = 2 * np.pi * gaussians.opacities[rows] * projected_areas(gaussians.scales[rows]) / voxel**2
    filled = np.bincount(keys, np.minimum(painted, MOST_OF_ONE), int(np.prod(shape))).reshape(shape) >= FILLED
    first, last = (np.floor((corner - origin) / voxel).astype(int) for corner in (low, high))
    middle = np.zeros(shape, bool)
    middle[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))] = True
    is_attached = _grown(middle, filled | middle).ravel()[keys]
    return np.concatenate([points, means[is_attached]])


def _grown(seed: np.ndarray, within: np.ndarray) -> np.ndarray:
    """The voxels of a mask that can be reached from a seed over faces, edges and corners."""
    reached = seed
    while True:
        wider = reached.copy()
        for axis in range(3):
            along, before = np.moveaxis(wider, axis, 0), np.moveaxis(wider.copy(), axis, 0)
            along[1:] |= before[:-1]
            along[:-1] |= before[1:]
        wider &= within
        if np.array_equal(wider, reached):
            return reached
        reached = wider
