"""Gaussians of consecutive moments -> which stroke each belongs to, where rows do not correspond.

Each moment starts from the strokes of the one before. Every Gaussian first belongs to the stroke of the
Gaussian that it was a moment ago, by place and looks along the motion of the scene, see `match`. It leaves
only where another stroke is clearly nearer (hysteresis), while the centres of the strokes follow their
members (Lloyd). What no stroke is near is unpainted: there strokes are born. Strokes that lose their matter
sleep, and wake where it comes back soon, or die; strokes that come to lie in one place become one; strokes
that gain much and spread are cut in two. At last there are about as many as at first: where there are more,
those that are nearest to each other are merged, and where there are fewer, the largest are cut.
Source: Litwinowicz 1997 and Hays and Essa 2004, in whose paintings of films strokes are born where paint
thins and taken out where it crowds.
"""

from dataclasses import dataclass, field

import numpy as np

from brushgs.passes.motion.matter import Matter, means_by_label, sums_by_label
from brushgs.passes.motion.members import NOBODY, Members, Strokes, weights_of
from brushgs.passes.motion.recognize import Recognized, Recognizer
from brushgs.passes.reduce.features import SceneFrame, contracted
from brushgs.passes.reduce.lloyd import assign, start
from brushgs.values.arrays import F64, Mask, Rows

