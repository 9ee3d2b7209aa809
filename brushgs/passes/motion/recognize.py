"""Match Gaussians from moment to moment, including those that are missing for a short time."""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.motion.appearance import Appearance
from brushgs.passes.motion.match import Match, match
from brushgs.passes.motion.matter import Matter
from brushgs.values.arrays import F64, Mask, Rows

MISSED = 0.12  # maximum seconds for which a Gaussian may be missing and still be matched
# Share of Gaussians matched in the previous moment below which the two are unrelated. Of one body sampled
# anew in each moment 0.6 are matched; of a bear against a plant 0.11.
UNRELATED = 0.2


@dataclass(frozen=True, eq=False)
class Recognized:
    """Correspondence of the m Gaussians of a moment with those known before.

    Attributes:
        was: [m] the most similar of the n known rows: those of the last moment, then those missing from it.
        is_same: [m] whether it is the same Gaussian.
        places: [n, 3] predicted positions of the known ones now, world units.
        share: share of the Gaussians that are matched.
        is_other: whether the moment is unrelated to the last; then no Gaussian is the same.
        missed: known rows that are missing now, in their new order.
    """

    was: Rows
    is_same: Mask
    places: F64
    share: float
    is_other: bool
    missed: Rows


class Recognizer:
    """Matches Gaussians from moment to moment; remembers missing ones for a short time.

    Example:
        >>> from brushgs.passes.motion.matter import Matter
        >>> from brushgs.still_life import still_life
        >>> scene = still_life(1000)
        >>> recognizer = Recognizer(Matter.of(scene))
        >>> found = recognizer.step(Matter.of(scene.take(range(999, -1, -1))), seconds=1 / 24)
        >>> found.was[:3], found.share
        (array([999, 998, 997]), 1.0)
    """

    def __init__(self, first: Matter) -> None:
        self._known = Appearance.of(first)
        self._since = np.zeros(len(first))  # seconds for which each has been missing
        self._last: Match | None = None

    def step(self, matter: Matter, seconds: float) -> Recognized:
        """Match the next moment, `seconds` later; neither it nor the previous one may be empty."""
        now = Appearance.of(matter)
        found = match(self._known, now, self._last)
        since = self._since + seconds
        since[found.was[found.is_same]] = np.inf
        is_other = found.share < UNRELATED
        missed = np.flatnonzero((since <= MISSED) & (not is_other))
        steps = np.concatenate([found.steps, (found.places - self._known.means)[missed]])
        self._last = None if is_other else replace(found, steps=steps)
        self._known = now.joined(self._known.take(missed, found.places[missed]))
        self._since = np.concatenate([np.zeros(len(now)), since[missed]])
        is_same = found.is_same & (not is_other)
        return Recognized(found.was, is_same, found.places, found.share, is_other, missed)
