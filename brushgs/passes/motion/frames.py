"""Animate strokes over a clip whose rows do not correspond: each moment was trained or exported alone.

Strokes are carried from moment to moment (`carry`) and follow the Gaussians that they keep (`step`); steps
accumulate to poses (`poses`). Finally poses are smoothed over time (`steady`), and strokes fade in and out
(`fade`).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.extent import robust_frame
from brushgs.passes.finest import finest_of
from brushgs.passes.motion.carry import Carrier
from brushgs.passes.motion.known import known_around
from brushgs.passes.motion.matter import Matter, sums_by_label
from brushgs.passes.motion.members import NOBODY
from brushgs.passes.motion.poses import Film, Poses
from brushgs.passes.motion.rows import FADE, align_signs, blocks, finish
from brushgs.passes.motion.step import step_of
from brushgs.passes.reduce.merge import merge_clusters
from brushgs.passes.reduce.worth import FAINT
from brushgs.rendering.motion import (
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
from brushgs.values.quats import normalized, quat_products

YOUTH = 0.35  # seconds after birth in which a stroke that gains matter is rebuilt
GAINS = 1.15  # factor of matter from which it is rebuilt
# Noise over time: share of the stroke's size, radians, log size, log matter, RGB.
NOISE_SHIFT, NOISE_TURN, NOISE_SIZE, NOISE_MASS, NOISE_COLOR = 0.1, 0.05, 0.05, 0.2, 0.02
BRIDGED = 0.12  # seconds; shorter gaps without matter are filled: some trained moments miss matter
# Offsets from the reference below which a stroke counts as at rest, in the same units.
SETTLED_SHIFT, SETTLED_TURN, SETTLED_SIZE, SETTLED_COLOR = 0.05, 0.05, 0.05, 0.02
LIGHT_CHANGE = 0.15  # change of the log matter of a stroke below which its opacity stays


def follow_frames(
    scene: MovingScene,
    times: F64,
    strokes: Gaussians,
    members: Gaussians,
    labels: Rows,
    *,
    target: int | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Gaussians, StrokeMotion, F64]:
    """Animate strokes over a clip in which rows do not correspond.

    Args:
        scene: the clip; two of its moments are in memory at once.
        times: [T >= 1] seconds in the clip, ascending.
        strokes: k strokes of the first moment, with ids.
        members: n Gaussians of the first moment from which they were made, with their rows as ids.
        labels: [n] the id of the stroke of each member. Ids without a stroke belong to dropped strokes: their
            members are followed, but not painted.
        target: number of strokes at every moment, within 10 %, if there is enough matter; None for no limit.
        advance: called after each moment.

    Returns:
        The strokes, followed by those born later, at their reference moments, with ids above the largest
        label; their motion; and for each step [T - 1] the share of its Gaussians that were matched in the
        previous moment. Opacity is 0 outside the life of a stroke, except for its fades, which are at most as
        long as the shortest step of the clip.

    Raises:
        ValueError: if there are no times, or strokes or members have no ids.
    """
    if len(times) == 0:
        raise ValueError("follow_frames: times must hold at least one moment, got none")
    if strokes.ids is None or members.ids is None:
        raise ValueError("follow_frames: strokes and members must have ids, got none")
    ids = np.unique(np.concatenate([labels, strokes.ids]).astype(np.int64))
    born, origins = Born(len(ids)), np.zeros((0, 3))
    with Film() as film:
        numbers, finest = np.searchsorted(ids, labels), finest_of(members)
        is_painted, shares = np.isin(ids, strokes.ids), np.zeros(0)
        for moment in carried(scene, times, members.ids, numbers, is_painted, target=target, finest=finest):
            film.add(moment.rows)
            born.add(moment, float(times[moment.at]))
            origins, shares = moment.origins, moment.shares
            advance()
        table = film.table()
    first = int(ids.max(initial=-1)) + 1
    ids = np.concatenate([ids, first + np.arange(table.shape[1] - len(ids))])
    strokes, painted = born.joined(strokes, np.searchsorted(ids, strokes.ids), ids)
    fade = FADE if scene.times is None else float(np.diff(scene.times).min(initial=FADE))
    return strokes, _motion(table, origins, painted, born.references, strokes, times, fade), shares


@dataclass(frozen=True, eq=False)
class Moment:
    """All m strokes so far, at one moment.

    Attributes:
        at: index of the moment.
        gaussians: its n Gaussians.
        labels: [n] the stroke number of each, or `NOBODY`.
        masses: [m] painted area of each stroke.
        rows: [m, 12] see `Poses.rows`.
        origins: [m, 3] pivot of each at birth.
        shares: for each step so far, the share of its Gaussians that were matched in the previous moment.
    """

    at: int
    gaussians: Gaussians
    labels: Rows
    masses: F64
    rows: F32
    origins: F64
    shares: F64


def carried(
    scene: MovingScene,
    times: F64,
    rows: NDArray[np.integer[Any]],
    labels: Rows,
    is_painted: Mask,
    *,
    target: int | None = None,
    finest: float | None = None,
) -> Iterator[Moment]:
    """Yield the strokes at each moment.

    Args:
        scene: the clip.
        times: [T] seconds, ascending.
        rows: [n] rows of the Gaussians with a stroke in the first moment.
        labels: [n] their strokes, 0 to m - 1.
        is_painted: [m] whether each stroke of the first moment is painted.
        target: see `follow_frames`.
        finest: of all moments, see `Gaussians`.
    """
    carrier: Carrier | None = None
    poses, frame = Poses.none(), robust_frame(np.zeros((0, 3)))
    for at, time in enumerate(times):
        gaussians = replace(scene.at(float(time)), finest=finest)
        if carrier is None or len(carrier.matter) == 0:  # fixed at the first moment that has Gaussians
            frame = robust_frame(gaussians.means)
        matter = Matter.of(gaussians, frame)
        if carrier is None:
            carrier = Carrier.start(matter, np.asarray(rows, np.intp), labels, is_painted, frame, target)
        else:
            carrier.frame = frame
            before, seconds = carrier.matter, float(time - times[at - 1])
            pairs = carrier.step(matter, seconds)
            if len(matter):
                step = step_of(
                    before,
                    matter,
                    pairs,
                    carrier.labels[pairs.after],
                    poses.pivots,
                    carrier.strokes.lost[: len(poses.pivots)] < np.inf,
                )
                share = len(pairs.after) / len(matter)
                poses.move(step, matter, carrier.labels, carrier.strokes.masses, seconds, share)
        labels_now = carrier.labels if len(matter) else np.zeros(0, np.intp)
        poses.bear(matter, labels_now, len(carrier.strokes))
        kept = labels_now != NOBODY
        masses = sums_by_label(labels_now[kept], matter.masses[kept], len(poses.pivots))
        masses[carrier.strokes.lost > 0] = 0.0
        shares = np.array(carrier.shares)
        yield Moment(at, gaussians, labels_now, masses, poses.rows(masses), poses.origins, shares)


class Born:
    """Strokes born during a clip, each built at the moment when it has gathered its matter."""

    def __init__(self, num_first: int) -> None:
        self.references = np.zeros(num_first, np.intp)  # [m] moments
        self._num_first = num_first
        self._masses = np.zeros(num_first)
        self._births = np.zeros(num_first)
        self._made: list[Gaussians] = []
        self._rows = np.zeros((num_first, 2), np.intp)  # [m] index into `_made`, and row there

    def add(self, moment: Moment, time: float) -> None:
        """Build the strokes born at a moment, and rebuild young strokes that have gained matter."""
        more = len(moment.masses) - len(self.references)
        self.references = np.append(self.references, np.full(more, moment.at))
        self._births = np.append(self._births, np.full(more, time))
        self._masses = np.append(self._masses, np.zeros(more))
        self._rows = np.append(self._rows, np.zeros((more, 2), np.intp), axis=0)
        is_young = time <= self._births + YOUTH
        is_young[: self._num_first] = False
        makes = is_young & (moment.masses > GAINS * self._masses)
        numbers = np.flatnonzero(makes)
        if len(numbers) == 0:
            return
        rows = np.flatnonzero((moment.labels >= 0) & makes[moment.labels])
        made = merge_clusters(moment.gaussians.take(rows), moment.labels[rows])
        self._rows[numbers] = np.stack(
            [np.full(len(numbers), len(self._made)), np.arange(len(numbers))], axis=1
        )
        self.references[numbers] = moment.at
        self._masses[numbers] = moment.masses[numbers]
        self._made.append(made)

    def joined(self, strokes: Gaussians, painted: Rows, ids: Rows) -> tuple[Gaussians, Rows]:
        """The first strokes, with the numbers `painted` [k], followed by those born later, and their numbers.

        `ids` [m] are the ids by stroke number.
        """
        everything = Gaussians.joined([strokes, *self._made])
        starts = len(strokes) + np.cumsum([0] + [len(made) for made in self._made])
        numbers = np.flatnonzero(self._masses > 0)
        rows = starts[self._rows[numbers, 0]] + self._rows[numbers, 1]
        is_seen = everything.opacities[rows] >= FAINT
        painted = np.concatenate([painted, numbers[is_seen]])
        rows = np.concatenate([np.arange(len(strokes)), rows[is_seen]])
        return replace(everything.take(rows), ids=ids[painted].astype(np.int32)), painted


def _motion(
    table: F32,
    origins: F64,
    painted: Rows,
    references: Rows,
    strokes: Gaussians,
    times: F64,
    fade: float,
) -> StrokeMotion:
    """Convert poses since birth to smoothed, faded poses since the reference moments; moving strokes only.

    Args:
        table: [T, m, 12] see `Poses.rows`.
        origins: [m, 3] pivots at birth.
        painted: [k] the number of each stroke.
        references: [m] indices of the reference moments.
        strokes: k strokes at their reference moments.
        times: [T] seconds.
        fade: seconds, see `faded`.
    """
    assert strokes.ids is not None, "they are counted"
    pivots = origins[painted]
    moves = np.empty(len(painted), bool)
    for some in blocks(table):
        some = slice(some.start, min(some.stop, len(painted)))
        numbers = painted[some]
        block = np.array(table[:, numbers])
        own = strokes.take(some)
        pivots[some] += _since_references(block, references[numbers], own, times)
        moves[some] = finish(block, times, own, fade)
        table[:, numbers] = block
    order = np.flatnonzero(moves)
    order = order[np.argsort(strokes.ids[order], kind="stable")]
    kept = new_table(len(times), len(order))
    for row, moment in zip(kept, table, strict=True):
        row[...] = moment[painted[order]]
    return StrokeMotion(times, strokes.ids[order], pivots[order], kept)


def _since_references(block: F32, references: Rows, strokes: Gaussians, times: F64) -> F64:
    """Smooth pose rows since birth [T, k, 12] and make them relative to the reference moments, in place.

    Returns the shifts of the pivots from birth to the reference moments, [k, 3].
    """
    num = np.arange(block.shape[1])
    masses = _bridged(block[..., OPACITY], times)
    is_there = masses > 0
    align_signs(block)
    sizes = np.maximum(np.sort(strokes.scales, axis=1)[:, 1].astype(np.float64), 1e-30)
    noises = (
        (SHIFT, NOISE_SHIFT * sizes),
        (TURN, np.full(len(sizes), NOISE_TURN / 2)),
        (slice(SIZE, SIZE + 1), np.full(len(sizes), NOISE_SIZE)),
        (COLOR, np.full(len(sizes), NOISE_COLOR)),
    )
    for numbers, noise in noises:
        block[..., numbers] = steadied(block[..., numbers], times, noise, is_there)
    at_reference = block[references, num].copy()
    for kind in (SHIFT, SIZE, COLOR):
        block[..., kind] -= at_reference[:, kind]
    back = at_reference[:, TURN] * np.array([1, -1, -1, -1], np.float32)
    for moment in block:
        moment[:, TURN] = normalized(quat_products(moment[:, TURN], back))
    _settle(block, sizes)
    # Growth alone already adds painted area.
    masses = (masses * np.exp(-2 * block[..., SIZE])).astype(np.float32)
    block[..., OPACITY] = _opacities(masses, is_there, references, strokes, times)
    return at_reference[:, SHIFT].astype(np.float64)


def _settle(block: F32, sizes: F64) -> None:
    """Shrink poses within the noise towards rest, in place."""
    align_signs(block)
    halves = np.linalg.norm(block[..., TURN][..., 1:], axis=2)
    angles = 2 * np.arctan2(halves, block[..., TURN.start])
    less = 0.5 * angles * _shares(angles, SETTLED_TURN)
    block[..., TURN][..., 1:] *= (np.sin(less) / np.maximum(halves, 1e-30))[..., None]
    block[..., TURN.start] = np.cos(less)
    for kind, settled in (
        (SHIFT, SETTLED_SHIFT * sizes[None, :, None]),
        (slice(SIZE, SIZE + 1), SETTLED_SIZE),
        (COLOR, SETTLED_COLOR),
    ):
        lengths = np.linalg.norm(block[..., kind], axis=2, keepdims=True)
        block[..., kind] *= _shares(lengths, settled)


def _shares(lengths: Array, noise: Array | float) -> Array:
    """Shares of differences to keep: 0 below the noise, 0.99 at ten times the noise.

    Source: James and Stein 1961, Estimation with quadratic loss (the positive part of their shrinkage).
    """
    return 1 - np.minimum(noise / np.maximum(lengths, 1e-30), 1) ** 2


def _bridged(masses: F32, times: F64) -> F32:
    """Masses [T, k] with short gaps filled by the smaller of the masses before and after."""
    masses = masses.copy()
    before, after = known_around(masses > 0)
    gaps, strokes = np.nonzero((masses == 0) & (before >= 0) & (after < len(masses)))
    before, after = before[gaps, strokes], after[gaps, strokes]
    is_short = (times[after] - times[before] <= BRIDGED) | (after - before == 2)
    gaps, strokes, before, after = (rows[is_short] for rows in (gaps, strokes, before, after))
    masses[gaps, strokes] = np.minimum(masses[before, strokes], masses[after, strokes])
    return masses


def _opacities(masses: F32, is_there: Mask, references: Rows, strokes: Gaussians, times: F64) -> F32:
    """Factors of opacity [T, k] by the painted area of the members.

    Twice the matter squares the transmittance, 1 - opacity (Beer-Lambert): an opaque stroke stays opaque
    with a little less matter.
    """
    logs = np.log(np.where(is_there, masses, 1.0))[..., None].astype(np.float32)
    logs = steadied(logs, times, np.full(masses.shape[1], NOISE_MASS), is_there, np.inf)[..., 0]
    changes = logs - logs[references, np.arange(masses.shape[1])]
    changes = np.sign(changes) * np.maximum(np.abs(changes) - LIGHT_CHANGE, 0)
    opacities = np.clip(strokes.opacities.astype(np.float64), 1e-6, 1 - 1e-6)
    factors = -np.expm1(np.exp(changes) * np.log1p(-opacities)) / opacities
    return np.where(is_there, factors, 0.0).astype(np.float32)


# Remove jitter from values over time: a bilateral mean over neighboring moments.


WINDOW = 3  # moments on each side
SECONDS = 0.1  # maximum distance in time
TREMBLING = 3.0  # tolerance as a factor of the measured noise
MOST_TREMBLING = 4.0  # maximum factor on the given tolerance: larger differences are motion


def steadied(values: F32, times: F64, tolerances: F64, is_there: Mask, most: float = MOST_TREMBLING) -> F32:
    """Weighted means over nearby moments, by similarity of values: removes noise, keeps fast motion.

    A moment whose value differs by the tolerance has weight 0.6, by three times as much 0.01: jumps are not
    smeared, and uniform motion is unchanged. The tolerance is raised to three times the measured noise, the
    median deviation from the mean of both neighbors, but to at most `most` times the given one.
    Source: Tomasi and Manduchi 1998, Bilateral filtering (there of images).

    Args:
        values: [T, m, D].
        times: [T] seconds, ascending.
        tolerances: [m] > 0, expected size of noise.
        is_there: [T, m] the moments that count; others keep their values.
        most: > 0, see above.
    """
    num = len(values)
    trembling = np.minimum(TREMBLING * _trembling(values, is_there), most * tolerances)
    tolerances = np.maximum(tolerances, trembling)
    result = values.copy()
    for at in range(num):
        sums = values[at].astype(np.float64)
        totals = np.ones(values.shape[1])
        for distance in range(1, WINDOW + 1):
            # Both sides or none: a one-sided mean lags or leads.
            if at < distance or at + distance >= num:
                break
            sides = at - distance, at + distance
            if max(abs(times[list(sides)] - times[at])) > SECONDS * 1.001:
                break
            away = [((values[side] - values[at]).astype(np.float64) ** 2).sum(axis=1) for side in sides]
            weights = np.exp(-0.5 * np.maximum(*away) / tolerances**2)
            weights *= is_there[sides[0]] & is_there[sides[1]] & is_there[at]
            for side in sides:
                sums += weights[:, None] * values[side]
            totals += 2 * weights
        result[at] = sums / totals[:, None]
    return result


def _trembling(values: F32, is_there: Mask) -> F64:
    """The noise of values, [m]: the median distance of a moment to the mean of its two neighbours.

    It is 0 for uniform motion, and for occasional jumps.
    """
    if len(values) < 3:
        return np.zeros(values.shape[1])
    away = np.linalg.norm(values[1:-1] - 0.5 * (values[:-2] + values[2:]), axis=2)
    away[~(is_there[:-2] & is_there[1:-1] & is_there[2:])] = np.inf  # sorted to the end
    away.sort(axis=0)
    counts = np.isfinite(away).sum(axis=0)
    middle = away[np.maximum(counts - 1, 0) // 2, np.arange(away.shape[1])]
    return np.where(counts > 0, np.where(np.isfinite(middle), middle, 0.0), 0.0).astype(np.float64)
