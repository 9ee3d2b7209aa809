"""How much a Gaussian adds to pictures of a scene, over all views: opacity x projected area x visible share.

The unit is that of an area; only ratios are used. Memory stays at a few numbers per Gaussian.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array
from brushgs.passes.extent import robust_frame
from brushgs.scene import Gaussians
from brushgs.threads import num_threads_or_default

THOMSEN = 1.6075  # exponent of the surface formula, off by 1.1 % at most
# 7 lines, both ways: the axes and the diagonals of a cube. 13 lines change a picture by under 0.1 dB.
LINES = np.array(
    [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)], dtype=np.float64
)
CELLS = 64  # light columns across the diameter of the scene; 32 and 128 prune no better
REACH = 0.25  # scene radii that must be free: what stands inside a closed room is not hidden by its walls
FARTHEST = 4.0  # scene radii; what lies beyond is looked at from there, so that columns keep their width
LEAST_VISIBLE = 1e-6  # keeps the weights of what is hidden above zero: a cluster may hold nothing else
ALMOST_OPAQUE = 0.99  # the rasteriser's own bound on alpha
ROWS_PER_THREAD = 50_000  # a million: 1.2 s in two threads, 1.6 in one; at 80,000 two save nothing
MOST_THREADS = 4  # each holds some ten numbers per Gaussian while it works


def projected_areas(scales: Array) -> NDArray[np.float64]:
    """Mean area of an ellipsoid's shadow over all directions, divided by pi, [N] float64.

    A convex body's mean shadow is a quarter of its surface (Cauchy); the surface of an ellipsoid is
    4 pi (((ab)^p + (ac)^p + (bc)^p) / 3)^(1/p), p = 1.6075 (Thomsen). A disc of radius 1 gives about 1/2, a
    ball 1: a sum of products such as ab + ac + bc would give 1 and 3.

    Args:
        scales: [N, 3] half axes (standard deviations), any unit.
    """
    a, b, c = (scales[:, axis].astype(np.float64) for axis in range(3))
    longest = np.maximum(np.maximum(a, b), c)
    unit = np.where(longest > 0, longest, 1.0)  # powers of tiny and huge scales stay in range
    a, b, c = a / unit, b / unit, c / unit
    mean = ((a * b) ** THOMSEN + (a * c) ** THOMSEN + (b * c) ** THOMSEN) / 3
    return np.asarray(mean ** (1 / THOMSEN) * unit**2)


def contributions(gaussians: Gaussians, visible: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Opacity x mean projected area x visible share, [N] float64, world units squared over pi.

    Args:
        gaussians: N Gaussians.
        visible: what `visible_shares` says of them, if it is known already.
    """
    shares = visible_shares(gaussians) if visible is None else visible
    return np.asarray(gaussians.opacities * projected_areas(gaussians.scales) * shares)


def visible_shares(gaussians: Gaussians) -> NDArray[np.float64]:
    """Share of directions from which a Gaussian is seen and not hidden by others, [N], above 0 to 1.

    The scene is cut into square columns along each of 7 lines. Along a column every Gaussian dims what lies
    behind it by the share of the column it paints; what reaches a Gaussian from outside through a quarter
    of the scene's radius, from both ends, averaged over the lines, is its share. It is an estimate: a column
    is taken to be painted evenly.

    Args:
        gaussians: N Gaussians.

    Does not depend on the unit or the place of the scene, nor on the order of the rows.
    """
    center, radius = robust_frame(gaussians.means)
    points = np.clip((gaussians.means - center) / radius, -FARTHEST, FARTHEST)
    column = 2.0 / CELLS
    areas = projected_areas(gaussians.scales) / radius**2
    painted = 2 * np.pi * gaussians.opacities * areas / column**2  # 2 pi s^2: integral of the kernel
    depths = -np.log1p(-np.minimum(painted, ALMOST_OPAQUE))  # optical depth
    lines = LINES / np.linalg.norm(LINES, axis=1, keepdims=True)
    num_threads = min(num_threads_or_default(None), MOST_THREADS, len(points) // ROWS_PER_THREAD)
    shares = np.zeros(len(points))
    for light in _in_order(lambda line: _light_along(line, points, depths, column), lines, num_threads):
        shares += light
    return np.asarray(np.maximum(shares / (2 * len(LINES)), LEAST_VISIBLE))


def _in_order(
    work: Callable[[NDArray[np.float64]], NDArray[np.float64]], items: NDArray[np.float64], num_threads: int
) -> Iterator[NDArray[np.float64]]:
    """`map`, in threads if there are to be several: NumPy sorts and searches without the GIL."""
    if num_threads < 2:
        yield from map(work, items)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(num_threads) as pool:
        yield from pool.map(work, items)


def _light_along(
    line: NDArray[np.float64], points: NDArray[np.float64], depths: NDArray[np.float64], column: float
) -> NDArray[np.float64]:
    """What arrives at each point through the column around it, from one end and from the other, 0 to 2."""
    across = np.cross(line, np.eye(3)[np.argmin(np.abs(line))])
    across /= np.linalg.norm(across)
    side = 2 * FARTHEST  # no coordinate along any direction is larger, with room to spare
    row = np.floor((points @ across + side) / column)
    rank = np.floor((points @ np.cross(line, across) + side) / column)
    # One number sorts by column, then by depth; columns lie so far apart that no reach leads to the next.
    place = (row * np.ceil(2 * side / column) + rank) * (3 * side) + (points @ line + side)
    order = np.argsort(
        place
    )  # no need to be stable, which takes four times longer: equals do not dim each other
    place = place[order]
    passed = np.concatenate([[0.0], np.cumsum(depths[order])])
    ahead = np.searchsorted(place, place + REACH, side="right")
    behind = np.searchsorted(place, place - REACH, side="left")
    first, past = np.searchsorted(place, place, side="left"), np.searchsorted(place, place, side="right")
    light = np.empty(len(points))
    light[order] = np.exp(passed[past] - passed[ahead]) + np.exp(passed[behind] - passed[first])
    return light
