"""Animate the strokes of a moving scene whose rows correspond: each follows its members.

Nothing is matched or regrouped: a member belongs to its stroke at all times.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from brushgs.passes.groups import Groups
from brushgs.passes.motion.known import nearest_known
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.passes.reduce.merge import covariances, principal_axes, stopped
from brushgs.rendering.motion import (
    AT_REST,
    COLOR,
    NUM_NUMBERS,
    OPACITY,
    SHIFT,
    SIZE,
    TURN,
    StrokeMotion,
    new_table,
)
from brushgs.values.arrays import F32, F64, Array, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.quats import conjugates, normalized, quat_products, rotation_matrices, turn_forms
from brushgs.values.sh import C0

# Fade strokes in and out: limit how fast opacity changes.


FADE = 0.25  # seconds in which a stroke appears or disappears


def faded(opacities: F32, times: F64, fade: float = FADE) -> F32:
    """The smallest opacities not below the given ones that change by at most 1 in `fade` seconds.

    Each is the maximum over all moments of (opacity there - distance in time / fade). New strokes appear
    before the ones they replace vanish, so no gap opens between them.

    Args:
        opacities: [T, m] of m strokes at T moments, >= 0.
        times: [T] seconds, ascending.
        fade: seconds, >= 0; 0 returns the opacities as they are.
    """
    if not fade > 0:
        return opacities
    falls = (np.diff(times) / fade).astype(np.float32)
    limited = opacities.copy()
    # Distances in time add up over steps: one forward and one backward pass find the maximum.
    for at in range(1, len(limited)):
        np.maximum(limited[at], limited[at - 1] - falls[at - 1], out=limited[at])
    for at in range(len(limited) - 2, -1, -1):
        np.maximum(limited[at], limited[at + 1] - falls[at], out=limited[at])
    return limited


NUMBERS_AT_A_TIME = 1 << 22  # numbers of a table in memory while it is finished
# A stroke rests if no part of it ever moves by more than this share of its second-longest axis, the visible
# width, and no factor or color changes by more than `REST_CHANGE`.
REST_SHARE = 0.01
REST_CHANGE = 0.01


def follow_rows(
    scene: MovingScene,
    times: F64,
    strokes: Gaussians,
    members: Gaussians,
    labels: Rows,
    advance: Callable[[], None] = lambda: None,
) -> StrokeMotion:
    """The motion of strokes by that of their members, see `Bodies`.

    Strokes appear and disappear with their members, fading over at least `FADE` seconds; an absent stroke has
    the pose of the nearest time at which it is present.

    Args:
        scene: with rows that correspond.
        times: [T >= 1] seconds, strictly ascending.
        strokes: k strokes at their reference moments, with unique ids.
        members: n Gaussians at their reference moments, with rows of the scene as ids.
        labels: [n] the id of the stroke of each member; members of no stroke are ignored.
        advance: called after each moment.

    Returns:
        The motion of strokes, without those that rest or have no members.

    Raises:
        ValueError: if rows do not correspond.
    """
    if not scene.has_rows:
        raise ValueError("follow_rows: rows must correspond at all times, got a scene without such rows")
    assert strokes.ids is not None, "strokes have the labels of their members"
    assert members.ids is not None, "members are rows of the scene"
    order = np.argsort(strokes.ids, kind="stable")
    ids = strokes.ids[order]
    found = np.minimum(np.searchsorted(ids, labels), max(len(ids) - 1, 0))
    is_member = ids[found] == labels if len(ids) else np.zeros(len(labels), bool)
    if scene.resting is not None:
        moves = np.zeros(len(ids), bool)
        moves[found[is_member & ~scene.resting[members.ids]]] = True
        is_member &= moves[found]
    rows = np.flatnonzero(is_member)
    rows = rows[np.argsort(found[rows], kind="stable")]
    followed, compact = np.unique(found[rows], return_inverse=True)
    bodies = list(Bodies.of(members.take(rows), compact))
    pivots = np.concatenate([np.zeros((0, 3)), *(body.pivots for body in bodies)])
    table = new_table(len(times), len(followed))
    turns = table[0, :, TURN].copy()
    for at, (time, since) in enumerate(zip(times, np.diff(times, prepend=-np.inf), strict=True)):
        moment = scene.at(time) if bodies else None
        for body in bodies:
            assert moment is not None, "made where there are bodies"
            table[at, body.strokes] = body.numbers(moment, turns[body.strokes], since)
        turns = table[at, :, TURN].copy()
        advance()
    moves = _finish(table, times, strokes.take(order[followed]))
    if not moves.all():
        whole, table = table, new_table(len(times), int(moves.sum()))
        for at in range(len(times)):
            table[at] = whole[at, moves]
    return StrokeMotion(times, ids[followed[moves]], pivots[moves], table)


def _finish(table: F32, times: F64, strokes: Gaussians) -> Mask:
    """Make poses continuous in time, in place, and return the mask of strokes that move."""
    moves = np.empty(len(strokes), bool)
    for some in blocks(table):
        block = np.array(table[:, some])
        moves[some] = finish(block, times, strokes.take(some))
        table[:, some] = block
    return moves


def blocks(table: F32) -> Iterator[slice]:
    """Slices of the strokes of a table, in blocks that fit in memory."""
    num_times, num_strokes, width = table.shape
    at_a_time = max(1, NUMBERS_AT_A_TIME // (num_times * width))
    for first in range(0, num_strokes, at_a_time):
        yield slice(first, first + at_a_time)


def finish(block: F32, times: F64, strokes: Gaussians, fade: float = FADE) -> Mask:
    """Make poses continuous in time, in place: held while absent, aligned in sign, faded over `fade` s.

    Returns the mask of the strokes that move.
    """
    hold_poses(block, times)
    align_signs(block)
    own = np.maximum(strokes.opacities.astype(np.float32), np.float32(1e-6))
    painted = np.minimum(own * block[..., OPACITY], 1)
    block[..., OPACITY] = np.maximum(block[..., OPACITY], faded(painted, times, fade) / own)
    return _moves(block, strokes.scales)


def hold_poses(table: F32, times: F64) -> None:
    """Give strokes with opacity 0 their pose at the nearest time with opacity above 0, in place.

    Of two equally near times it is the earlier; a stroke that is always invisible keeps its poses.
    """
    is_there = table[..., OPACITY] > 0
    waits = np.flatnonzero(~is_there.all(axis=0) & is_there.any(axis=0))
    nearest = nearest_known(is_there[:, waits], times)
    opacities = table[:, waits, OPACITY]
    table[:, waits] = table[nearest, waits]
    table[:, waits, OPACITY] = opacities


def align_signs(table: F32) -> None:
    """Flip signs of quaternions so that consecutive ones lie in one hemisphere, in place, from w >= 0 on."""
    turns = table[..., TURN]
    first = np.where(turns[:1, :, 0] < 0, -1, 1)
    steps = np.where(np.einsum("tmi,tmi->tm", turns[1:], turns[:-1]) < 0, -1, 1)
    turns *= np.cumprod(np.concatenate([first, steps]), axis=0)[..., None]


def _moves(table: F32, scales: Array) -> Mask:
    """Whether strokes move at any time of a table [T, m, 12], [m]."""
    ascending = np.sort(scales.astype(np.float64), axis=1)
    turn = 2 * np.linalg.norm(table[..., TURN][..., 1:], axis=2)  # chord of a rotation, in radii
    shift = np.linalg.norm(table[..., SHIFT], axis=2) + turn * ascending[:, 2]
    rest = np.array(AT_REST, np.float32)
    changes = np.abs(table - rest)
    change = np.maximum(changes[..., SIZE], changes[..., OPACITY])
    change = np.maximum(change, changes[..., COLOR].max(axis=2))
    moves = (shift > REST_SHARE * ascending[:, 1]) | (change > REST_CHANGE)
    return np.asarray(moves.any(axis=0))


# Compute the poses of strokes from their members at the reference moments and now.


MEMBERS_AT_A_TIME = 1 << 16  # about 700 bytes each while a moment is processed
GONE = 0.01  # share of the mass at the reference below which a stroke is absent and gets no pose
GONE_NUMBERS = (*AT_REST[:OPACITY], 0.0, *AT_REST[OPACITY + 1 :])


@dataclass(frozen=True, eq=False)
class Bodies:
    """k strokes as bodies of n members.

    Attributes:
        strokes: slice of these strokes among all of the caller.
        rows: [n] rows of the members in the scene, sorted by stroke.
        starts: [k + 1] first member of each stroke, then n.
        pivots: [k, 3] weighted means of the members.
        places: [n, 3] offsets of the members from the pivots of their strokes.
        quats: [n, 4] unit quaternions of the members.
        variances: [n] mean variance of each member along an axis, a third of the trace of its covariance.
        areas: [n] projected areas of the members, see `merge_clusters`.
        opacities: [n] of the members.
        footprints: [k] areas of the strokes without overlap.
        colors: [k, 3] mean view-independent colors of the members, display-encoded.
        painted: [k] joint opacity of the members, see `merge_clusters`.
    """

    strokes: slice
    rows: Rows
    starts: Rows
    pivots: F64
    places: F64
    quats: F64
    variances: F64
    areas: F64
    opacities: F64
    footprints: F64
    colors: F64
    painted: F64

    @classmethod
    def of(cls, members: Gaussians, labels: Rows) -> "Iterator[Bodies]":
        """Yield bodies of members with ids, in chunks; `labels` [n] are strokes, 0 to k - 1, ascending."""
        assert members.ids is not None, "members are rows of a scene"
        num = int(labels[-1]) + 1 if len(labels) else 0
        starts = np.searchsorted(labels, np.arange(num + 1))
        first = 0
        while first < num:
            end = int(np.searchsorted(starts, starts[first] + MEMBERS_AT_A_TIME, "right")) - 1
            end = max(end, first + 1)
            some = slice(starts[first], starts[end])
            yield cls._of(
                slice(first, end), members.take(some), labels[some] - first, starts[first : end + 1]
            )
            first = end

    @classmethod
    def _of(cls, strokes: slice, members: Gaussians, labels: Rows, starts: Rows) -> "Bodies":
        assert members.ids is not None, "members are rows of a scene"
        starts = starts - starts[0]
        opacities, own_areas = members.opacities.astype(np.float64), projected_areas(members.scales)
        areas = own_areas.copy()
        totals = np.bincount(labels, opacities * areas)
        areas[(totals == 0)[labels]] = 1.0  # points: weighted by opacity
        weights = opacities * areas
        weights[(np.bincount(labels, weights) == 0)[labels]] = 1.0
        shares = weights / np.bincount(labels, weights)[labels]
        means = members.means.astype(np.float64)
        pivots = sums_of(shares, starts, means)
        groups = Groups.ascending(starts)
        within, between = covariances(members, pivots, shares, groups)
        footprints = projected_areas(principal_axes(within + between)[0])
        return cls(
            strokes,
            members.ids.astype(np.intp),
            starts,
            pivots,
            means - pivots[labels],
            normalized(members.quats),
            (members.scales.astype(np.float64) ** 2).sum(axis=1) / 3,
            areas,
            opacities,
            footprints,
            sums_of(shares, starts, C0 * members.sh[:, 0]),
            stopped(opacities, own_areas, footprints, groups),
        )

    def numbers(self, moment: Gaussians, last_turns: Array, since: float) -> F64:
        """The pose rows of the strokes at a moment, [k, 12]; absent strokes rest with opacity 0.

        Args:
            moment: the scene, with all rows.
            last_turns: [k, 4] rotations at the previous moment; absent strokes keep them.
            since: seconds since then.
        """
        labels = np.repeat(np.arange(len(self.pivots)), np.diff(self.starts))
        opacities = moment.opacities[self.rows].astype(np.float64)
        scales = moment.scales[self.rows].astype(np.float64)
        # Members that are faint now or at the reference are poor evidence of motion.
        weights = self.areas * np.minimum(opacities, self.opacities)
        totals = np.add.reduceat(weights, self.starts[:-1])
        is_there = totals > GONE * np.add.reduceat(self.areas * self.opacities, self.starts[:-1])
        shares = weights / np.where(is_there, totals, 1.0)[labels]
        places = moment.means[self.rows].astype(np.float64) - self.pivots[labels]
        middles = sums_of(shares, self.starts, np.concatenate([self.places, places], axis=1))
        turns, growths = rigid_motions(
            shares,
            self.starts,
            self.places - middles[labels, :3],
            places - middles[labels, 3:],
            (self.variances, (scales**2).mean(axis=1)),
            quat_products(normalized(moment.quats[self.rows]), conjugates(self.quats)),
            last_turns,
            since,
        )
        turned = np.einsum("kij,kj->ki", rotation_matrices(turns), middles[:, :3])
        numbers = np.empty((len(self.pivots), NUM_NUMBERS))
        numbers[:, SHIFT] = middles[:, 3:] - growths[:, None] * turned
        numbers[:, TURN] = turns
        numbers[:, SIZE] = np.log(growths)
        footprints = self.footprints * growths**2
        painted = stopped(opacities, projected_areas(scales), footprints, Groups.ascending(self.starts))
        numbers[:, OPACITY] = np.divide(
            painted, self.painted, out=np.ones(len(painted)), where=self.painted > 0
        )
        paint = self.areas * opacities
        paint /= np.where(is_there, np.add.reduceat(paint, self.starts[:-1]), 1.0)[labels]
        numbers[:, COLOR] = sums_of(paint, self.starts, C0 * moment.sh[self.rows, 0]) - self.colors
        numbers[~is_there] = GONE_NUMBERS
        numbers[~is_there, TURN] = last_turns[~is_there]
        return numbers


# Estimate rotations and growth of many bodies at once from points before and after.
#
# A body consists of members: points, each with a ball that rotates with the member. The rotation is the
# weighted Procrustes fit of the points, to which the balls add the mean of the members' own rotations
# (Markley), weighted by size. So the positions decide if there are many members; a single member, or a line
# of them, gives its own rotation; and a few small jittering ones do not spin a body. Source: Horn 1987,
# Closed-form solution of absolute orientation using unit quaternions; Markley et al. 2007, Averaging
# quaternions.


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
