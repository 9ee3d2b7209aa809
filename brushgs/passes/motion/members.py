"""The strokes of a clip, and the members of each among the Gaussians of the current moment."""

from dataclasses import dataclass, field

import numpy as np

from brushgs.passes.motion.matter import Matter, means_by_label, sums_by_label
from brushgs.passes.reduce.split import cut
from brushgs.values.arrays import F64, Mask, Rows

NOBODY = -1  # label of unpainted Gaussians
STRAY = 2.0  # radii: distance from the center at which a Gaussian has half its weight
LEAST_RADIUS = 0.25  # of the median radius
MASS_POWER = 0.375  # exponent of masses in the weights of centers, see `cluster.cluster_weights`


@dataclass(eq=False)
class Strokes:
    """All strokes so far, by number; m grows.

    Attributes:
        centers: [m, 9] in the space of `Matter.points`.
        radii: [m] > 0, RMS distance of the members to the center, slowly adapting.
        masses: [m] usual painted area, slowly adapting.
        lost: [m] seconds without matter: 0 if alive, infinite if dead.
        drifts: [m, 3] velocity of their members, in the space of `Matter.points`, per second.
    """

    centers: F64
    radii: F64
    masses: F64
    lost: F64
    drifts: F64

    def __len__(self) -> int:
        return len(self.centers)

    @property
    def open(self) -> Rows:
        """Numbers of the strokes that are not dead."""
        return np.flatnonzero(self.lost < np.inf)

    @property
    def alive(self) -> Mask:
        """[m] whether strokes have matter."""
        return np.asarray(self.lost == 0)

    def add(self, centers: F64, radii: F64, masses: F64, drifts: F64) -> Rows:
        """Add strokes, and return their numbers."""
        first = len(self)
        self.centers = np.concatenate([self.centers, centers])
        self.radii = np.concatenate([self.radii, radii])
        self.masses = np.concatenate([self.masses, masses])
        self.lost = np.concatenate([self.lost, np.zeros(len(centers))])
        self.drifts = np.concatenate([self.drifts, drifts])
        return np.arange(first, len(self))


