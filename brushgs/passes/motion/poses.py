"""Accumulate the motion of strokes in each step to poses, corrected so that errors do not add up."""

import tempfile
from dataclasses import dataclass

import numpy as np

from brushgs.passes.motion.matter import Matter, means_by_label, sums_by_label
from brushgs.passes.motion.step import APART, Step
from brushgs.rendering.motion import COLOR, IN_MEMORY, NUM_NUMBERS, OPACITY, SHIFT, SIZE, TURN, new_table
from brushgs.values.arrays import F32, F64, Mask, Rows
from brushgs.values.quats import normalized, quat_products, rotation_matrices, turn_forms

# Errors of steps add up, so poses are pulled to the members: rate per second, dead zone in sizes of the
# stroke, and dead zone of the log size. Members that come and go move the mean too: at a rate of 3 they
# cause half of all jitter.
DRAWN, DEAD_ZONE, DEAD_SIZE = 1.0, 0.3, 0.2
# The same if few Gaussians match the previous moment, since each samples the scene anew: steps are then less
# reliable, and means more. Measured on a still life, each moment a different, jittered 60 to 80 % of it.
DRAWN_ANEW, DEAD_ZONE_ANEW, DEAD_SIZE_ANEW = 8.0, 0.1, 0.05
MOST_KEPT, LEAST_KEPT = 0.9, 0.7  # matched shares between which the two are blended
# For rotations, corrected by the surrounding strokes: rate per second, dead zone in radians. Rotations of
# resting strokes add up to a random walk, so those slower than `QUIET_TURN`, in rad/s, are damped.
DRAWN_TURN, DEAD_TURN, QUIET_TURN = 1.0, 0.1, 0.15
QUIET_GROWTH = 0.5  # the same for growth, log size per second; slow growth is left to the correction
NUM_AROUND = 8
KEPT = 0.1  # weight of the accumulated rotation
STRAY = 1.5  # sizes: distance at which a member has half its weight


@dataclass(eq=False)
class Poses:
    """Poses of m strokes; m grows.

    Attributes:
        origins: [m, 3] pivots at birth, world units.
        pivots: [m, 3] pivots now.
        turns: [m, 4] rotations since birth, quaternions.
        sizes: [m] logarithms of the RMS distance of the members to the pivot, world units.
        colors: [m, 3] means of the members.
        around: [m, 8] the nearest strokes at birth, padded with the stroke itself.
        offsets: [m, 8, 3] from its pivot to theirs at birth.
    """

    origins: F64
    pivots: F64
    turns: F64
    sizes: F64
    colors: F64
    around: Rows
    offsets: F64

    @classmethod
    def none(cls) -> "Poses":
        """No strokes."""
        places = np.zeros((0, 3))
        around = np.zeros((0, NUM_AROUND), np.intp)
        return cls(
            places, places, np.zeros((0, 4)), np.zeros(0), places, around, np.zeros((0, NUM_AROUND, 3))
        )

    def bear(self, matter: Matter, labels: Rows, num: int) -> None:
        """Add strokes until there are `num`, at the means of their members; at the origin without members."""
        first = len(self.pivots)
        if num == first:
            return
        _, means, sizes, colors = (column[first:] for column in members_of(matter, labels, num))
        self.origins = np.concatenate([self.origins, means])
        self.pivots = np.concatenate([self.pivots, means])
        self.turns = np.concatenate([self.turns, np.tile(np.array([1.0, 0, 0, 0]), (num - first, 1))])
        self.sizes = np.concatenate([self.sizes, sizes])
        self.colors = np.concatenate([self.colors, colors])
        self._look_around(first, np.bincount(labels[labels >= 0], minlength=num) > 0)

    def _look_around(self, first: int, is_there: Mask) -> None:
        """Store the neighbors of the strokes from `first` on, and the offsets to them."""
        from brushgs.passes.neighbours import nearest

        numbers = np.arange(first, len(self.pivots))
        others = np.repeat(numbers[:, None], NUM_AROUND, axis=1)
        there = np.flatnonzero(is_there)
        count = min(NUM_AROUND + 1, len(there))
        if count > 1:
            found = there[nearest(self.pivots[there], self.pivots[numbers], count)[1]]
            others[:, : count - 1] = found[:, 1:]  # the first is the stroke itself
        self.around = np.concatenate([self.around, others])
        self.offsets = np.concatenate([self.offsets, self.pivots[others] - self.pivots[numbers, None]])

    def move(self, step: Step, matter: Matter, labels: Rows, usual: F64, seconds: float, kept: float) -> None:
        """Advance by one step, with a small correction towards the members.

        Args:
            step: motion of the strokes.
            matter: of the moment.
            labels: [n] the stroke of each Gaussian.
            usual: [m] usual masses of the strokes: with less present, the correction is weaker.
            seconds: since the last moment.
            kept: share of the Gaussians that were in the same stroke at the last moment.
        """
        anew = min(max((MOST_KEPT - kept) / (MOST_KEPT - LEAST_KEPT), 0.0), 1.0)
        rate = DRAWN + anew * (DRAWN_ANEW - DRAWN)
        dead_zone = DEAD_ZONE + anew * (DEAD_ZONE_ANEW - DEAD_ZONE)
        dead_size = DEAD_SIZE + anew * (DEAD_SIZE_ANEW - DEAD_SIZE)
        num = len(self.pivots)
        self.pivots = step.pivots[:num]
        self.turns = normalized(quat_products(_quieted(step.turns[:num], seconds), self.turns))
        noise = QUIET_GROWTH * seconds
        growths = step.growths[:num]
        self.sizes = self.sizes + growths**3 / (growths**2 + noise**2)
        self.colors = self.colors + step.colors[:num]
        masses, means, sizes, colors = members_of(matter, labels, num, self)
        alive = masses > 0
        present = np.minimum(masses[alive] / np.maximum(usual[:num][alive], 1e-300), 1.0)
        drawn = -np.expm1(-rate * seconds) * present
        away = means[alive] - self.pivots[alive]
        distances = np.linalg.norm(away, axis=1)
        free = dead_zone * np.exp(self.sizes[alive])
        excess = np.maximum(distances - free, 0.0) / np.maximum(distances, 1e-300)
        self.pivots[alive] += (drawn * excess)[:, None] * away
        apart = sizes[alive] - self.sizes[alive]
        self.sizes[alive] += drawn * np.sign(apart) * np.maximum(np.abs(apart) - dead_size, 0.0)
        self.colors[alive] += drawn[:, None] * (colors[alive] - self.colors[alive])
        self._turn_back(masses > 0, -np.expm1(-DRAWN_TURN * seconds))

    def _turn_back(self, is_there: Mask, most: float) -> None:
        """Rotate strokes part of the way to the rotation since birth of their surrounding strokes.

        These are weighted by how near they are to where the current rotation predicts them.
        """
        now = self.pivots[self.around] - self.pivots[:, None]
        expected = np.einsum("mij,mnj->mni", rotation_matrices(self.turns), self.offsets)
        squares = (self.offsets**2).sum(axis=2)
        away = ((now - expected) ** 2).sum(axis=2) / np.maximum(squares, 1e-300)
        weights = is_there[self.around] * (squares > 0) / (1 + away / APART**2)
        totals = (weights * squares).sum(axis=1)
        rows = np.flatnonzero(is_there & (totals > 0))
        forms = np.einsum("mn,mni,mnj->mij", weights[rows], now[rows], self.offsets[rows])
        forms = turn_forms(forms / totals[rows, None, None])
        # The current rotation decides what the others leave open, for example about a line.
        kept = self.turns[rows]
        forms += KEPT * kept[:, :, None] * kept[:, None, :]
        turns = np.linalg.eigh(forms)[1][:, :, -1]
        turns[np.einsum("mi,mi->m", turns, kept) < 0] *= -1
        apart = 2 * np.linalg.norm(turns - kept, axis=1)  # chords, about the angle if small
        drawn = most * np.maximum(1 - DEAD_TURN / np.maximum(apart, 1e-30), 0)
        self.turns[rows] = normalized(kept + drawn[:, None] * (turns - kept))

    def rows(self, masses: F64) -> F32:
        """Rows of a `StrokeMotion` [m, 12], but since birth, with masses as opacity and with absolute size
        and color.
        """
        rows = np.empty((len(self.pivots), NUM_NUMBERS))
        rows[:, SHIFT] = self.pivots - self.origins
        rows[:, TURN] = self.turns
        rows[:, SIZE] = self.sizes
        rows[:, OPACITY] = masses
        rows[:, COLOR] = self.colors
        return rows.astype(np.float32)


