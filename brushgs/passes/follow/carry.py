"""Gaussians of consecutive moments -> which stroke each belongs to, where rows do not correspond.

Identity is carried, not matched: each moment starts from the strokes of the one before. Every Gaussian first
belongs to the stroke of the Gaussian that was nearest to it a moment ago, as that moved (position, size and
colour, see `cluster_features`). It leaves only where another stroke is clearly nearer (hysteresis), while the
centres of the strokes follow their members (Lloyd). What no stroke is near is unpainted: there strokes are
born. Strokes that lose their matter sleep, and wake where it comes back soon, or die; strokes that come to
lie in one place become one; strokes that gain much and spread are cut in two.
Source: Litwinowicz 1997 and Hays and Essa 2004, in whose paintings of films strokes are born where paint
thins and taken out where it crowds.
"""

from dataclasses import dataclass, field

import numpy as np

from brushgs.arrays import F64, Mask, Rows
from brushgs.passes.features import SceneFrame
from brushgs.passes.follow.matter import Matter, means_by_label, sums_by_label
from brushgs.passes.lloyd import assign, start
from brushgs.passes.split import cut

NUM_STEPS = 2  # of Lloyd in each moment
NOBODY = -1  # the label of what is unpainted
# Lengths are in radii of strokes: the root of the mean squared distance of members to their centre.
NEAR = 2.0  # a Gaussian farther from all that was there a moment ago is new
WITHIN = 1.0  # so near to the centre of its stroke no Gaussian leaves it
MARGIN = 0.7  # it leaves where another centre is nearer by this factor
REACH = 2.5  # what is new, or left its stroke, is unpainted if it is farther from all centres
CLAIM = 1.25  # what is unpainted belongs to a stroke only so near to its centre
CROWDED = 0.25  # centres so near to each other, in sums of their radii, are one stroke
STRAY = 2.0  # so far from the centre a Gaussian has half its weight
# Of a usual stroke of the scene, the median.
LEAST_RADIUS = 0.25
LEAST_BIRTH = 0.25  # mass; less matter bears no stroke
CUT = 0.05  # of all that is painted: so much that is new at once is no flicker, and is painted at once
# Of the usual mass of the stroke itself.
ALIVE = 0.05
GAIN, SPREAD = 2.5, 1.6  # mass and radius at which a stroke is cut
ADAPTING = 0.1  # share by which the usual mass and radius of a stroke follow those of a moment
TOLERATED = 2.0  # unpainted matter of the first moment may grow by so much: the caller left it out
HORIZON = 0.1  # seconds: as far as two will be apart then, they are now
SLEEP = 0.5  # seconds in which a stroke without matter can wake
COVERED = np.array([0, 1, 2, 6, 7, 8])  # of the features: place and colour
MASS_POWER = 0.375  # of masses as weights of centres, see `cluster.cluster_weights`


