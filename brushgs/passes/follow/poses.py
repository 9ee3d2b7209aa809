"""Where strokes are, moment after moment, from how they move in each step: poses add up and do not drift."""

import tempfile
from dataclasses import dataclass

import numpy as np

from brushgs.arrays import F32, F64, Rows
from brushgs.passes.follow.matter import Matter, means_by_label, sums_by_label
from brushgs.passes.follow.step import Step
from brushgs.quats import normalized, quat_products
from brushgs.rendering.motion import COLOR, IN_MEMORY, NUM_NUMBERS, OPACITY, SHIFT, SIZE, TURN, new_table

# Steps add up, and so do their errors: a stroke is drawn to where its members are. The share of the way in a
# second, and how far the two may be apart before, of the size of the stroke, and of its logarithm. Members
# that come and go move the mean, too: at 3 a second they are half of all jitter.
DRAWN, DEAD_ZONE, DEAD_SIZE = 1.0, 0.3, 0.2
STRAY = 1.5  # sizes; a member so far away has half its weight


@dataclass(eq=False)
class Poses:
    """Where m strokes are; columns grow.

    Attributes:
        origins: [m, 3] pivots at the moments they were born, world units.
        pivots: [m, 3] pivots now.
        turns: [m, 4] quaternions, since they were born.
        sizes: [m] logarithms of root mean squared distances of members to the pivot, world units.
        colors: [m, 3] mean of the members.
    """

    origins: F64
    pivots: F64
    turns: F64
    sizes: F64
    colors: F64

    @classmethod
    def none(cls) -> "Poses":
        """No strokes."""
        return cls(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0), np.zeros((0, 3)))

    def bear(self, matter: Matter, labels: Rows, num: int) -> None:
        """Add strokes until there are `num`, where their members are; one without members at the origin."""
        first = len(self.pivots)
        if num == first:
            return
        _, means, sizes, colors = (column[first:] for column in members_of(matter, labels, num))
        self.origins = np.concatenate([self.origins, means])
        self.pivots = np.concatenate([self.pivots, means])
        self.turns = np.concatenate([self.turns, np.tile(np.array([1.0, 0, 0, 0]), (num - first, 1))])
        self.sizes = np.concatenate([self.sizes, sizes])
        self.colors = np.concatenate([self.colors, colors])

    def move(self, step: Step, matter: Matter, labels: Rows, usual: F64, seconds: float) -> None:
        """Go one step of so many seconds, and a little of the way to what the members say.

        `usual` are the masses [m] that strokes have at most times: a few members say little of a stroke.
        """
        num = len(self.pivots)
        self.pivots = step.pivots[:num]
        self.turns = normalized(quat_products(step.turns[:num], self.turns))
        self.sizes = self.sizes + step.growths[:num]
        self.colors = self.colors + step.colors[:num]
        masses, means, sizes, colors = members_of(matter, labels, num, self)
        alive = masses > 0
        present = np.minimum(masses[alive] / np.maximum(usual[:num][alive], 1e-300), 1.0)
        drawn = -np.expm1(-DRAWN * seconds) * present
        away = means[alive] - self.pivots[alive]
        distances = np.linalg.norm(away, axis=1)
        free = DEAD_ZONE * np.exp(self.sizes[alive])
        excess = np.maximum(distances - free, 0.0) / np.maximum(distances, 1e-300)
        self.pivots[alive] += (drawn * excess)[:, None] * away
        apart = sizes[alive] - self.sizes[alive]
        self.sizes[alive] += drawn * np.sign(apart) * np.maximum(np.abs(apart) - DEAD_SIZE, 0.0)
        self.colors[alive] += drawn[:, None] * (colors[alive] - self.colors[alive])

    def rows(self, masses: F64) -> F32:
        """[m, 12] as numbers of a `Pose`, but since birth, with masses in the place of opacity, and with the
        size and the colour themselves.
        """
        rows = np.empty((len(self.pivots), NUM_NUMBERS))
        rows[:, SHIFT] = self.pivots - self.origins
        rows[:, TURN] = self.turns
        rows[:, SIZE] = self.sizes
        rows[:, OPACITY] = masses
        rows[:, COLOR] = self.colors
        return rows.astype(np.float32)


class Film:
    """Rows of `Poses` of each moment, while the number of strokes grows: in memory, or in a file."""

    def __init__(self) -> None:
        self._file = tempfile.SpooledTemporaryFile(max_size=IN_MEMORY)  # noqa: SIM115
        self._counts: list[int] = []

    def __enter__(self) -> "Film":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def add(self, rows: F32) -> None:
        """The next moment."""
        self._file.write(rows.tobytes())
        self._counts.append(len(rows))

    def table(self) -> F32:
        """[T, m, 12] all moments; strokes that were not born have mass 0. Called once, at the end."""
        table = new_table(len(self._counts), max(self._counts, default=0))
        table[..., OPACITY] = 0
        self._file.seek(0)
        for at, count in enumerate(self._counts):
            row = np.frombuffer(self._file.read(4 * NUM_NUMBERS * count), np.float32)
            table[at, :count] = row.reshape(count, NUM_NUMBERS)
        self._file.close()
        return table


def members_of(
    matter: Matter, labels: Rows, num: int, near: Poses | None = None
) -> tuple[F64, F64, F64, F64]:
    """Masses [num], means [num, 3], log sizes [num] and mean colours [num, 3] of strokes by their members.

    Where there are no members all are 0. In means strays count less than members `near` the poses: new things
    at the border of a stroke draw it little.
    """
    rows = np.flatnonzero((labels >= 0) & (labels < num))
    some = labels[rows]
    weights = matter.masses[rows]
    masses = sums_by_label(some, weights, num)
    weights = np.where(
        masses[some] > 0, weights, 1.0
    )  # points, or nothing that is opaque: each counts the same
    if near is not None:
        squares = ((matter.means[rows] - near.pivots[some]) ** 2).sum(axis=1)
        weights = weights / (1 + squares * np.exp(-2 * near.sizes[some]) / STRAY**2)
    means = means_by_label(some, weights, matter.means[rows], num)
    colors = means_by_label(some, weights, matter.colors[rows], num)
    away = ((matter.means[rows] - means[some]) ** 2).sum(axis=1) + matter.spreads[rows]
    squares = means_by_label(some, weights, away[:, None], num)[:, 0]
    sizes = 0.5 * np.log(np.where(squares > 0, squares, 1.0))
    return masses, means, sizes, colors
