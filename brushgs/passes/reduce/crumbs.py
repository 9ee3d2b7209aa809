"""Crumbs: remains of the table below a scanned object.

No photograph saw through the table, so Gaussians below it were not constrained in training: shadow and
reflection of the object, smeared far down. Without the table they are black flecks in the air. They are few
and coarse; their centers lie at the level of the table or below, and they reach lower than anything else.
"""

import numpy as np

from brushgs.cameras.framing import FLAT_ELEVATION, default_elevation
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

HANGS = 0.006  # of the object's height, minimum reach of a crumb below its foot
REACH = 2.0  # standard deviations, visible extent of a Gaussian
SMEARED = 2.0  # medians of all vertical extents, minimum of a smeared Gaussian
SAMPLE = 20_000  # rows of that median
# Standard deviations by which the center of a crumb may lie above the foot: below it are a quarter of its
# paint and more. In the foot of a boot, which ends there, they are a tenth and less.
ABOVE = 0.7
# Gaussians completely below the foot may be a thin leg, with too little paint to be framed. A leg is finer
# than this share of the height, and solid.
COARSE, FAINT = 0.01, 0.1
# Of the paint: more is no crumb, but a part that was not framed. The underside of a koala's ground has 0.08,
# a reflection below a pot 0.04.
MOST = 0.15


def find_crumbs(gaussians: Gaussians, view: FirstView) -> Mask:
    """[N] mask of the crumbs below an object; empty if the scene is not a single object in a void.

    Args:
        gaussians: N Gaussians.
        view: first view of the scene: up axis and subject.
    """
    none = np.zeros(len(gaussians), bool)
    is_flat = default_elevation(view.points, view.up) == FLAT_ELEVATION
    levels = view.points @ view.up
    foot, height = levels.min(), float(np.ptp(levels))
    if view.eye is not None or view.has_surroundings or is_flat or not height > 0:
        return none
    above = (gaussians.means.astype(np.float64) @ view.up - foot) / height
    low = np.flatnonzero(above < ABOVE / height * gaussians.scales.max(axis=1))
    above, low_ones = above[low], gaussians.take(low)
    upright, level = (extent / height for extent in _extents(low_ones, view.up))
    every = slice(None, None, max(1, -(-len(gaussians) // SAMPLE)))
    usual = float(np.median(_extents(gaussians.take(every), view.up)[0])) / height
    hangs = (above < ABOVE * upright) & (above - REACH * upright < -HANGS) & (upright > SMEARED * usual)
    is_below = above + upright < 0
    found = none.copy()
    found[low] = hangs & (~is_below | (level > COARSE) | (low_ones.opacities < FAINT))
    paint = paint_of(gaussians)
    return found if paint[found].sum() <= MOST * paint.sum() else none


def _extents(gaussians: Gaussians, up: F64) -> tuple[F64, F64]:
    """[N] and [N] standard deviations of Gaussians along up, and across it, world units."""
    axes = rotation_matrices(gaussians.quats).astype(np.float64)
    squares = gaussians.scales.astype(np.float64) ** 2
    upright = (np.einsum("nij,i->nj", axes, up) ** 2 * squares).sum(axis=1)
    level = np.maximum(squares.sum(axis=1) - upright, 0)
    return np.sqrt(upright), np.sqrt(0.5 * level)
