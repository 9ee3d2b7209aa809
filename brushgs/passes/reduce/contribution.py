"""Contribution of a Gaussian to pictures of a scene, over all views: opacity x area x visible share.

The unit is an area; only ratios are used. Memory is a few numbers per Gaussian.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.finest import finest_of
from brushgs.values.arrays import Array
from brushgs.values.gaussians import Gaussians


def projected_areas(scales: Array, finest: float = 0.0) -> NDArray[np.float64]:
    """Mean projected area of ellipsoids over all directions, divided by pi, [N] float64.

    The mean projected area of a convex body is a quarter of its surface (Cauchy); the surface of an ellipsoid
    is 4 pi (((ab)^p + (ac)^p + (bc)^p) / 3)^(1/p), p = 1.6075, right to 1.1 % (Thomsen). A disc of radius 1
    gives about 1/2, a ball 1: a sum of products such as ab + ac + bc would give 1 and 3.

    Args:
        scales: [N, 3] half axes (standard deviations), any unit.
        finest: the areas are those of `seen_scales` with this.
    """
    areas = _core.projected_areas(np.ascontiguousarray(scales), finest, num_threads_or_default(None))
    return np.asarray(areas)


def paint_of(gaussians: Gaussians) -> NDArray[np.float64]:
    """[N] the paint of Gaussians: opacity times mean projected area, world units squared over pi."""
    return np.asarray(gaussians.opacities * projected_areas(gaussians.scales))


def seen_areas(gaussians: Gaussians) -> NDArray[np.float64]:
    """`projected_areas` as visible in pictures, see `finest`, [N] float64, world units squared over pi."""
    return projected_areas(gaussians.scales, finest_of(gaussians))


def contributions(gaussians: Gaussians, visible: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Opacity x `seen_areas` x visible share, [N] float64, world units squared over pi.

    Args:
        gaussians: N Gaussians.
        visible: [N] their `visible_shares`, if known.
    """
    areas = seen_areas(gaussians)
    shares = visible_shares(gaussians, areas) if visible is None else visible
    return np.asarray(gaussians.opacities * areas * shares)


def visible_shares(gaussians: Gaussians, areas: NDArray[np.float64] | None = None) -> NDArray[np.float64]:
    """Share of directions from which a Gaussian is not hidden by others, [N], above 0 to 1.

    Along each of 7 lines the scene is divided into square columns. In a column every Gaussian attenuates
    light by the share of the cross-section it covers; the light that reaches a Gaussian through the nearest
    quarter of the scene's radius, from both ends, averaged over the lines, is its share. This is an estimate:
    Gaussians are assumed to cover their column evenly.

    Args:
        gaussians: N Gaussians.
        areas: [N] their `seen_areas`, if known.

    Independent of unit and position of the scene, and of the order of the rows.
    """
    shares = _core.visible_shares(
        np.ascontiguousarray(gaussians.means),
        np.ascontiguousarray(gaussians.opacities),
        seen_areas(gaussians) if areas is None else areas,
        num_threads_or_default(None),
    )
    return np.asarray(shares)
