"""Strokes -> which of them are worth their place in the budget.

Three kinds are not:

- Faint strokes under other paint: they are invisible. A veil also counts as faint: it is a little less faint,
  but far larger than its neighbours.
- Fog: faint strokes where all paint together stops almost no light. As a soft Gaussian it is haze; as a
  stroke it is a pane of glass in the air.
- Specks: strokes, alone or in small groups, that touch nothing else and are not solid.

Detached but solid groups are kept: those of campsite, trees, have a mean opacity of 0.64 to 0.98, the specks
around koala and truck 0.04 to 0.52. A mast or a wire is a chain of touching strokes. Distance alone does not
decide: with a limit of 6 sizes to the sixth neighbor, the posts of the truck and the edge of koala's table
are lost (-0.6 dB).

With other strokes in place of these (`split`, 6000 strokes, eight scenes) PSNR changes by -0.04 to +0.07 dB;
0 to 6 % of the strokes are dropped.
"""

import numpy as np

from brushgs.passes.components import components
from brushgs.passes.form.coverage import NUM_NEIGHBORS, Coverage
from brushgs.passes.reduce.floaters import STRONG
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.gaussians import Gaussians

FAINT = 0.06  # opacity
VEIL, VEIL_SIZE = 0.3, 2.0  # opacity below which, and neighbours' sizes above which, a stroke is a veil
COVERED = 0.7  # share of the light stopped by strokes that are not faint; at 0.5 the chair loses 0.1 dB
# Minimum share of the light stopped by all strokes together, below which they are fog; the second around
# veils. Without fog the chair, trained on white, stands clear; at 0.3 its upholstery, many veils deep, loses
# 0.4 dB.
FOG, VEIL_FOG = 0.12, 0.25
DEEP = 128  # strokes around fog that count: with 16 the chair's upholstery is taken for fog (-1 dB)
TOUCH = 2.0  # standard deviations along the line between two strokes at which they end
FIRM = 0.6  # opacity
SPECK = 2.0  # sum of the opacities of a group; more is a body
MOST_SPECKS = 0.3  # share of the strokes; if more touch nothing, the scene is made so


def worth_keeping(strokes: Gaussians) -> Mask:
    """Mask [k] of the strokes that are worth keeping.

    Opacities are relative to those of the scene: if the 99th percentile is below 0.8, they are scaled up to
    it. So a scene of haze keeps its haze; if all opacities are 0, all strokes are kept.

    Args:
        strokes: k strokes, as merged: not solidified yet.

    Independent of unit and place of the scene, of the order of the rows and of the number of threads.
    """
    opacities = strokes.opacities.astype(np.float64)
    if not opacities.any():
        return np.ones(len(strokes), bool)  # no paint at all
    strong = float(np.percentile(opacities, 99))
    opacities = np.minimum(opacities / max(min(strong / STRONG, 1.0), 1e-6), 1.0)
    around = Coverage.of(strokes)
    kept = ~_unseen(around, opacities)
    kept[kept] = ~_specks(around, opacities, kept)
    return kept


def _unseen(around: Coverage, opacities: F64) -> Mask:
    """Mask of the faint strokes that are covered or fog."""
    usual = np.median(around.sizes[around.neighbors], axis=1) if around.neighbors.size else around.sizes
    is_veil = (opacities < VEIL) & (around.sizes > VEIL_SIZE * usual)
    is_faint = is_veil | (opacities < FAINT)
    least = np.where(is_veil, VEIL_FOG, FOG)
    unseen = np.zeros(len(opacities), bool)
    rows = np.flatnonzero(is_faint)
    unseen[rows] = 1 - around.passed(np.where(is_faint, 0.0, opacities), rows) > COVERED
    rows = np.flatnonzero((opacities < least) & ~unseen)
    for num_others in (NUM_NEIGHBORS, DEEP):  # few need the second, slower search
        stopped = 1 - (1 - opacities[rows]) * around.passed(opacities, rows, num_others=num_others)
        rows = rows[stopped < least[rows]]
    unseen[rows] = True
    return unseen


def _specks(around: Coverage, opacities: F64, kept: Mask) -> Mask:
    """Mask among the strokes `kept` of those in small detached groups that are not solid."""
    if not kept.any():
        return np.zeros(0, bool)
    rows, others = _touching(around, kept)
    places = np.cumsum(kept) - 1
    groups = components(int(kept.sum()), places[rows], places[others])
    counts, sums = np.bincount(groups), np.bincount(groups, opacities[kept])
    specks = ((sums < SPECK) & (sums < FIRM * counts))[groups]
    return np.asarray(specks & (specks.mean() <= MOST_SPECKS))


def _touching(around: Coverage, kept: Mask) -> tuple[Rows, Rows]:
    """Rows of pairs of strokes, both `kept`, that reach each other along the line between them."""
    rows, ranks = np.nonzero(kept[:, None] & kept[around.neighbors])
    others = around.neighbors[rows, ranks].astype(np.intp)
    lines = (around.means[others] - around.means[rows]).T
    # Squares stay in range.
    unit = max(float(around.scales.max()), float(np.abs(lines).max(initial=0)), np.finfo(np.float64).tiny)
    lines /= unit
    factors = around.axes * (around.scales / unit)[:, None, :]
    covars = np.einsum("nij,nkj->ikn", factors, factors)
    xx, xy, xz, yy, yz, zz = (covars[i, j] for i in range(3) for j in range(i, 3))
    x, y, z = lines
    squares = (x * x, 2 * x * y, 2 * x * z, y * y, 2 * y * z, z * z)
    reach = np.zeros(len(rows))
    for ends in (rows, others):
        variance = sum(
            square * covar[ends] for square, covar in zip(squares, (xx, xy, xz, yy, yz, zz), strict=True)
        )
        reach += np.sqrt(np.maximum(variance, 0))
    touches = x * x + y * y + z * z <= TOUCH * reach  # both sides times the distance
    return rows[touches], others[touches]
