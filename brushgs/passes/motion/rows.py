"""Animate the strokes of a moving scene whose rows correspond: each follows its members.

Nothing is matched or regrouped: a member belongs to its stroke at all times.
"""

from collections.abc import Callable, Iterator

import numpy as np

from brushgs.passes.motion.bodies import Bodies
from brushgs.passes.motion.fade import FADE, faded
from brushgs.passes.motion.known import nearest_known
from brushgs.rendering.motion import (
    AT_REST,
    COLOR,
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