@dataclass(eq=False)
class Members:
    """Strokes and their members at a moment.

    Attributes:
        strokes: all so far.
        matter: of the last moment that had any Gaussians.
        labels: [n] the stroke of each of its Gaussians, or `NOBODY`.
        is_painted: [m] whether a stroke is painted, and counts towards the target.
        born: numbers of the strokes that were born at the moment.
    """

    strokes: Strokes
    matter: Matter
    labels: Rows
    is_painted: Mask
    born: Rows = field(default_factory=lambda: np.arange(0), kw_only=True)

    def center(self, matter: Matter, labels: Rows) -> None:
        """Move centers to the mean of their members, outliers downweighted; empty strokes stay."""
        rows = np.flatnonzero(labels >= 0)
        some, weights = labels[rows], weights_of(matter.masses)[rows]
        radii = self.strokes.radii[some]
        if (radii > 0).all():  # radii are 0 while the first strokes are built
            away = matter.points[rows] - self.strokes.centers[some]
            weights = weights / (1 + np.einsum("nd,nd->n", away, away) / (STRAY * radii) ** 2)
        means = means_by_label(some, weights, matter.points[rows], len(self.strokes))
        has_members = np.bincount(some, minlength=len(self.strokes)) > 0
        self.strokes.centers[has_members] = means[has_members]

    def radii(self) -> F64:
        """Radius of each stroke at this moment, [m]; 0 without members."""
        rows = np.flatnonzero(self.labels >= 0)
        some, weights = self.labels[rows], weights_of(self.matter.masses)[rows]
        away = self.matter.points[rows] - self.strokes.centers[some]
        squares = np.einsum("nd,nd->n", away, away)[:, None]
        return np.sqrt(means_by_label(some, weights, squares, len(self.strokes))[:, 0])

    def masses(self) -> F64:
        """Painted area of each stroke at this moment, [m]."""
        rows = np.flatnonzero(self.labels >= 0)
        return sums_by_label(self.labels[rows], self.matter.masses[rows], len(self.strokes))

    def counts(self) -> Rows:
        """Number of members of each stroke, [m]."""
        return np.bincount(self.labels[self.labels >= 0], minlength=len(self.strokes))

    def usual_radius(self) -> float:
        """Median radius of the living strokes, else of all, else 1/40 of the scene radius."""
        for some in (self.strokes.radii[self.strokes.alive], self.strokes.radii):
            if (some > 0).any():
                return float(np.median(some[some > 0]))
        return 1 / 40

    def fit(self, numbers: Rows) -> None:
        """Set the radii of new strokes from their members."""
        least = LEAST_RADIUS * self.usual_radius()
        self.strokes.radii[numbers] = np.maximum(self.radii()[numbers], least)

    def remember(self, share: float) -> None:
        """Move the usual mass and radius of each stroke by a share towards those of this moment."""
        strokes, masses, radii = self.strokes, self.masses(), self.radii()
        some = radii[radii > 0]
        least = LEAST_RADIUS * (float(np.median(some)) if len(some) else self.usual_radius())
        alive = masses > 0
        followed = strokes.radii + share * np.where(alive, radii - strokes.radii, 0.0)
        strokes.radii = np.maximum(followed, least)
        strokes.masses = strokes.masses + share * np.where(alive, masses - strokes.masses, 0.0)

    def add(self, centers: F64, radii: F64, masses: F64, drifts: F64) -> Rows:
        """Add painted strokes, and return their numbers."""
        numbers = self.strokes.add(centers, radii, masses, drifts)
        self.is_painted = np.append(self.is_painted, np.ones(len(numbers), bool))
        return numbers

    def neighbours(self, some: Mask) -> tuple[Rows, Rows, F64]:
        """Numbers of the strokes in `some`, the nearest other one of each, and its distance."""
        from brushgs.passes.neighbours import nearest

        living, centers = np.flatnonzero(some), self.strokes.centers
        if len(living) < 2:
            return np.arange(0), np.arange(0), np.zeros(0)
        distances, others = nearest(centers[living], centers[living], 2)
        is_self = others[:, 0] == np.arange(len(living))
        other = living[np.where(is_self, others[:, 1], others[:, 0])]
        return living, other, np.where(is_self, distances[:, 1], distances[:, 0])

    def join(self, some: Rows, into: Rows, most: int | None = None) -> None:
        """Merge up to `most` pairs of strokes: the one with less matter dies, the other gets its members."""
        strokes = self.strokes
        less = strokes.masses[some] < strokes.masses[into]
        less |= (strokes.masses[some] == strokes.masses[into]) & (some > into)
        dies, into = some[less], into[less]
        is_dying = np.zeros(len(strokes), bool)
        is_dying[dies] = True
        keeps = ~is_dying[into]  # no chains in one call
        dies, into = dies[keeps][:most], into[keeps][:most]
        if len(dies) == 0:
            return
        renamed = np.arange(-1, len(strokes))
        renamed[dies + 1] = into
        self.labels = renamed[self.labels + 1]
        strokes.masses[into] += strokes.masses[dies]
        strokes.lost[dies] = np.inf
        self.center(self.matter, self.labels)

    def halve(self, chosen: Rows, stayed: Mask) -> None:
        """Cut strokes in two; one half of each is born.

        The stroke keeps the half with more mass of Gaussians in `stayed` [n].
        """
        if len(chosen) == 0:
            return
        strokes, masses = self.strokes, self.masses()
        place = np.full(len(strokes) + 1, -1)  # last: NOBODY
        place[chosen] = np.arange(len(chosen))
        some = np.flatnonzero(place[self.labels] >= 0)
        points, own = self.matter.points[some], place[self.labels[some]]
        halves = cut(own, np.arange(len(chosen)), points, weights_of(self.matter.masses)[some])
        second = halves >= len(chosen)
        sides = np.where(second, 1.0, -1.0) * np.where(stayed[some], self.matter.masses[some], 0.0)
        second ^= (sums_by_label(own, sides, len(chosen)) > 0)[own]
        halves_at = means_by_label(own[second], np.ones(int(second.sum())), points[second], len(chosen))
        new = self.add(halves_at, strokes.radii[chosen], 0.5 * masses[chosen], strokes.drifts[chosen])
        self.labels[some[second]] = new[own[second]]
        strokes.masses[chosen] = 0.5 * masses[chosen]
        self.born = np.concatenate([self.born, new])
        self.center(self.matter, self.labels)
        self.fit(np.concatenate([chosen, new]))


def weights_of(masses: F64) -> F64:
    """Weights > 0 of Gaussians in centers, from their masses."""
    largest = float(masses.max(initial=0.0))
    if not largest > 0:
        return np.ones(len(masses))
    return np.asarray(np.maximum((masses / largest) ** MASS_POWER, 1e-9))
