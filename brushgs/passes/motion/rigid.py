"""Estimate rotations and growth of many bodies at once from points before and after.

A body consists of members: points, each with a ball that rotates with the member. The rotation is the
weighted Procrustes fit of the points, to which the balls add the mean of the members' own rotations
(Markley), weighted by size. So the positions decide if there are many members; a single member, or a line of
them, gives its own rotation; and a few small jittering ones do not spin a body.
Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions; Markley et al. 2007,
Averaging quaternions.
"""

import numpy as np
from scipy.sparse import csr_array

from brushgs.values.arrays import F64, Array, Rows
from brushgs.values.quats import rotation_matrices, turn_forms

# Weights of the rotation at the previous moment. The first only breaks ties. The second is for the share of
# the spread that no rotation explains: where members do not move as one, the best fit jumps, and need not be
# followed. Measured on cook_spinach at 2000 and 7000 strokes, rotations
# of more than 6 degrees in a step of 1/30 s: 1.2 and 1.9 % by the points alone, up to 180 degrees; 0.07 and
# 0.05 % with the balls; 0.008 and 0.005 % with both, equally near to the plain renders.
LAST_TURN = 1e-6
LOST_TURN, TURN_MEMORY = 70.0, 0.1  # weight 0 s later; seconds in which it falls to 1/e
# Minimum growth as a share of the ratio of spreads, if members do not move as one.
LEAST_GROWTH = 0.5


def sums_of(weights: F64, starts: Rows, values: Array) -> F64:
    """Weighted sums [k, D] of the values [n, D] of the members of each body.

    Args:
        weights: [n].
        starts: [k + 1] first member of each body, then n.
        values: [n, D] of members.
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
    since: float,
) -> tuple[F64, F64]:
    """The rotation and the growth of each of k bodies of n members.

    Args:
        shares: [n] weights of members, sum 1 over each body; or all 0, which gives no motion.
        starts: [k + 1] first member of each body, then n.
        before: [n, 3] offsets of members from their weighted mean.
        after: [n, 3] the same later.
        variances: of the balls along each axis, before and after, [n] each; 0 for points.
        turns: [n, 4] the members' own rotations, unit quaternions.
        last_turns: [k, 4] previous rotations, unit quaternions, used for lack of other evidence.
        since: seconds since `last_turns`; infinite if they are unrelated.

    Returns:
        Unit quaternions [k, 4], and scale factors [k] > 0 of the Procrustes fit. Members that drift apart do
        not enlarge a body: flat strokes of cook_spinach are 0.1 to 0.2 dB nearer to the plain render than
        with the ratio of spreads.
    """
    ball_before, ball_after = variances
    values = np.concatenate(
        [
            (after[:, :, None] * before[:, None, :]).reshape(-1, 9),
            ball_before[:, None] * (turns[:, :, None] * turns[:, None, :]).reshape(-1, 16),
            (before**2).sum(axis=1)[:, None],
            (after**2).sum(axis=1)[:, None],
            3 * np.stack([ball_before, ball_after, np.sqrt(ball_before * ball_after)], axis=1),
        ],
        axis=1,
    )
    sums = sums_of(shares, starts, values)
    crossed, own = sums[:, :9].reshape(-1, 3, 3), sums[:, 9:25].reshape(-1, 4, 4)
    points_before, points_after, balls_before, balls_after, balls = sums[:, 25:].T
    spread_before, spread_after = points_before + balls_before, points_after + balls_after
    unit = np.where(spread_before > 0, spread_before, 1.0)

    quats = last_turns.astype(np.float64)
    is_lone = np.diff(starts) == 1
    quats[is_lone] = turns[starts[:-1][is_lone]]
    many = np.flatnonzero(~is_lone)
    # Mean rotation weighted by ball size: trace(R^T R_i) is 4 (q q_i)^2 - 1.
    forms = (turn_forms(crossed[many]) + 4 * own[many]) / unit[many, None, None]
    last = quats[many]
    prior = last[:, :, None] * last[:, None, :]
    found = _largest(forms + LAST_TURN * prior)
    together = np.einsum("kij,kij->k", rotation_matrices(found), crossed[many])
    lost = (np.sqrt(points_before * points_after)[many] - together) / unit[many]
    weights = LAST_TURN + LOST_TURN * np.exp(-since / TURN_MEMORY) * np.maximum(lost, 0)
    quats[many] = _largest(forms + weights[:, None, None] * prior)

    together = np.einsum("kij,kij->k", rotation_matrices(quats), crossed) + balls
    growths = np.maximum(together / unit, LEAST_GROWTH * np.sqrt(spread_after / unit))
    return quats, np.where((spread_before > 0) & (spread_after > 0), growths, 1.0)


def _largest(forms: F64) -> F64:
    """Unit quaternions [k, 4] that maximise quadratic forms [k, 4, 4]."""
    return np.linalg.eigh(forms)[1][:, :, -1]