def _quieted(turns: F64, seconds: float) -> F64:
    """Rotations [m, 4] within `seconds`, slow ones damped as noise."""
    halves = np.linalg.norm(turns[:, 1:], axis=1)
    angles = 2 * np.arctan2(halves, turns[:, 0])
    noise = QUIET_TURN * seconds
    less = 0.5 * angles**3 / (angles**2 + noise**2)
    axes = turns[:, 1:] * (np.sin(less) / np.maximum(halves, 1e-30))[:, None]
    return np.concatenate([np.cos(less)[:, None], axes], axis=1)


class Film:
    """Stores the rows of `Poses` of each moment, whose number grows: in memory, or in a file if large."""

    def __init__(self) -> None:
        self._file = tempfile.SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115
        self._counts: list[int] = []

    def __enter__(self) -> "Film":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, rows: F32) -> None:
        """Append the next moment."""
        self._file.write(rows.tobytes())
        self._counts.append(len(rows))

    def table(self) -> F32:
        """All moments [T, m, 12]; mass is 0 before birth. Call once, at the end."""
        table = new_table(len(self._counts), max(self._counts, default=0))
        table[..., OPACITY] = 0
        self._file.seek(0)
        for at, count in enumerate(self._counts):
            row = np.frombuffer(self._file.read(4 * NUM_NUMBERS * count), np.float32)
            table[at, :count] = row.reshape(count, NUM_NUMBERS)
        return table


def members_of(
    matter: Matter, labels: Rows, num: int, near: Poses | None = None
) -> tuple[F64, F64, F64, F64]:
    """Masses [num], means [num, 3], log sizes [num] and mean colors [num, 3] of strokes by their members.

    All are 0 for a stroke without members. Members far from the poses `near` are downweighted, so that new
    matter at the border of a stroke hardly pulls it.
    """
    rows = np.flatnonzero((labels >= 0) & (labels < num))
    some = labels[rows]
    weights = matter.masses[rows]
    masses = sums_by_label(some, weights, num)
    weights = np.where(masses[some] > 0, weights, 1.0)  # without area or opacity: equal weights
    if near is not None:
        squares = ((matter.means[rows] - near.pivots[some]) ** 2).sum(axis=1)
        weights = weights / (1 + squares * np.exp(-2 * near.sizes[some]) / STRAY**2)
    means = means_by_label(some, weights, matter.means[rows], num)
    colors = means_by_label(some, weights, matter.colors[rows], num)
    away = ((matter.means[rows] - means[some]) ** 2).sum(axis=1) + matter.spreads[rows]
    squares = means_by_label(some, weights, away[:, None], num)[:, 0]
    sizes = 0.5 * np.log(np.where(squares > 0, squares, 1.0))
    return masses, means, sizes, colors
