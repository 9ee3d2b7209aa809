"""Estimate how strokes moved between two consecutive moments from matched Gaussians.

A stroke moves with the matched pairs of its members, not with the mean of all: members that come, go or were
not trained in one of the moments shift a mean, but do not move the stroke. Its rotation is that of its
members and of the surrounding strokes that move with it as one body; never that of the principal axes of its
members, which wobble.
Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.passes.motion.carry import Pairs
from brushgs.passes.motion.matter import Matter, means_by_label
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.quats import rotation_matrices, turn_forms

NUM_NEIGHBOURS = 8
NUM_ROUNDS = 3  # of reweighting pairs and neighbors by agreement
STRAY = 0.5  # sizes of a stroke: deviation from the other pairs at which a pair has half its weight
APART = 0.1  # the same for neighbors, as a share of their distance
PRIOR = 0.02  # weight of no rotation, for lack of other evidence
MOST_GROWTH = 0.4  # maximum change of log size in a step: more means other members, not growth


@dataclass(frozen=True, eq=False)
class Step:
    """Motion of m strokes from one moment to the next.

    Attributes:
        pivots: [m, 3] positions of the pivots now, world units.
        turns: [m, 4] rotations, quaternions.
        growths: [m] logarithms of the factors of size.
        colors: [m, 3] changes of color, RGB.
    """

    pivots: F64
    turns: F64
    growths: F64
    colors: F64


def step_of(before: Matter, after: Matter, pairs: Pairs, labels: Rows, pivots: F64, is_open: Mask) -> Step:
    """The motion of strokes from the pairs of their members.

    Strokes without pairs move with the nearest stroke that has some; without any pairs, nothing moves.

    Args:
        before: the matter of the last moment.
        after: the matter of this one.
        pairs: rows of both.
        labels: [p] the stroke of each pair.
        pivots: [m, 3] of all strokes before, world units.
        is_open: [m] the strokes to move; the others rest.
    """
    num = len(pivots)
    at_rest = np.tile(np.array([1.0, 0, 0, 0]), (num, 1))
    if len(labels) == 0:
        return Step(pivots.copy(), at_rest, np.zeros(num), np.zeros((num, 3)))
    weights = np.maximum(np.sqrt(before.masses[pairs.before] * after.masses[pairs.after]), 1e-300)
    x, y = before.means[pairs.before], after.means[pairs.after]
    spread_x, spread_y = before.spreads[pairs.before], after.spreads[pairs.after]
    agreeing = weights
    for again in reversed(range(NUM_ROUNDS)):
        mean_x, mean_y = (means_by_label(labels, agreeing, means, num) for means in (x, y))
        from_x, from_y = x - mean_x[labels], y - mean_y[labels]
        squares = (from_x**2).sum(axis=1) + spread_x
        size_x = means_by_label(labels, agreeing, squares[:, None], num)[:, 0]
        if again:
            away = ((from_y - from_x) ** 2).sum(axis=1)
            allowed = STRAY**2 * size_x[labels]
            agreeing = weights / (1 + away / np.maximum(allowed, 1e-300))
    products = from_y[:, :, None] * from_x[:, None, :] + _own(before, after, pairs)
    covars = means_by_label(labels, agreeing, products.reshape(-1, 9), num).reshape(-1, 3, 3)
    differences = after.colors[pairs.after] - before.colors[pairs.before]
    colors = means_by_label(labels, agreeing, differences, num)
    is_known = np.bincount(labels, minlength=num) > 0
    known = np.flatnonzero(is_known)
    turns = at_rest
    turns[known] = _turns(mean_x[known], mean_y[known], covars[known], size_x[known])
    # The ratio of the two spreads, times their squared correlation: scattering members are no growth. The
    # regression of places after on those before would shrink with noise, and strokes would vanish over time.
    squares_y = means_by_label(labels, agreeing, ((from_y**2).sum(axis=1) + spread_y)[:, None], num)[:, 0]
    turned = np.einsum("pij,pj->pi", rotation_matrices(turns)[labels], from_x)
    alike = np.einsum("pi,pi->p", turned, from_y) + np.sqrt(spread_x * spread_y)
    size_xy = means_by_label(labels, agreeing, alike[:, None], num)[:, 0]
    has_size = (size_x > 0) & (squares_y > 0) & (size_xy > 0)
    size_x, squares_y, size_xy = (np.where(has_size, sizes, 1.0) for sizes in (size_x, squares_y, size_xy))
    growths = 0.5 * np.log(squares_y / size_x) * np.minimum(size_xy**2 / (size_x * squares_y), 1.0)
    growths = np.clip(growths, -MOST_GROWTH, MOST_GROWTH)
    of = _nearest_known(pivots, mean_x, known, is_open)
    levers = np.einsum("mij,mj->mi", rotation_matrices(turns[of]), pivots - mean_x[of])
    moved = np.where(is_open[:, None], mean_y[of] + np.exp(growths[of])[:, None] * levers, pivots)
    turns = np.where(is_open[:, None], turns[of], (1.0, 0, 0, 0))
    return Step(moved, turns, np.where(is_known, growths, 0.0), np.where(is_known[:, None], colors, 0.0))


def _own(before: Matter, after: Matter, pairs: Pairs) -> F64:
    """Sums of y x^T over the axes of each pair, x before and y after, [p, 3, 3].

    Axes are paired by rank and weighted by agreement: in a ball or a disc rank and sign are arbitrary, and
    so is the quaternion in Gaussians trained independently.
    """
    x, y = before.axes[pairs.before], after.axes[pairs.after]
    lengths = np.linalg.norm(x, axis=1) * np.linalg.norm(y, axis=1)
    agreement = np.einsum("pik,pik->pk", x, y) / np.maximum(lengths, 1e-300)
    return np.asarray((y * agreement[:, None, :]) @ x.transpose(0, 2, 1))


def _nearest_known(pivots: F64, means: F64, known: Rows, is_open: Mask) -> Rows:
    """The stroke with pairs that each stroke moves with, [m]: itself, or the nearest."""
    from brushgs.passes.neighbours import nearest

    of = np.arange(len(pivots))
    is_known = np.zeros(len(pivots), bool)
    is_known[known] = True
    of[~is_known] = known[0]
    asked = np.flatnonzero(is_open & ~is_known)
    if len(asked):
        of[asked] = known[nearest(means[known], pivots[asked], 1)[1][:, 0]]
    return of


def _turns(x: F64, y: F64, covars: F64, sizes: F64) -> F64:
    """Rotations [k, 4] of strokes from their members and the surrounding strokes that move with them.

    Args:
        x: [k, 3] means of members before.
        y: [k, 3] means of members after.
        covars: [k, 3, 3] sums of y x^T of members from these means.
        sizes: [k] mean squared distances of members from these means.
    """
    from brushgs.passes.neighbours import nearest

    count = min(NUM_NEIGHBOURS + 1, len(x))
    others = nearest(x, x, count)[1]
    to_x, to_y = x[others] - x[:, None], y[others] - y[:, None]
    expected = to_x
    # A neighbor larger than its distance, such as a long thin one, must not turn smaller strokes.
    apart = np.einsum("kni,kni->kn", to_x, to_x)
    shares = np.minimum(1.0, apart / np.maximum(sizes[others], 1e-300))
    shares[others == np.arange(len(x))[:, None]] = 1.0
    distances = np.maximum(apart + sizes[:, None], 1e-300)
    around = shares[..., None, None] * covars[others] + to_y[..., :, None] * to_x[..., None, :]
    prior = PRIOR * sizes[:, None, None] * np.eye(3)
    for _ in range(NUM_ROUNDS):
        away = ((to_y - expected) ** 2).sum(axis=2) / distances
        weights = 1 / (1 + away / APART**2)
        forms = np.einsum("kn,knij->kij", weights, around) + prior
        traces = np.maximum(np.abs(forms).max(axis=(1, 2)), 1e-300)
        forms = turn_forms(forms / traces[:, None, None])
        forms[:, 0, 0] += 1e-9  # no rotation without evidence
        turns = np.linalg.eigh(forms)[1][:, :, -1]
        expected = np.einsum("kij,knj->kni", rotation_matrices(turns), to_x)
    turns[turns[:, 0] < 0] *= -1
    return turns
