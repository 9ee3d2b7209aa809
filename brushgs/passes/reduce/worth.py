"""Strokes -> which of them are worth their place in the budget.

Three kinds are not:

- Faint ones where other paint covers: nobody sees them. A stroke is also faint if it is a veil, not quite as
  faint but far larger than what lies around it.
- Fog: faint ones where all paint together stops next to nothing. As a soft Gaussian it is haze; as a stroke
  it is a pane of glass in the air.
- Specks: strokes, alone or in small groups, that touch nothing else and are not firmly there.

What stands alone but firm is kept: of the detached groups of campsite, trees, the mean opacity is 0.64 to
0.98, of the specks around koala and truck 0.04 to 0.52. A mast or a wire is a chain of touching strokes.
Distance alone does not tell: by the distance to the sixth neighbour in sizes, more than 6, the posts of the
truck and the edge of koala's table are lost (-0.6 dB).

With the places of these strokes taken by others (`split`, 6000 strokes, eight scenes) PSNR changes by -0.04
to +0.07 dB; 0 to 6 % of the strokes go.
"""

import numpy as np

from brushgs.passes.components import components
from brushgs.passes.form.coverage import NUM_NEIGHBORS, Coverage
from brushgs.passes.reduce.floaters import STRONG
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.gaussians import Gaussians

FAINT = 0.06  # opacity
VEIL, VEIL_SIZE = 0.3, 2.0  # opacity below which, and neighbours' sizes above which, a stroke is a veil
COVERED = 0.7  # share of the light that strokes which are not faint stop; at 0.5 the chair loses 0.1 dB
# Share of the light that all strokes together stop, of which less is fog; the second around veils. Without
# fog the chair, trained on white, stands clear; at 0.3 its upholstery, many veils deep, loses 0.4 dB.
FOG, VEIL_FOG = 0.12, 0.25
DEEP = 128  # strokes around fog that count: with 16 the chair's upholstery is taken for fog (-1 dB)
TOUCH = 2.0  # standard deviations along the line between two strokes at which they end
FIRM = 0.6  # opacity
SPECK = 2.0  # sum of the opacities of a group; more is a body
MOST_SPECKS = 0.3  # share of the strokes; where more touch nothing, that is how the scene is


def worth_keeping(strokes: Gaussians) -> Mask:
    """Mask [k] of the strokes that paint something.

    Opacities count relative to those of the scene: where the 99th percentile is below 0.8, they are scaled up
    to it. So of a scene that is haze as a whole the haze is kept; where all opacities are 0, all is kept.

    Args:
        strokes: k strokes, as merged: not solidified yet.

    Independent of unit and place of the scene, of the order of the rows and of the number of threads.
    """
    opacities = strokes.opacities.astype(np.float64)
    if not opacities.any():
        return np.ones(len(strokes), bool)  # nothing is painted, and nothing in the way
    strong = float(np.percentile(opacities, 99))
    opacities = np.minimum(opacities / max(min(strong / STRONG, 1.0), 1e-6), 1.0)
    around = Coverage.of(strokes)
    kept = ~_unseen(around, opacities)
    kept[kept] = ~_specks(around, opacities, kept)
    return kept


def _unseen(around: Coverage, opacities: F64) -> Mask:
    """Mask of the faint strokes that other paint covers, or that are nothing but fog."""
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
    """Mask among the strokes `kept` of those in small groups that touch no other and are not firm."""
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
