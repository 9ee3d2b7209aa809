"""Connected parts of a scene: Gaussians linked by neighbors within a few of their own sizes.

Independent of the unit and the density of the scene: two Gaussians are linked if the gap between their
centers is at most `REACH` of their sizes along the line between them.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.components import components
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

NUM_NEIGHBOURS = 12
REACH = 2.0  # standard deviations of each of the two: their visible extents meet
FAINTEST = 0.1  # opacity: fainter ones link nothing, and belong to the nearest linked Gaussian
LARGEST = 10.0  # medians of the sizes; larger ones are haze or sky, and would link everything


def connected_parts(gaussians: Gaussians) -> NDArray[np.intp]:
    """[N] number of each Gaussian's connected part, from 0 by descending painted area.

    Args:
        gaussians: N Gaussians.
    """
    num = len(gaussians)
    if num == 0:
        return np.zeros(0, np.intp)
    sizes = gaussians.scales.max(axis=1).astype(np.float64)
    links = (gaussians.opacities >= FAINTEST) & (sizes <= LARGEST * float(np.median(sizes)))
    rows = np.flatnonzero(links) if links.any() else np.arange(num)
    some = gaussians.take(rows)
    groups = _components(some)
    areas = np.bincount(groups, paint_of(some))
    ranks = np.empty(len(areas), np.intp)
    ranks[np.argsort(-areas, kind="stable")] = np.arange(len(areas))
    parts = np.empty(num, np.intp)
    parts[rows] = ranks[groups]
    others = np.setdiff1d(np.arange(num), rows)
    if len(others):
        _, near = nearest(some.means, gaussians.means[others], 1)
        parts[others] = parts[rows[near[:, 0]]]
    return parts


def _components(gaussians: Gaussians) -> NDArray[np.int32]:
    num = len(gaussians)
    count = min(NUM_NEIGHBOURS + 1, num)
    distances, near = nearest(gaussians.means, gaussians.means, count)
    own = np.repeat(np.arange(num), count - 1)
    others, gaps = near[:, 1:].ravel(), distances[:, 1:].ravel()
    lines = gaussians.means[others].astype(np.float64) - gaussians.means[own]
    lines /= np.maximum(gaps, np.finfo(np.float64).tiny)[:, None]
    axes = rotation_matrices(gaussians.quats).astype(np.float64)
    reach = _extents(axes, gaussians.scales, own, lines) + _extents(axes, gaussians.scales, others, lines)
    is_linked = gaps <= REACH * reach
    return components(num, own[is_linked], others[is_linked])


def _extents(axes: F64, scales: Array, rows: NDArray[np.intp], lines: F64) -> F64:
    """Standard deviations of Gaussians along directions: [P] for rows [P] and unit vectors [P, 3]."""
    along = np.einsum("pij,pi->pj", axes[rows], lines)
    return np.asarray(np.linalg.norm(along * scales[rows], axis=1))
