"""Reorder a clip whose files hold the same Gaussians in different orders, so that rows correspond."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.motion.appearance import Appearance, among, mutual_nearest
from brushgs.passes.motion.match import COARSE, LOOKS_WEIGHT, Match, match
from brushgs.passes.motion.matter import Matter
from brushgs.rendering.motion import zeros_over_time
from brushgs.values.arrays import F64, Rows
from brushgs.values.correspondence import between, unmoved
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

LEAST_FOUND = 0.95  # minimum share of rows matched between moments
FEW = 0.004  # share of unmatched rows that may be paired without a test of looks
ALIKE = 0.3  # maximum ratio of their differences in looks to those from random rows
NUM_ROUNDS = 30  # rounds in which unmatched rows are paired


@dataclass(frozen=True, eq=False)
class Found:
    """Result of reordering a clip.

    Attributes:
        scene: the clip with rows that correspond; None if they could not be matched in every moment.
        shares: [s] share of rows matched in each tested step, 0 to 1.
        why: the reason if `scene` is None, as a clause.
    """

    scene: MovingScene | None
    shares: F64
    why: str = ""


def found_again(scene: MovingScene, moments: F64, advance: Callable[[], None] = lambda: None) -> Found:
    """Match the rows of each moment of a clip to those of the next, see `match`.

    Args:
        scene: a clip of moments whose rows do not correspond; two are in memory at once.
        moments: [T] times of the clip, ascending; times outside are clamped to the first or last.
        advance: called after each moment.

    Returns:
        The clip in the order of the first moment. Unmatched rows, at most 5 % of a moment, are paired with
        the remaining ones, nearest first. Times between moments are interpolated; duration and notes stay.
    """
    first = scene.at(float(moments[0]))
    if len(first) == 0:
        return Found(None, np.zeros(0), "the first moment holds no Gaussians")
    orders: NDArray[np.int32] = zeros_over_time((len(moments), len(first)), np.int32)
    orders[0] = np.arange(len(first))
    rests, shares = np.ones(len(first), bool), np.zeros(0)
    last, looks, found = first, _looks(first), None
    advance()
    for at in range(1, len(moments)):
        now = scene.at(float(moments[at]))
        if len(now) != len(first):
            return Found(None, shares, f"moments hold {len(first):,} and {len(now):,} Gaussians")
        next_looks = _looks(now)
        found = match(looks, next_looks, found)
        shares = np.append(shares, found.share)
        if found.share < LEAST_FOUND:
            return Found(None, shares, f"only {found.share:.0%} of a moment are found in the next")
        is_now = _is_now(found, looks, next_looks)
        if is_now is None:
            return Found(None, shares, f"{1 - found.share:.1%} of a moment are not found in the next")
        orders[at] = is_now[orders[at - 1]]
        ordered = now.take(orders[at])
        rests &= unmoved(last, ordered)
        last, looks = ordered, next_looks
        advance()
    rows = FoundRows(scene, moments, orders)
    return Found(replace(scene, has_rows=True, sample=rows.sample, resting=rests), shares)


def _looks(gaussians: Gaussians) -> Appearance:
    return Appearance.of(Matter.of(gaussians))


def _is_now(found: Match, before: Appearance, after: Appearance) -> Rows | None:
    """The row now of each Gaussian before, a permutation [n]; None if too many are missing.

    Unmatched rows are paired with the remaining ones, if those are more similar than random rows.
    """
    is_now = np.full(len(before), -1)
    same = np.flatnonzero(found.is_same)
    is_now[found.was[same]] = same
    left, rest = np.flatnonzero(is_now < 0), np.flatnonzero(~found.is_same)
    if not len(left):
        return is_now
    after = after.in_light_of(before)
    if len(left) > FEW * len(before):
        others = np.random.default_rng(0).permutation(len(after))[: len(rest)]
        looks = before.looks[left].astype(np.float32)
        away, by_chance = (np.median(among(looks, after.looks[some])[0]) for some in (rest, others))
        if not away < ALIKE * by_chance:
            return None
    for _ in range(NUM_ROUNDS):
        if not len(left):
            break
        ours = after.keys(after.places(found.places[left]), before.looks[left], COARSE, LOOKS_WEIGHT)
        theirs = after.keys(after.own_places[rest], after.looks[rest], COARSE, LOOKS_WEIGHT)
        _, partner, is_mutual = mutual_nearest(ours, theirs)
        is_now[left[is_mutual]] = rest[partner[is_mutual]]
        rest = np.delete(rest, partner[is_mutual])
        left = left[~is_mutual]
    is_now[left] = rest
    return is_now


@dataclass(frozen=True, eq=False)
class FoundRows:
    """Samples a clip in one order of rows; keeps the last two moments.

    Attributes:
        scene: the original clip.
        moments: [T] seconds, ascending.
        orders: [T, N] the row at each moment of each row of the first moment.
    """

    scene: MovingScene
    moments: F64
    orders: NDArray[np.int32]
    _kept: dict[int, Gaussians] = field(default_factory=dict, repr=False)

    def sample(self, time: float) -> Gaussians:
        """The Gaussians at a time, in seconds."""
        position = float(np.interp(time, self.moments, np.arange(len(self.moments))))
        before = int(position)
        if position == before:
            return self._at(before)
        return between(self._at(before), self._at(before + 1), position - before)

    def _at(self, index: int) -> Gaussians:
        if index not in self._kept:
            while len(self._kept) > 1:
                self._kept.pop(next(iter(self._kept)))
            self._kept[index] = self.scene.at(float(self.moments[index])).take(self.orders[index])
        return self._kept[index]

    def __getstate__(self) -> dict[str, Any]:
        """State for pickle, without the moments in memory: scenes are sent between processes."""
        return vars(self) | {"_kept": {}}
