"""Sums over the comparisons of painted frames, by configuration and gap."""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.measure.stability.figures import Loop, Turning, Warp
from brushgs.measure.stability.painters import PLAIN
from brushgs.measure.warp import View, ViewMatch, WarpError, match_views
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes


@dataclass
class PaintedFrame:
    """One frame in every configuration.

    Attributes:
        pictures: [H, W, 3] on the background, by configuration.
        view: the plain picture with its depth.
        unlocked: the boxes of the strokes without a lock.
        means: [N, 3] of the plain scene; None for a still scene.
    """

    pictures: dict[str, Array]
    view: View
    unlocked: Boxes
    means: Array | None = None


class PairErrors:
    """Running results of all comparisons."""

    def __init__(self, names: list[str]) -> None:
        self.names = names
        self.starts: list[int] = []  # earlier frames of the pairs at gap 1
        self._errors: dict[str, dict[int, list[WarpError]]] = {name: {} for name in names}  # by gap
        self._marks: dict[str, dict[int, list[tuple[float, float]]]] = {name: {} for name in names}
        self._turning = dict.fromkeys(names, 0.0)  # sum of weight x squared error
        self._turning_weight = 0.0
        self._loops: dict[str, Loop] = {}

    def add_pair(
        self,
        gap: int,
        start: int,
        first: PaintedFrame,
        second: PaintedFrame,
        weights: Array | None,
        displacement: Array | None = None,
    ) -> None:
        """Compare two frames, if any surface is visible in both.

        Args:
            gap: frames from the first to the second.
            start: number of the first frame.
            first: the earlier frame.
            second: the later frame.
            weights: [H, W] of the pixels of the second view for `turning`; None adds nothing to it.
            displacement: see `match_views`.
        """
        match = match_views(first.view, second.view, displacement)
        if not len(match.pixels):
            return
        if gap == 1:
            self.starts.append(start)
        valid = weights.reshape(-1)[match.pixels].astype(np.float64) if weights is not None else None
        for name in self.names:
            error = match.error(first.pictures[name], second.pictures[name], keep_map=valid is not None)
            if valid is not None and error.squared_error is not None:
                self._turning[name] += float(valid @ error.squared_error.reshape(-1)[match.pixels])
            self._errors[name].setdefault(gap, []).append(replace(error, squared_error=None))
            self._marks[name].setdefault(gap, []).append(_marks(match, first, second, name))
        if valid is not None:
            self._turning_weight += float(valid.sum())

    def add_loop(self, first: PaintedFrame, last: PaintedFrame) -> None:
        """Compare the ends of a closed path."""
        for name in self.names:
            difference = last.pictures[name].astype(np.float64) - first.pictures[name]
            rmse = float(np.sqrt(np.mean(difference**2)))
            self._loops[name] = Loop(rmse, float(np.abs(difference).max()))

    def rmse_at_gap_1(self, name: str) -> tuple[float, ...]:
        """RMSE of each pair at gap 1, in the order of `starts`."""
        return tuple(error.rmse for error in self._errors[name].get(1, []))

    def loop(self, name: str) -> Loop | None:
        """The ends of the path; None on an open one."""
        return self._loops.get(name)

    def warps(self, name: str) -> tuple[Warp, ...]:
        """Means over the pairs of each gap."""
        return tuple(self._warp(name, gap) for gap in sorted(self._errors[name]))

    def turning(self, name: str) -> Turning | None:
        """The error where strokes turn; None if no turning stroke was visible."""
        if not self._turning_weight > 0:
            return None
        rmse, plain = (float(np.sqrt(self._turning[n] / self._turning_weight)) for n in (name, PLAIN))
        return Turning(rmse, rmse - plain)

    def _warp(self, name: str, gap: int) -> Warp:
        own, plain = (
            np.array([(e.rmse, e.worst_1pct, e.valid_share) for e in self._errors[which][gap]])
            for which in (name, PLAIN)
        )
        rmse, worst, share = own.mean(axis=0).tolist()
        excess, excess_worst, _ = (own - plain).mean(axis=0).tolist()
        marks, redrawn = np.mean(self._marks[name][gap], axis=0).tolist()
        return Warp(
            gap,
            len(own),
            rmse,
            worst,
            share,
            excess,
            excess_worst,
            marks,
            redrawn if marks > 0 else None,
        )


def _marks(match: ViewMatch, first: PaintedFrame, second: PaintedFrame, name: str) -> tuple[float, float]:
    """The marks of a painting over valid pixels: RMS, and the redrawn share."""
    before, now = (frame.pictures[name] - frame.pictures[PLAIN] for frame in (first, second))
    moved, here = match.moved(before).astype(np.float64), now.reshape(-1, 3)[match.pixels].astype(np.float64)
    power = float((moved**2 + here**2).sum())
    changed = float(((here - moved) ** 2).sum())
    return float(np.sqrt((here**2).mean())), float(np.sqrt(changed / power)) if power > 0 else 0.0
