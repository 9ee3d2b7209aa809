"""Contribution of a Gaussian to pictures of a scene, over all views: opacity x area x visible share.

The unit is an area; only ratios are used. Memory is a few numbers per Gaussian.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import in_turn, num_threads_or_default
from brushgs.passes.extent import robust_frame
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.reduce.morton import morton_order
from brushgs.passes.row_blocks import blocks_of
from brushgs.values.arrays import Array
from brushgs.values.gaussians import Gaussians

# 7 lines, in both directions: axes and space diagonals of a cube. 13 lines change a picture by under 0.1 dB.
LINES = np.array(
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)], dtype=np.float64
)
CELLS = 64  # columns across the diameter of the scene; 32 and 128 prune no better
REACH = 0.25  # scene radii within which occluders count: the walls of a room do not hide objects in it
FARTHEST = 4.0  # scene radii; positions beyond are clipped, so that columns keep their width
LEAST_VISIBLE = 1e-6  # weights stay above zero: a cluster may consist of hidden Gaussians
ALMOST_OPAQUE = 0.99  # the rasteriser's limit on alpha
ROWS_PER_THREAD = 50_000  # at 80,000 two threads save nothing
MOST_THREADS = 4  # each holds some ten numbers per Gaussian while it works


def projected_areas(scales: Array) -> NDArray[np.float64]:
    """Mean projected area of ellipsoids over all directions, divided by pi, [N] float64.

    The mean projected area of a convex body is a quarter of its surface (Cauchy); the surface of an ellipsoid
    is 4 pi (((ab)^p + (ac)^p + (bc)^p) / 3)^(1/p), p = 1.6075, right to 1.1 % (Thomsen). A disc of radius 1
    gives about 1/2, a ball 1: a sum of products such as ab + ac + bc would give 1 and 3.

    Args:
        scales: [N, 3] half axes (standard deviations), any unit.
    """
    return np.asarray(_core.projected_areas(np.ascontiguousarray(scales), num_threads_or_default(None)))


def paint_of(gaussians: Gaussians) -> NDArray[np.float64]:
    """[N] the paint of Gaussians: opacity times mean projected area, world units squared over pi."""
    return np.asarray(gaussians.opacities * projected_areas(gaussians.scales))


def seen_areas(gaussians: Gaussians) -> NDArray[np.float64]:
    """`projected_areas` as visible in pictures, see `finest`, [N] float64, world units squared over pi."""
    return projected_areas(seen_scales(gaussians.scales, finest_of(gaussians)))


def contributions(gaussians: Gaussians, visible: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Opacity x `seen_areas` x visible share, [N] float64, world units squared over pi.

    Args:
        gaussians: N Gaussians.
        visible: [N] their `visible_shares`, if known.
    """
    shares = visible_shares(gaussians) if visible is None else visible
    return np.asarray(gaussians.opacities * seen_areas(gaussians) * shares)


def visible_shares(gaussians: Gaussians) -> NDArray[np.float64]:
    """Share of directions from which a Gaussian is not hidden by others, [N], above 0 to 1.

    Along each of 7 lines the scene is divided into square columns. In a column every Gaussian attenuates
    light by the share of the cross-section it covers; the light that reaches a Gaussian through the nearest
    quarter of the scene's radius, from both ends, averaged over the lines, is its share. This is an estimate:
    Gaussians are assumed to cover their column evenly.

    Args:
        gaussians: N Gaussians.

    Independent of unit and position of the scene, and of the order of the rows.
    """
    center, radius = robust_frame(gaussians.means)
    points = np.clip((gaussians.means - center) / radius, -FARTHEST, FARTHEST)
    column = 2.0 / CELLS
    areas = seen_areas(gaussians) / radius**2
    painted = 2 * np.pi * gaussians.opacities * areas / column**2  # 2 pi s^2: integral of the kernel
    depths = -np.log1p(-np.minimum(painted, ALMOST_OPAQUE))  # optical depth
    lines = LINES / np.linalg.norm(LINES, axis=1, keepdims=True)
    if len(points) == 0:
        return np.zeros(0)
    # Neighbours in memory too: of six million points each line then takes a third of the time.
    order = morton_order(points)
    points, depths = points[order], depths[order]
    light = np.zeros(len(points))
    at_once = min(MOST_THREADS, len(points) // ROWS_PER_THREAD)
    for one in in_turn(lambda line: _light_along(line, points, depths, column), lines, at_once=at_once):
        light += one
    shares = np.empty(len(points))
    shares[order] = light / (2 * len(LINES))
    return np.maximum(shares, LEAST_VISIBLE, out=shares)


def _light_along(
    line: NDArray[np.float64], points: NDArray[np.float64], depths: NDArray[np.float64], column: float
) -> NDArray[np.float64]:
    """Light that reaches each point along its column, from one end plus from the other, 0 to 2."""
    across = np.cross(line, np.eye(3)[np.argmin(np.abs(line))])
    across /= np.linalg.norm(across)
    beside = np.cross(line, across)
    side = 2 * FARTHEST  # above any coordinate along any direction
    place = np.empty(len(points))
    for rows in blocks_of(len(points)):
        some = points[rows]
        row = np.floor((some @ across + side) / column)
        rank = np.floor((some @ beside + side) / column)
        # One number sorts by column, then by depth; columns are further apart than REACH.
        place[rows] = (row * np.ceil(2 * side / column) + rank) * (3 * side) + (some @ line + side)
    from_above, from_below = np.empty((2, len(points)))
    _core.light_along(place, depths, REACH, from_above, from_below)
    np.exp(from_above, out=from_above)
    return np.add(from_above, np.exp(from_below, out=from_below), out=from_above)
