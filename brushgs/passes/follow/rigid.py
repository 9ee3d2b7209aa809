"""Points before and after -> the rotation and the growth between them, of many bodies at once.

A body is made of members: points, each with a ball around it that turns as the member does. The rotation is
the one that brings the mass of a body nearest to where it went: weighted Procrustes over the points, in which
the balls add the mean of the members' own rotations (Markley) with the weight of their size. So the places of
many members decide alone; a lone member, or a line of them, turns as they do; and a few small ones that
jitter do not spin a body.
Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions; Markley et al. 2007,
Averaging quaternions.
"""

import numpy as np
from scipy.sparse import csr_array

from brushgs.arrays import F64, Array, Rows
from brushgs.quats import rotation_matrices, turn_forms

LAST_TURN = 1e-6  # weight of the rotation a moment before: it decides only what nothing else does
# Sizes are not below this share of the ratio of spreads, however little of where members went is one motion.
LEAST_GROWTH = 0.5


def sums_of(weights: F64, starts: Rows, values: Array) -> F64:
    """Weighted sums [k, D] of the values [n, D] of each body, its members being from one start to the next.

    Args:
        weights: [n].
        starts: [k + 1] rows, the last is n.
        values: of members.
    """
    shape = len(starts) - 1, len(values)
    return np.asarray(csr_array((weights, np.arange(shape[1]), starts), shape) @ values)


def rigid_motions(
    shares: F64,
    starts: Rows,
    before: F64,
    after: F64,
    variances: tuple[F64, F64],
    turns: F64,
    last_turns: Array,
) -> tuple[F64, F64]:
    """The rotation and the growth of each of k bodies of n members.

    Args:
        shares: [n] weights of members, sum 1 over each body; or all 0, which gives no motion.
        starts: [k + 1] of the members of each body.
        before: [n, 3] points of members from their weighted mean.
        after: [n, 3] the same later.
        variances: of their balls along each axis, before and after, [n] each; 0 for points.
        turns: [n, 4] unit quaternions, how members turned themselves.
        last_turns: [k, 4] unit quaternions that count where nothing else says how a body turned.

    Returns:
        Unit quaternions [k, 4], and factors of lengths [k] > 0: those of Procrustes, by the part of the
        spread that moved together. Members that drift apart do not enlarge a body: flat strokes of
        cook_spinach come 0.1 to 0.2 dB nearer to the plain picture so than with the ratio of spreads.
    """
    ball_before, ball_after = variances
    grown = np.sqrt(ball_before * ball_after)
    values = np.concatenate(
        [
            (after[:, :, None] * before[:, None, :]).reshape(-1, 9),
            ball_before[:, None] * (turns[:, :, None] * turns[:, None, :]).reshape(-1, 16),
            ((before**2).sum(axis=1) + 3 * ball_before)[:, None],
            ((after**2).sum(axis=1) + 3 * ball_after)[:, None],
            3 * grown[:, None],
        ],
        axis=1,
    )
    sums = sums_of(shares, starts, values)
    crossed, own = sums[:, :9].reshape(-1, 3, 3), sums[:, 9:25].reshape(-1, 4, 4)
    spread_before, spread_after, balls = sums[:, 25:].T
    unit = np.where(spread_before > 0, spread_before, 1.0)
    # The mean of rotations by their balls: trace(R^T R_i) is 4 (q q_i)^2 - 1.
    forms = (turn_forms(crossed) + 4 * own) / unit[:, None, None]
    last = last_turns.astype(np.float64)
    quats = np.linalg.eigh(forms + LAST_TURN * last[:, :, None] * last[:, None, :])[1][:, :, -1]
    together = np.einsum("kij,kij->k", rotation_matrices(quats), crossed) + balls
    ratios = np.sqrt(spread_after / unit)
    growths = np.maximum(together / unit, LEAST_GROWTH * ratios)
    return quats, np.where((spread_before > 0) & (spread_after > 0), growths, 1.0)