@dataclass(eq=False)
class Strokes:
    """The strokes that ever were, by number; columns grow.

    Attributes:
        centers: [m, 9] in the space of `Matter.points`.
        radii: [m] > 0, see above; slowly adapting, as `masses`.
        masses: [m] what they usually paint.
        lost: [m] seconds since they had matter, 0 while they live; infinite for the dead.
        drifts: [m, 3] how fast their members move, in the space of `Matter.points`, a second.
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
        """Those that can have matter."""
        return np.flatnonzero(self.lost < np.inf)

    @property
    def alive(self) -> Mask:
        """[m] those that have matter."""
        return np.asarray(self.lost == 0)

    def add(self, centers: F64, radii: F64, masses: F64, drifts: F64) -> Rows:
        """Strokes are born; their numbers."""
        first = len(self)
        self.centers = np.concatenate([self.centers, centers])
        self.radii = np.concatenate([self.radii, radii])
        self.masses = np.concatenate([self.masses, masses])
        self.lost = np.concatenate([self.lost, np.zeros(len(centers))])
        self.drifts = np.concatenate([self.drifts, drifts])
        return np.arange(first, len(self))


@dataclass(frozen=True, eq=False)
class Pairs:
    """Gaussians of two consecutive moments that are taken for one.

    Attributes:
        before: [p] rows of the moment before.
        after: [p] rows of this moment, ascending.
    """

    before: Rows
    after: Rows


@dataclass(eq=False)
class Carrier:
    """Carries strokes from moment to moment.

    Attributes:
        frame: centre and radius of the scene.
        strokes: all that ever were.
        matter: of the last moment that had any.
        labels: [n] the stroke of each Gaussian of it, or `NOBODY`.
        accepted: [n] the mass that the caller left unpainted of what each Gaussian was at first.
        is_waiting: [n] whether it was unpainted the moment before, too: what appears for one moment only
            bears no stroke.
        born: numbers of the strokes that were born in the last moment.
    """

    frame: SceneFrame
    strokes: Strokes
    matter: Matter
    labels: Rows
    accepted: F64
    is_waiting: Mask
    born: Rows = field(default_factory=lambda: np.arange(0))

    @classmethod
    def start(
        cls, matter: Matter, rows: Rows, labels: Rows, num_strokes: int, frame: SceneFrame
    ) -> "Carrier":
        """From the strokes of the first moment.

        Args:
            matter: of the first moment.
            rows: of it that have a stroke.
            labels: and which, 0 to `num_strokes` - 1, each in use.
            num_strokes: m.
            frame: centre and radius of the scene.
        """
        of_all = np.full(len(matter), NOBODY, np.intp)
        of_all[rows] = labels
        nothing = np.zeros(num_strokes)
        strokes = Strokes(np.zeros((num_strokes, 9)), nothing, nothing, nothing, np.zeros((num_strokes, 3)))
        carrier = cls(frame, strokes, matter, of_all, np.zeros(len(matter)), np.zeros(len(matter), bool))
        if num_strokes:
            carrier._center(matter, of_all)
            carrier._remember(1.0)
            # What was pruned belongs to the strokes around it: it is there in later moments too.
            of_all = carrier._settled(matter, np.zeros((len(matter), 3)), of_all, of_all >= 0)
            carrier.labels = of_all
            carrier._center(matter, of_all)
            carrier._remember(1.0)
        carrier.accepted = np.where(of_all == NOBODY, matter.masses, 0.0)
        return carrier

    def step(self, matter: Matter, seconds: float) -> Pairs:
        """Carry the strokes to the next moment; `labels` are then those of its Gaussians.

        Args:
            matter: of the moment.
            seconds: since the last.

        A moment without any Gaussians changes nothing but that all strokes sleep.
        """
        self.born = np.arange(0)
        if len(matter) == 0:
            self._sleep(np.zeros(len(self.strokes)), seconds)
            return Pairs(np.arange(0), np.arange(0))
        nearest, is_near, is_only, drifts = self._matched(matter, seconds)
        # One more row at the end: that of what was not there.
        own = np.append(self.labels, NOBODY)[nearest]
        accepted = np.append(self.accepted, 0.0)[nearest]
        was_unpainted = is_near & (own == NOBODY)
        # What comes to the side of what was left out is left out, too.
        accepted = np.where(is_only | (accepted == 0), accepted, matter.masses)
        accepted[~was_unpainted] = 0.0
        before, strokes = self.labels, self.strokes
        strokes.centers[:, :3] += seconds * strokes.drifts
        labels = np.full(len(matter), NOBODY)
        for _ in range(NUM_STEPS if len(strokes.open) else 0):
            labels = self._settled(matter, drifts, own, ~was_unpainted)
            # What is new moves no centre yet: at the border of something new a stroke would run into it.
            self._center(matter, np.where(is_only, labels, NOBODY))
        self.matter, self.labels, self.accepted = matter, labels, accepted
        self.is_waiting = was_unpainted
        self._bear()
        self._merge()
        self._cut(is_only & (own == self.labels))
        masses = self._masses()
        self._sleep(masses, seconds)
        self._remember(ADAPTING)
        rows = np.flatnonzero(is_only)
        stayed = rows[(before[nearest[rows]] == self.labels[rows]) & (self.labels[rows] != NOBODY)]
        self._drift(stayed, drifts)
        return Pairs(nearest[stayed], stayed)

    def _matched(self, matter: Matter, seconds: float) -> tuple[Rows, Mask, Mask, F64]:
        """What each Gaussian was a moment ago.

        Returns:
            The row that was nearest, or one past the last where none was near; whether one was; whether that
            was nearest to no other; and how fast it drifts, as fast as its stroke if it was not there.
        """
        num, last = len(matter), self.matter
        if len(last) == 0:
            return np.zeros(num, np.intp), np.zeros(num, bool), np.zeros(num, bool), np.zeros((num, 3))
        drifts = np.append(self.strokes.drifts, np.zeros((1, 3)), axis=0)[self.labels]  # the last: of nobody
        points = last.points.astype(np.float64)
        points[:, :3] += seconds * drifts
        distances, nearest = matter.nearest(points)
        radii = np.append(self.strokes.radii, self._usual_radius())[self.labels[nearest]]
        # Where a large one lies is less certain, by as much as it is large.
        is_near = distances <= NEAR * radii + np.linalg.norm(matter.points[:, 3:6], axis=1)
        order = np.lexsort((distances, nearest))
        is_only = is_near.copy()
        is_only[order[1:]] &= nearest[order[1:]] != nearest[order[:-1]]
        moved = (matter.points[:, :3] - last.points[nearest, :3]).astype(np.float64)
        drifts = np.where(is_only[:, None], moved / seconds, drifts[nearest])
        return np.where(is_near, nearest, len(last)), is_near, is_only, drifts

    def _drift(self, rows: Rows, drifts: F64) -> None:
        """Strokes drift as their members do, half as they did: noise that went on would add up."""
        labels, num = self.labels[rows], len(self.strokes)
        means = means_by_label(labels, _weights(self.matter.masses)[rows], drifts[rows], num)
        self.strokes.drifts = 0.5 * (self.strokes.drifts + means)

    def _settled(self, matter: Matter, drifts: F64, own: Rows, is_free: Mask) -> Rows:
        """The stroke of each Gaussian: its own unless another is clearly nearer, or `NOBODY`.

        Args:
            matter: the Gaussians.
            drifts: [n, 3] how fast each moves.
            own: [n] the stroke that each belonged to, or `NOBODY`.
            is_free: [n] False where it was unpainted.
        """
        strokes, open_ = self.strokes, self.strokes.open
        radii, centers = strokes.radii, strokes.centers
        rows = np.flatnonzero(own >= 0)
        rows = rows[strokes.lost[own[rows]] < np.inf]
        to_own = np.linalg.norm(matter.points[rows] - centers[own[rows]], axis=1)
        is_within = to_own <= WITHIN * radii[own[rows]]
        asks = np.ones(len(matter), bool)
        asks[rows[is_within]] = False
        apart = HORIZON * np.linalg.norm(drifts[rows] - strokes.drifts[own[rows]], axis=1)
        to_own = np.hypot(to_own, apart)
        distances, nearest = matter.nearest(
            np.concatenate([centers, HORIZON * strokes.drifts], axis=1)[open_], asks, HORIZON * drifts
        )
        labels = open_[nearest]
        stayed = rows[is_within | (MARGIN * to_own <= distances[rows])]
        labels[stayed] = own[stayed]
        is_far = distances > np.where(is_free, REACH, CLAIM) * radii[labels]
        is_far[stayed] = False
        labels[is_far] = NOBODY
        self._cover(matter, labels, is_free)
        return labels

    def _cover(self, matter: Matter, labels: Rows, is_free: Mask) -> None:
        """Give what is unpainted to a stroke of its place and colour, if it is the lesser of the two.

        However large it is: where there is paint, none is missing.
        """
        rows = np.flatnonzero(labels == NOBODY)
        open_, strokes = self.strokes.open, self.strokes
        distances, nearest = assign(
            matter.points[np.ix_(rows, COVERED)], strokes.centers[np.ix_(open_, COVERED)]
        )
        found = open_[nearest]
        limit = np.where(is_free[rows], REACH, CLAIM) * strokes.radii[found]
        is_covered = (distances <= limit) & (matter.masses[rows] <= strokes.masses[found])
        labels[rows[is_covered]] = found[is_covered]

    def _center(self, matter: Matter, labels: Rows) -> None:
        """Centres go to the weighted mean of their members, strays less; those without members stay."""
        rows = np.flatnonzero(labels >= 0)
        some, weights = labels[rows], _weights(matter.masses)[rows]
        radii = self.strokes.radii[some]
        if (radii > 0).all():  # not so while the first are made
            away = matter.points[rows] - self.strokes.centers[some]
            weights = weights / (1 + np.einsum("nd,nd->n", away, away) / (STRAY * radii) ** 2)
        means = means_by_label(some, weights, matter.points[rows], len(self.strokes))
        has_members = np.bincount(some, minlength=len(self.strokes)) > 0
        self.strokes.centers[has_members] = means[has_members]

    def _radii(self) -> F64:
        """[m] of each stroke at this moment; 0 without members."""
        rows = np.flatnonzero(self.labels >= 0)
        some, weights = self.labels[rows], _weights(self.matter.masses)[rows]
        away = self.matter.points[rows] - self.strokes.centers[some]
        squares = np.einsum("nd,nd->n", away, away)[:, None]
        return np.sqrt(means_by_label(some, weights, squares, len(self.strokes))[:, 0])

    def _masses(self) -> F64:
        """[m] what each stroke paints at this moment."""
        rows = np.flatnonzero(self.labels >= 0)
        return sums_by_label(self.labels[rows], self.matter.masses[rows], len(self.strokes))

    def _remember(self, share: float) -> None:
        """Let the usual mass and radius of each stroke follow those of this moment by a share."""
        strokes, masses, radii = self.strokes, self._masses(), self._radii()
        some = radii[radii > 0]
        least = LEAST_RADIUS * (float(np.median(some)) if len(some) else self._usual_radius())
        alive = masses > 0
        followed = strokes.radii + share * np.where(alive, radii - strokes.radii, 0.0)
        strokes.radii = np.maximum(followed, least)
        strokes.masses = strokes.masses + share * np.where(alive, masses - strokes.masses, 0.0)

    def _fit(self, numbers: Rows) -> None:
        """Strokes that were just made have the radii of their members."""
        least = LEAST_RADIUS * self._usual_radius()
        self.strokes.radii[numbers] = np.maximum(self._radii()[numbers], least)

    def _usual_radius(self) -> float:
        """The median radius of a stroke; where there is none, 1/40 of the scene's."""
        radii = self.strokes.radii[self.strokes.radii > 0]
        return float(np.median(radii)) if len(radii) else 1 / 40

    def _sleep(self, masses: F64, seconds: float) -> None:
        strokes = self.strokes
        is_alive = masses > ALIVE * strokes.masses
        dies = strokes.lost >= SLEEP  # checked first: one moment without matter kills none, however long
        strokes.lost = np.where(is_alive & (strokes.lost < np.inf), 0.0, strokes.lost + seconds)
        strokes.lost[dies & (strokes.lost > 0)] = np.inf

    def _bear(self) -> None:
        """Strokes where unpainted matter has gathered, as large and of as many Gaussians as usual."""
        matter, strokes = self.matter, self.strokes
        excess = matter.masses - TOLERATED * self.accepted
        is_unpainted = (self.labels == NOBODY) & (excess > 0)
        is_cut = excess[is_unpainted].sum() > CUT * matter.masses.sum()
        rows = np.flatnonzero(is_unpainted if is_cut else is_unpainted & self.is_waiting)
        if len(rows) == 0:
            return
        points, weights, radius = matter.points[rows], _weights(excess[rows]), self._usual_radius()
        # One in each cell: matter that fills a cube of a side evenly has half of it as radius.
        cells = np.floor(points[:, :3] / (2 * radius)).astype(np.int64)
        used, inverse = np.unique(cells, axis=0, return_inverse=True)
        centers = means_by_label(inverse.ravel(), weights, points, len(used))
        counts = np.bincount(self.labels[self.labels >= 0], minlength=1)
        if (counts > 0).any() and (count := round(len(rows) / np.median(counts[counts > 0]))) > len(used):
            centers = start(points, weights, count, 0)[0]
        usual = strokes.masses[strokes.alive]
        least = LEAST_BIRTH * (float(np.median(usual)) if len(usual) else 0.0)
        for is_last in (False, True):
            distances, found = assign(points, centers)
            cell = found.astype(np.intp)
            is_near = distances <= REACH * radius
            masses = sums_by_label(cell[is_near], excess[rows[is_near]], len(centers))
            kept = masses > least
            if not kept.any():
                return
            if not is_last:
                centers = centers[kept]
        is_near &= kept[cell]
        place = np.cumsum(kept) - 1
        num = int(kept.sum())
        self.born = strokes.add(centers[kept], np.full(num, radius), masses[kept], np.zeros((num, 3)))
        self.labels[rows[is_near]] = self.born[place[cell[is_near]]]
        self._center(self.matter, self.labels)
        self._fit(self.born)

    def _merge(self) -> None:
        """Strokes that have come to lie in one place are one: the one with less matter dies."""
        from brushgs.passes.neighbours import nearest

        strokes = self.strokes
        living = np.flatnonzero(strokes.alive)
        if len(living) < 2:
            return
        distances, others = nearest(strokes.centers[living], strokes.centers[living], 2)
        is_self = others[:, 0] == np.arange(len(living))
        other = living[np.where(is_self, others[:, 1], others[:, 0])]
        apart = np.where(is_self, distances[:, 1], distances[:, 0])
        crowded = apart < CROWDED * (strokes.radii[living] + strokes.radii[other]) / 2
        less = strokes.masses[living] < strokes.masses[other]
        less |= (strokes.masses[living] == strokes.masses[other]) & (living > other)
        dies, into = living[crowded & less], other[crowded & less]
        if len(dies) == 0:
            return
        is_dying = np.zeros(len(strokes), bool)
        is_dying[dies] = True
        keeps = ~is_dying[into]  # no chains in one moment
        dies, into = dies[keeps], into[keeps]
        renamed = np.arange(-1, len(strokes))
        renamed[dies + 1] = into
        self.labels = renamed[self.labels + 1]
        strokes.masses[into] += strokes.masses[dies]
        strokes.lost[dies] = np.inf
        self._center(self.matter, self.labels)

    def _cut(self, stayed: Mask) -> None:
        """Strokes that have gained much matter and spread are cut in two; one half is born.

        The stroke keeps the half in which more of what `stayed` [n] is.
        """
        strokes, masses, radii = self.strokes, self._masses(), self._radii()
        chosen = np.flatnonzero((masses > GAIN * strokes.masses) & (radii > SPREAD * strokes.radii))
        if len(chosen) == 0:
            return
        place = np.full(len(strokes) + 1, -1)  # the last: of nobody
        place[chosen] = np.arange(len(chosen))
        some = np.flatnonzero(place[self.labels] >= 0)
        points, own = self.matter.points[some], place[self.labels[some]]
        halves = cut(own, np.arange(len(chosen)), points, _weights(self.matter.masses)[some])
        second = halves >= len(chosen)
        sides = np.where(second, 1.0, -1.0) * np.where(stayed[some], self.matter.masses[some], 0.0)
        second ^= (sums_by_label(own, sides, len(chosen)) > 0)[own]
        halves_at = means_by_label(own[second], np.ones(int(second.sum())), points[second], len(chosen))
        new = strokes.add(halves_at, strokes.radii[chosen], 0.5 * masses[chosen], strokes.drifts[chosen])
        self.labels[some[second]] = new[own[second]]
        strokes.masses[chosen] = 0.5 * masses[chosen]
        self.born = np.concatenate([self.born, new])
        self._center(self.matter, self.labels)
        self._fit(np.concatenate([chosen, new]))


def _weights(masses: F64) -> F64:
    """Weights of centres, > 0, by masses."""
    largest = float(masses.max(initial=0.0))
    if not largest > 0:
        return np.ones(len(masses))
    return np.asarray(np.maximum((masses / largest) ** MASS_POWER, 1e-9))
