"""Assign the Gaussians of consecutive moments to strokes, where rows do not correspond.

Each moment starts from the strokes of the previous one. Every Gaussian first inherits the stroke of the
Gaussian that it matches in the previous moment (`match`). It changes strokes only if another center is
clearly nearer (hysteresis), while the centers follow their members (Lloyd). Gaussians far from all strokes
are unpainted: strokes are born there. Strokes that lose their matter sleep, then wake if it returns soon, or
die. Strokes that come to overlap are merged; strokes that gain much matter and spread are cut in two. At the
end of each step the number of strokes is brought near the target: the nearest pairs are merged if there are
too many, the largest strokes are cut if there are too few.
Source: Litwinowicz 1997 and Hays and Essa 2004, whose painted videos add strokes where paint thins and
remove them where it crowds.
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
# Lengths are in stroke radii: the RMS distance of the members to their center.
NEAR = 2.0  # a Gaussian farther than this from its match in the previous moment is new
WITHIN = 1.0  # a Gaussian nearer than this to the center of its stroke never leaves it
MARGIN = 0.7  # a Gaussian leaves if another center is nearer by this factor
REACH = 2.5  # a Gaussian that is new or left its stroke is unpainted if farther than this from all centers
CLAIM = 1.25  # an unpainted Gaussian joins a stroke only if nearer than this to its center
CROWDED = 0.25  # strokes are merged if their centers are nearer than this, in mean radii of the two
# Relative to the median stroke of the scene.
LEAST_BIRTH = 0.25  # minimum mass for the birth of a stroke
CUT = 0.05  # share of all mass: if more is new at once it is a cut, not flicker, and is painted immediately
# Relative to the usual mass (and radius) of the stroke itself.
ALIVE = 0.05
GAIN, SPREAD = 2.5, 1.6  # mass and radius at which a stroke is cut
ADAPTING = 0.1  # rate at which the usual mass and radius of a stroke adapt to the current ones
TOLERATED = 2.0  # factor by which matter that the caller left unpainted may grow and stay unpainted
HORIZON = 0.1  # seconds of drift that are added to distances, so that what moves apart counts as apart
SLEEP = 0.5  # seconds in which a stroke without matter can wake
COVERED = np.array([0, 1, 2, 6, 7, 8])  # columns of the features: position and color
LEAST_FOUND = 0.2  # share of a stroke's matter and members; with fewer matched, its matches are dropped
WAITING = 0.1  # seconds; if moments are no farther apart, new matter must be present in two of them
MOST_GROWTH = 1.5  # maximum factor of length in a step
NUM_TASTED = 6  # nearest Gaussians tried for a stroke that has lost all members
MORE = 0.03  # share of the target by which the number of strokes may be off before some are merged or cut
MOST_ROUNDS = 20  # rounds of merging, and of cutting: each changes up to a third of the strokes


@dataclass(frozen=True, eq=False)
class Pairs:
    """Matched Gaussians of two consecutive moments.

    Attributes:
        before: [p] rows in the previous moment.
        after: [p] rows in this moment, ascending.
    """

    before: Rows
    after: Rows


@dataclass(eq=False)
class Carrier(Members):
    """Carries strokes from moment to moment.

    Attributes:
        frame: center and radius of the scene.
        accepted: [n] mass of each Gaussian that the caller left unpainted in the first moment.
        is_waiting: [n] whether each was already unpainted in the previous moment: matter that appears for a
            single moment gets no stroke.
        target: number of strokes at every moment; None for no limit.
        recognizer: matches Gaussians from moment to moment.
        missed: Gaussians missing from the last moment, see `Recognized`.
        missed_labels: their strokes, as in `labels`.
        missed_accepted: their masses, as in `accepted`.
        shares: for each step, the share of its Gaussians that were matched in the previous moment.
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
            rows: its rows that have a stroke.
            labels: their strokes, 0 to m - 1, each in use.
            is_painted: [m] whether a stroke is painted and counts towards `target`.
            frame: center and radius of the scene.
            target: number of strokes at every moment; None for no limit.
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
            # Pruned Gaussians join the strokes around them: they are present in later moments too.
            of_all = carrier._settled(matter, np.zeros((len(matter), 3)), of_all, of_all >= 0, of_all >= 0)
            carrier.labels = of_all
            carrier.center(matter, of_all)
            carrier.remember(1.0)
        carrier.accepted = np.where(of_all == NOBODY, matter.masses, 0.0)
        return carrier

    def step(self, matter: Matter, seconds: float) -> Pairs:
        """Carry the strokes to the next moment, and set `labels` to the strokes of its Gaussians.

        Args:
            matter: of the moment.
            seconds: since the last moment.

        An empty moment only puts all strokes to sleep.
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
        # The extra last row stands for Gaussians without a match.
        own = np.append(known_labels, NOBODY)[nearest]
        accepted = np.concatenate([known_accepted, [0.0]])[nearest]
        was_unpainted = is_near & (own == NOBODY)
        # A new Gaussian next to matter that was left unpainted is left unpainted too.
        accepted = np.where(is_only | (accepted == 0), accepted, matter.masses)
        accepted[~was_unpainted] = 0.0
        strokes, labels = self.strokes, np.full(len(matter), NOBODY)
        for _ in range(NUM_STEPS if len(strokes.open) else 0):
            labels = self._settled(matter, drifts, own, ~was_unpainted, is_only)
            # New matter does not move centers yet: strokes at its border would run into it.
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
        """Match each Gaussian to the previous moment, and move the strokes.

        Args:
            matter: of the moment.
            labels: [n] strokes of the Gaussians of the last moment, then of those missing from it.
            seconds: since the last moment.

        Returns:
            The matched row, or one past the last if none is near; whether one is near; whether it is the same
            Gaussian; and the velocity of each Gaussian, that of its stroke if it has no match.
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
        drifts = np.append(self.strokes.drifts, np.zeros((1, 3)), axis=0)[own]  # last row: NOBODY
        drifts[from_last] = moved / seconds
        return np.where(is_near, was, len(labels)), is_near, is_same, drifts

    def _stays(self, found: Recognized) -> Mask:
        """Whether enough of the matter of each stroke is matched, [m + 1]; the last is for `NOBODY`.

        A few pairs are chance, and would carry a stroke whose matter is gone to something else.
        """
        num, num_last = len(self.strokes) + 1, len(self.matter)
        rows = found.was[found.is_same & (found.was < num_last)]
        values = np.stack([self.matter.masses, np.ones(num_last)], axis=1)
        kept = sums_by_label(self.labels[rows] % num, values[rows], num)
        return np.asarray((kept >= LEAST_FOUND * sums_by_label(self.labels % num, values, num)).all(axis=1))

    def _move(self, matter: Matter, was: Rows, now: Rows) -> None:
        """Move the strokes by the motion of the matched Gaussians: rows `was[now]` before, `now` after."""
        from brushgs.passes.neighbours import nearest

        strokes, last, num = self.strokes, self.matter, len(self.strokes)
        if num == 0 or len(now) == 0:
            return
        x, y = last.points[was[now]].astype(np.float64), matter.points[now].astype(np.float64)
        labels, weights = self.labels[was[now]], weights_of(last.masses)[was[now]]
        kept = labels != NOBODY
        means = means_by_label(labels[kept], weights[kept], (y - x)[kept], num)
        alone = np.flatnonzero(np.bincount(labels[kept], minlength=num) == 0)
        if len(alone):  # strokes without matches follow the nearest one
            means[alone] = (y - x)[nearest(x[:, :3], strokes.centers[alone, :3], 1)[1][:, 0]]
        strokes.centers += means
        spreads = []
        for points in (x[kept], y[kept]):
            from_mean = points - means_by_label(labels[kept], weights[kept], points, num)[labels[kept]]
            spreads.append(float((weights[kept, None] * from_mean**2).sum()))
        if min(spreads) > 0:  # one factor for all: per stroke it would be noise, which adds up
            growth = np.sqrt(np.clip(spreads[1] / spreads[0], MOST_GROWTH**-2, MOST_GROWTH**2))
            strokes.radii *= growth
            strokes.masses *= growth**2

    def _drift(self, rows: Rows, drifts: F64) -> None:
        """Set the drift of strokes to the mean of its old value and that of its members, to damp noise."""
        labels, num = self.labels[rows], len(self.strokes)
        means = means_by_label(labels, weights_of(self.matter.masses)[rows], drifts[rows], num)
        self.strokes.drifts = 0.5 * (self.strokes.drifts + means)

    def _settled(self, matter: Matter, drifts: F64, own: Rows, is_free: Mask, is_sure: Mask) -> Rows:
        """The stroke of each Gaussian: its own unless another is clearly nearer, or `NOBODY`.

        Args:
            matter: the Gaussians.
            drifts: [n, 3] velocity of each.
            own: [n] the previous stroke of each, or `NOBODY`.
            is_free: [n] False where a Gaussian was unpainted.
            is_sure: [n] whether the match is the same Gaussian: all others change strokes sooner.
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
        """Give unpainted Gaussians to a stroke of their position and color with at least their mass.

        Size and shape do not count: such a place is already painted.
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
        dies = (
            strokes.lost >= SLEEP
        )  # before the update: one moment without matter, however long, never kills
        strokes.lost = np.where(is_alive & (strokes.lost < np.inf), 0.0, strokes.lost + seconds)
        strokes.lost[dies & (strokes.lost > 0)] = np.inf

    def _feed(self) -> None:
        """Give strokes that have lost all members the nearest similar Gaussian, which keeps them alive.

        Otherwise small strokes would flicker where each moment samples a surface anew.
        """
        from brushgs.passes.neighbours import nearest

        strokes, counts = self.strokes, np.append(self.counts(), NUM_TASTED)  # last: NOBODY
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
            rows, first = np.unique(found[left, rank], return_index=True)  # one stroke per Gaussian
            left, donors = left[first], self.labels[rows]
            gets = is_near[left, rank] & (counts[donors] > 1)
            gets[gets] = _first_of(donors[gets])
            self.labels[rows[gets]] = hungry[left[gets]]
            counts[donors[gets]] -= donors[gets] != NOBODY
            counts[hungry[left[gets]]] = 1

    def _bear(self, *, is_late: bool) -> None:
        """Add strokes of usual size and number of members where unpainted matter has gathered.

        `is_late`: moments are too far apart to wait for the next one.
        """
        matter, strokes = self.matter, self.strokes
        excess = matter.masses - TOLERATED * self.accepted
        is_unpainted = (self.labels == NOBODY) & (excess > 0)
        is_cut = excess[is_unpainted].sum() > CUT * matter.masses.sum()
        rows = np.flatnonzero(is_unpainted if is_cut or is_late else is_unpainted & self.is_waiting)
        if len(rows) == 0:
            return
        points, weights, radius = matter.points[rows], weights_of(excess[rows]), self.usual_radius()
        # One per cell: matter that fills a cube evenly has half its side as radius.
        cells = np.floor(points[:, :3] / (2 * radius)).astype(np.int64)
        used, inverse = np.unique(cells, axis=0, return_inverse=True)
        centers = means_by_label(inverse.ravel(), weights, points, len(used))
        counts = self.counts()
        is_all_new = not counts.any()
        count = len(used) if is_all_new else max(len(used), round(len(rows) / np.median(counts[counts > 0])))
        if self.target is not None:
            count = self.target if is_all_new else min(count, self.target)
        if count != len(used):
            centers = start(points, weights, min(count, len(rows)))
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
        """Merge strokes that have come to overlap: the one with less matter dies."""
        living, other, apart = self.neighbours(self.strokes.alive)
        radii = self.strokes.radii
        crowded = apart < CROWDED * (radii[living] + radii[other]) / 2
        self.join(living[crowded], other[crowded])

    def _spread_out(self) -> Rows:
        """Rows of the strokes that have gained much matter and spread."""
        strokes = self.strokes
        gained = self.masses() > GAIN * strokes.masses
        usual = np.maximum(strokes.radii, self.usual_radius())
        return np.flatnonzero(gained & (self.radii() > SPREAD * usual))

    def _keep_number(self, stayed: Mask) -> None:
        """Merge or cut strokes until their number is within `MORE` of the target.

        For `stayed` see `halve`.
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
    """Sizes of Gaussians in the space of `Matter.points`, [n]: the uncertainty of their positions."""
    return np.asarray(np.linalg.norm(matter.points[:, 3:6], axis=1), np.float64)


def _first_of(values: Rows) -> Mask:
    """Whether each value is its first occurrence."""
    is_first = np.zeros(len(values), bool)
    is_first[np.unique(values, return_index=True)[1]] = True
    return is_first
