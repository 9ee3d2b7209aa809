"""Estimate earlier positions of Gaussians in a clip whose rows do not correspond.

A Gaussian matched in the previous moment was at its position there; any other keeps its offset from the most
similar one.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from brushgs.passes.motion.appearance import Appearance
from brushgs.passes.motion.match import Match, match
from brushgs.passes.motion.matter import Matter
from brushgs.values.arrays import F32, F64, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene


@dataclass(frozen=True, eq=False)
class _Step:
    """Motion from one moment to the next.

    Attributes:
        ahead: [n, 3] displacements of the Gaussians of the moment, world units.
        was: [m] for each Gaussian of the next moment, its match, or the most similar row.
        beside: [m, 3] offset from the position of that row at the next moment; 0 if they match.
    """

    ahead: F32
    was: Rows
    beside: F32


@dataclass(eq=False)
class EstimatedMotion:
    """The Gaussians of a clip at any time, and their positions at earlier times.

    Steps are matched on demand and kept: 28 bytes per Gaussian and moment.

    Attributes:
        scene: the clip, of at least one moment.
        times: [T] seconds of its moments, ascending.
    """

    scene: MovingScene
    times: F64
    _steps: dict[int, _Step | None] = field(default_factory=dict, repr=False)
    _last: tuple[int, Appearance, Match] | None = field(default=None, repr=False)

    def at(self, time: float) -> Gaussians:
        """The Gaussians of the last moment up to a time in seconds, moved towards the next moment."""
        moment, share = self._place(time)
        gaussians = self._moment(moment)
        means = gaussians.means + self._ahead(moment, share)
        return replace(gaussians, means=means.astype(gaussians.means.dtype))

    def means_at(self, then: float, now: float) -> F64:
        """Positions at an earlier time of the Gaussians that `at` returns for a time, [n, 3] world units."""
        first, share = self._place(then)
        moment = self._place(now)[0]
        rows = np.arange(len(self._moment(moment)))
        beside = np.zeros((len(rows), 3))
        for at in range(moment - 1, first - 1, -1):
            step = self._step(at)
            if step is None:  # one of the two has no Gaussians
                return np.asarray(self.at(now).means, np.float64)
            beside += step.beside[rows]
            rows = step.was[rows]
        start = self._moment(first)
        return np.asarray((start.means + self._ahead(first, share))[rows] + beside, np.float64)

    def _place(self, time: float) -> tuple[int, float]:
        position = float(np.interp(time, self.times, np.arange(len(self.times))))
        moment = min(int(position + 1e-6), len(self.times) - 1)
        return moment, max(position - moment, 0.0)

    def _moment(self, moment: int) -> Gaussians:
        return self.scene.at(float(self.times[moment]))

    def _ahead(self, moment: int, share: float) -> F32 | float:
        step = self._step(moment) if share > 0 else None
        return 0.0 if step is None else (share * step.ahead).astype(np.float32)

    def _step(self, moment: int) -> _Step | None:
        """The step from a moment to the next; None if one of the two has no Gaussians."""
        if moment not in self._steps:
            self._steps[moment] = self._matched(moment)
        return self._steps[moment]

    def _matched(self, moment: int) -> _Step | None:
        before, after = (Matter.of(self._moment(number)) for number in (moment, moment + 1))
        if not (len(before) and len(after)):
            return None
        last = None
        if self._last is not None and self._last[0] == moment:
            looks, last = self._last[1:]
        else:
            looks = Appearance.of(before)
        now = Appearance.of(after)
        found = match(looks, now, last)
        self._last = moment + 1, now, found
        beside = np.where(found.is_same[:, None], 0.0, after.means - found.places[found.was])
        ahead = found.places - before.means
        same = np.flatnonzero(found.is_same)
        ahead[found.was[same]] = after.means[same] - before.means[found.was[same]]
        return _Step(ahead.astype(np.float32), found.was, beside.astype(np.float32))