NUM_STEPS = 2  # iterations of Lloyd per moment
# Lengths are in radii of strokes: the root of the mean squared distance of members to their centre.
NEAR = 2.0  # a Gaussian farther from all Gaussians of the moment before is new
WITHIN = 1.0  # a Gaussian nearer than this to the centre of its stroke never leaves it
MARGIN = 0.7  # a Gaussian leaves if another centre is nearer by this factor
REACH = 2.5  # what is new, or left its stroke, is unpainted if it is farther from all centres
CLAIM = 1.25  # what is unpainted belongs to a stroke only so near to its centre
CROWDED = 0.25  # strokes with centres nearer than this, in sums of their radii, become one
# Of a usual stroke of the scene, the median.
LEAST_BIRTH = 0.25  # minimum mass for the birth of a stroke
CUT = 0.05  # of all that is painted: so much that is new at once is no flicker, and is painted at once
# Of the usual mass of the stroke itself.
ALIVE = 0.05
GAIN, SPREAD = 2.5, 1.6  # mass and radius at which a stroke is cut
ADAPTING = 0.1  # share by which the usual mass and radius of a stroke adapt to those of a moment
TOLERATED = 2.0  # unpainted matter of the first moment may grow by so much: the caller left it out
HORIZON = 0.1  # seconds: as far as two will be apart then, they are now
SLEEP = 0.5  # seconds in which a stroke without matter can wake
COVERED = np.array([0, 1, 2, 6, 7, 8])  # of the features: place and colour
LEAST_FOUND = 0.2  # of the matter and the members of a stroke: with less it is not carried
WAITING = 0.1  # maximum seconds between moments at which new matter must be there twice
MOST_GROWTH = 1.5  # factor of length in a step: more is another thing
NUM_TASTED = 6  # Gaussians near a stroke that has lost all of its own
MORE = 0.03  # share of strokes by which their number may be off, before some are merged or cut
MOST_ROUNDS = 20  # of merging, and of cutting: each changes up to a third of the strokes


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of Gaussians of two consecutive moments that are taken for the same.

    Attributes:
        before: [p] rows of the moment before.
        after: [p] rows of this moment, ascending.
    """

    before: Rows
    after: Rows


@dataclass(eq=False)
class Carrier(Members):
    """Carries strokes from moment to moment.

    Attributes:
        frame: centre and radius of the scene.
        accepted: [n] the mass that the caller left unpainted of what each Gaussian was at first.
        is_waiting: [n] whether it was unpainted the moment before, too: what appears for one moment only
            bears no stroke.
        target: how many strokes there are to be at every moment; None for as many as it takes.
        recognizer: of Gaussians from moment to moment.
        missed: Gaussians that the last moment misses, see `Recognized`.
        missed_labels: their strokes, as `labels`.
        missed_accepted: of them, as `accepted`.
        shares: of the Gaussians of each step, those that were there the moment before.
    """

    frame: SceneFrame
    accepted: F64
    is_waiting: Mask
    target: int | None = None
    recognizer: Recognizer | None = None
    missed: Rows = field(default_factory=lambda: np.arange(0))
    missed_labels: Rows = field(default_factory=lambda: np.arange(0))
    missed_accepted: F64 = field(default_factory=lambda: np.zeros(0))
    shares: list[float] = field(default_factory=list)

    @classmethod
    def start(
        cls,
        matter: Matter,
        rows: Rows,
        labels: Rows,
        is_painted: Mask,
        frame: SceneFrame,
        target: int | None = None,
    ) -> "Carrier":
        """Start from the strokes of the first moment.

        Args:
            matter: of the first moment.
            rows: of it that have a stroke.
            labels: and which, 0 to m - 1, each in use.
            is_painted: [m] whether a stroke counts, see `target`.
            frame: centre and radius of the scene.
            target: how many strokes there are to be at every moment; None for as many as it takes.
        """
        num_strokes = len(is_painted)
        of_all = np.full(len(matter), NOBODY, np.intp)
        of_all[rows] = labels
        nothing = np.zeros(num_strokes)
        strokes = Strokes(np.zeros((num_strokes, 9)), nothing, nothing, nothing, np.zeros((num_strokes, 3)))
        nothing, no_one = np.zeros(len(matter)), np.zeros(len(matter), bool)
        carrier = cls(strokes, matter, of_all, is_painted, frame, nothing, no_one, target)
        if len(matter):
            carrier.recognizer = Recognizer(matter)
        if num_strokes:
            carrier.center(matter, of_all)
            carrier.remember(1.0)
            # What was pruned belongs to the strokes around it: it is there in later moments too.
            of_all = carrier._settled(matter, np.zeros((len(matter), 3)), of_all, of_all >= 0, of_all >= 0)
            carrier.labels = of_all
            carrier.center(matter, of_all)
            carrier.remember(1.0)
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
        known_labels = np.append(self.labels, self.missed_labels)
        known_accepted = np.append(self.accepted, self.missed_accepted)
        nearest, is_near, is_only, drifts = self._matched(matter, known_labels, seconds)
        num_last = len(self.labels)
        self.missed_labels, self.missed_accepted = known_labels[self.missed], known_accepted[self.missed]
        # One more row at the end: that of what was not there.
        own = np.append(known_labels, NOBODY)[nearest]
        accepted = np.concatenate([known_accepted, [0.0]])[nearest]
        was_unpainted = is_near & (own == NOBODY)
        # What comes to the side of what was left out is left out, too.
        accepted = np.where(is_only | (accepted == 0), accepted, matter.masses)
        accepted[~was_unpainted] = 0.0
        strokes, labels = self.strokes, np.full(len(matter), NOBODY)
        for _ in range(NUM_STEPS if len(strokes.open) else 0):
            labels = self._settled(matter, drifts, own, ~was_unpainted, is_only)
            # New matter moves no centre yet: at the border of something new a stroke would run into it.
            self.center(matter, np.where(is_only, labels, NOBODY))
        self.matter, self.labels, self.accepted = matter, labels, accepted
        self.is_waiting = was_unpainted
        if is_near.any():
            self._feed()
        stayed_put = is_only & (own == self.labels)
        self._bear(is_late=seconds > WAITING)
        self._merge()
        self.halve(self._spread_out(), stayed_put)
        self._keep_number(stayed_put)
        masses = self.masses()
        self._sleep(masses, seconds)
        self.remember(ADAPTING)
        stayed = np.flatnonzero(is_only & (nearest < num_last) & (own == self.labels) & (own != NOBODY))
        self._drift(stayed, drifts)
        return Pairs(nearest[stayed], stayed)

    def _matched(self, matter: Matter, labels: Rows, seconds: float) -> tuple[Rows, Mask, Mask, F64]:
        """What each Gaussian was a moment ago; the strokes move along.

        Args:
            matter: of the moment.
            labels: [n] the strokes of the last moment and of what it missed.
            seconds: since the last.

        Returns:
            The row that it was, or one past the last if none was near; whether one was near; whether that is
            the same Gaussian; and how fast it drifts, as fast as its stroke if it was not there.
        """
        num, last = len(matter), self.matter
        if self.recognizer is None or len(last) == 0:
            self.recognizer, self.missed = Recognizer(matter), np.arange(0)
            return np.zeros(num, np.intp), np.zeros(num, bool), np.zeros(num, bool), np.zeros((num, 3))
        found = self.recognizer.step(matter, seconds)
        self.shares.append(found.share)
        self.missed = found.missed
        if found.is_other:
            self.strokes.lost[:] = np.inf
            return np.full(num, len(labels)), np.zeros(num, bool), np.zeros(num, bool), np.zeros((num, 3))
        was, own = found.was, labels[found.was]
        is_same = found.is_same & self._stays(found)[own]
        from_last = np.flatnonzero(is_same & (was < len(last)))
        moved = (matter.points[from_last, :3] - last.points[was[from_last], :3]).astype(np.float64)
        self._move(matter, was, from_last)
        reach = NEAR * np.append(self.strokes.radii, self.usual_radius())[own]
        reach += _sizes_of(matter)
        away = np.linalg.norm(matter.points[:, :3] - contracted(found.places, self.frame)[0][was], axis=1)
        is_near = is_same | (away <= reach)
        drifts = np.append(self.strokes.drifts, np.zeros((1, 3)), axis=0)[own]  # the last: of nobody
        drifts[from_last] = moved / seconds
        return np.where(is_near, was, len(labels)), is_near, is_same, drifts

    def _stays(self, found: Recognized) -> Mask:
        """[m + 1] whether enough is found of what each stroke painted; the last is of nobody.

        A few pairs are chance, and would carry a stroke of what is gone to what is there.
        """
        num, num_last = len(self.strokes) + 1, len(self.matter)
        rows = found.was[found.is_same & (found.was < num_last)]
        values = np.stack([self.matter.masses, np.ones(num_last)], axis=1)
        kept = sums_by_label(self.labels[rows] % num, values[rows], num)
        return np.asarray((kept >= LEAST_FOUND * sums_by_label(self.labels % num, values, num)).all(axis=1))

    def _move(self, matter: Matter, was: Rows, now: Rows) -> None:
        """Move the strokes to this moment, by the motion of the Gaussians that are `now`."""
        from brushgs.passes.neighbours import nearest

        strokes, last, num = self.strokes, self.matter, len(self.strokes)
        if num == 0 or len(now) == 0:
            return
        x, y = last.points[was[now]].astype(np.float64), matter.points[now].astype(np.float64)
        labels, weights = self.labels[was[now]], weights_of(last.masses)[was[now]]
        kept = labels != NOBODY
        means = means_by_label(labels[kept], weights[kept], (y - x)[kept], num)
        alone = np.flatnonzero(np.bincount(labels[kept], minlength=num) == 0)
        if len(alone):  # they go with what is nearest
            means[alone] = (y - x)[nearest(x[:, :3], strokes.centers[alone, :3], 1)[1][:, 0]]
        strokes.centers += means
        spreads = []
        for points in (x[kept], y[kept]):
            from_mean = points - means_by_label(labels[kept], weights[kept], points, num)[labels[kept]]
            spreads.append(float((weights[kept, None] * from_mean**2).sum()))
        if min(spreads) > 0:  # of all together: of each stroke it would be chance, which adds up
            growth = np.sqrt(np.clip(spreads[1] / spreads[0], MOST_GROWTH**-2, MOST_GROWTH**2))
            strokes.radii *= growth
            strokes.masses *= growth**2

    def _drift(self, rows: Rows, drifts: F64) -> None:
        """Strokes drift as their members do, half as they did: noise that went on would add up."""
        labels, num = self.labels[rows], len(self.strokes)
        means = means_by_label(labels, weights_of(self.matter.masses)[rows], drifts[rows], num)
        self.strokes.drifts = 0.5 * (self.strokes.drifts + means)

    def _settled(self, matter: Matter, drifts: F64, own: Rows, is_free: Mask, is_sure: Mask) -> Rows:
        """The stroke of each Gaussian: its own unless another is clearly nearer, or `NOBODY`.

        Args:
            matter: the Gaussians.
            drifts: [n, 3] how fast each moves.
            own: [n] the stroke that each belonged to, or `NOBODY`.
            is_free: [n] False where it was unpainted.
            is_sure: [n] whether it is the same Gaussian: any other leaves sooner.
        """
        strokes, open_ = self.strokes, self.strokes.open
        radii, centers = strokes.radii, strokes.centers
        rows = np.flatnonzero(own >= 0)
        rows = rows[strokes.lost[own[rows]] < np.inf]
        to_own = np.linalg.norm(matter.points[rows] - centers[own[rows]], axis=1)
        is_within = is_sure[rows] & (to_own <= WITHIN * radii[own[rows]])
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
        is_far = distances > np.where(
            is_free, REACH * radii[labels] + _sizes_of(matter), CLAIM * radii[labels]
        )
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

    def _sleep(self, masses: F64, seconds: float) -> None:
        strokes = self.strokes
        is_alive = masses > ALIVE * strokes.masses
        dies = strokes.lost >= SLEEP  # checked first: one moment without matter kills none, however long
        strokes.lost = np.where(is_alive & (strokes.lost < np.inf), 0.0, strokes.lost + seconds)
        strokes.lost[dies & (strokes.lost > 0)] = np.inf

    def _feed(self) -> None:
        """Strokes that have lost all members get the nearest Gaussian, if it is like them: they stay.

        Where a surface is sampled anew in each moment, small strokes would else come and go.
        """
        from brushgs.passes.neighbours import nearest

        strokes, counts = self.strokes, np.append(self.counts(), NUM_TASTED)  # the last: of nobody
        hungry = np.flatnonzero(strokes.alive & (counts[:-1] == 0))
        if len(hungry) == 0:
            return
        distances, found = nearest(
            self.matter.points, strokes.centers[hungry], min(NUM_TASTED, len(self.matter))
        )
        reach = REACH * np.maximum(strokes.radii[hungry], self.usual_radius())
        is_near = distances <= reach[:, None]
        for rank in range(found.shape[1]):
            left = np.flatnonzero(counts[hungry] == 0)
            rows, first = np.unique(found[left, rank], return_index=True)  # one each
            left, donors = left[first], self.labels[rows]
            gets = is_near[left, rank] & (counts[donors] > 1)
            gets[gets] = _first_of(donors[gets])
            self.labels[rows[gets]] = hungry[left[gets]]
            counts[donors[gets]] -= donors[gets] != NOBODY
            counts[hungry[left[gets]]] = 1

    def _bear(self, *, is_late: bool) -> None:
        """Strokes where unpainted matter has gathered, as large and of as many Gaussians as usual.

        `is_late` says that the next moment is too far away to wait for.
        """
        matter, strokes = self.matter, self.strokes
        excess = matter.masses - TOLERATED * self.accepted
        is_unpainted = (self.labels == NOBODY) & (excess > 0)
        is_cut = excess[is_unpainted].sum() > CUT * matter.masses.sum()
        rows = np.flatnonzero(is_unpainted if is_cut or is_late else is_unpainted & self.is_waiting)
        if len(rows) == 0:
            return
        points, weights, radius = matter.points[rows], weights_of(excess[rows]), self.usual_radius()
        # One in each cell: matter that fills a cube of a side evenly has half of it as radius.
        cells = np.floor(points[:, :3] / (2 * radius)).astype(np.int64)
        used, inverse = np.unique(cells, axis=0, return_inverse=True)
        centers = means_by_label(inverse.ravel(), weights, points, len(used))
        counts = self.counts()
        is_all_new = not counts.any()
        count = len(used) if is_all_new else max(len(used), round(len(rows) / np.median(counts[counts > 0])))
        if self.target is not None:
            count = self.target if is_all_new else min(count, self.target)
        if count != len(used):
            centers = start(points, weights, min(count, len(rows)), 0)[0]
        usual = strokes.masses[strokes.alive]
        least = LEAST_BIRTH * (float(np.median(usual)) if len(usual) else 0.0)
        for is_last in (False, True):
            distances, found = assign(points, centers)
            cell = found.astype(np.intp)
            is_near = (distances <= REACH * radius) | is_all_new
            masses = sums_by_label(cell[is_near], excess[rows[is_near]], len(centers))
            kept = masses > least
            if not kept.any():
                return
            if not is_last:
                centers = centers[kept]
        is_near &= kept[cell]
        place = np.cumsum(kept) - 1
        num = int(kept.sum())
        self.born = self.add(centers[kept], np.full(num, radius), masses[kept], np.zeros((num, 3)))
        self.labels[rows[is_near]] = self.born[place[cell[is_near]]]
        self.center(self.matter, self.labels)
        self.fit(self.born)

    def _merge(self) -> None:
        """Merge strokes that have come to lie in one place: the one with less matter dies."""
        living, other, apart = self.neighbours(self.strokes.alive)
        radii = self.strokes.radii
        crowded = apart < CROWDED * (radii[living] + radii[other]) / 2
        self.join(living[crowded], other[crowded])

    def _spread_out(self) -> Rows:
        """Strokes that have gained much matter and spread."""
        strokes = self.strokes
        gained = self.masses() > GAIN * strokes.masses
        usual = np.maximum(strokes.radii, self.usual_radius())
        return np.flatnonzero(gained & (self.radii() > SPREAD * usual))

    def _keep_number(self, stayed: Mask) -> None:
        """Merge or cut strokes until there are as many as asked for, within `MORE`.

        What is asked of a cut is `stayed`, see `halve`.
        """
        if self.target is None:
            return
        strokes, slack = self.strokes, round(MORE * self.target)
        for _ in range(MOST_ROUNDS):
            if (excess := self._num_painted() - self.target) <= slack:
                break
            some, into, apart = self.neighbours(self._is_shown())
            apart *= np.sqrt(np.minimum(strokes.masses[some], strokes.masses[into]))
            cheapest = np.argsort(apart, kind="stable")
            self.join(some[cheapest], into[cheapest], excess)
        for _ in range(MOST_ROUNDS):
            missing = self.target - self._num_painted()
            if missing <= slack:
                break
            masses, counts = self.masses(), self.counts()
            errors = np.where(self._is_shown() & (counts > 1), masses * self.radii() ** 2, 0.0)
            chosen = np.sort(np.argsort(-errors, kind="stable")[:missing])
            chosen = chosen[errors[chosen] > 0]
            self.halve(chosen, stayed)

    def _is_shown(self) -> Mask:
        """[m] whether strokes are painted and have matter."""
        return self.is_painted & (self.masses() > ALIVE * self.strokes.masses) & (self.strokes.lost < np.inf)

    def _num_painted(self) -> int:
        return int(np.count_nonzero(self._is_shown()))


def _sizes_of(matter: Matter) -> F64:
    """[n] sizes in the space of `Matter.points`: the uncertainty of the position of large Gaussians."""
    return np.asarray(np.linalg.norm(matter.points[:, 3:6], axis=1), np.float64)


def _first_of(values: Rows) -> Mask:
    """Whether each value is the first of its equals."""
    is_first = np.zeros(len(values), bool)
    is_first[np.unique(values, return_index=True)[1]] = True
    return is_first
