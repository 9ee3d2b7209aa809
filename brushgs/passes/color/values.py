"""Fit a grading that widens the range of values of a painting and adds a temperature.

Seen through half-closed eyes, oil paintings consist of a few masses that span 44 of CIELAB's lightness L*,
and lights are warmer than darks; captured scenes span 34 and have no temperature. So one curve on L* opens
the masses, and one shift of b* separates lights from darks. Both are fitted once per job, on its unlit
pictures, and applied to the colors of strokes only: every frame has the same.

    frames, subjects -> squints -> curve -> temperature -> Values -> colors of strokes
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from brushgs.passes.color.color_space import in_gamut
from brushgs.passes.color.squint import (
    AROUND_HIGH,
    AROUND_LOW,
    HIGH,
    LOW,
    Squint,
    lab_of,
    rgb_of_lab,
    squinted,
)
from brushgs.values.arrays import F64, Array, Rows, check
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

KNOTS = np.linspace(0, 100, 11)  # L* of the given slopes of the curve; linear between
STEP = float(KNOTS[1])
WEIGHTS = np.array([STEP / 2, *[STEP] * (len(KNOTS) - 2), STEP / 2])  # of slopes in the rise of the curve
MOST_SLOPE = 1.6  # larger slopes separate the strokes of one form
# Minimum slope at each knot. Less makes darks dead black, which is more visible than white lights.
LEAST_SLOPES = np.array([0.7, 0.7, 0.6, *[0.5] * (len(KNOTS) - 3)])
RANGE = 44.0  # of L* after a squint: the mean of 53 oil paintings
# Maximum range, share of the excess that is kept, and maximum reduction.
WIDE, CLOSED, MOST_CLOSED = 46.0, 0.25, 10.0
LEAST_RANGE = 8.0  # smaller ranges are opened less and less: a scene of one value is not stretched
WARMTH = 8.0  # b* of lights above that of darks: of paintings 8.3
WARMEST = 12.0  # maximum after the shift; warmer scenes keep their own
STRONGEST = 9.0  # maximum shift of b* at the ends: more makes a white cloth yellow
RED = 0.25  # shift of a* in that of b*: warm is orange, not lemon
REACH = 12.0  # L* over which the shift grows from its middle
NEAR_BLACK = 20.0  # L* below which the shift fades: a brown table of L* 12 would become blue
CLEAR, CLEAR_WARMTH = -0.35, -3.0  # correlation of L* and b*, and warmth, of scenes whose lights are cool
APART, CHROMA = 10.0, 3.0  # a subject with a smaller difference of masses, or less color, is shifted less
POWER, LEAST_CHROMA, MOST_CHROMA = 0.5, 0.8, 1.12  # of new over old L*: change of chroma; its bounds
EMPTY = 0.4  # cost of a change without any colors, relative to evenly spread ones
ROUNDING = 1e-6
ENOUGH = 0.05  # of L*, tolerance of the target range
MOST_PIXELS = 600  # of lights, and of darks, for fitting a temperature
MOST_SIDE = 96  # pixels of the longer side of a picture that are read
_ROUNDS, _TRIES, _BISECTIONS = 6, 8, 30


@dataclass(frozen=True)
class Values:
    """A grading of colors: a curve on L*, and a shift of temperature along it.

    Attributes:
        slopes: of the curve at `KNOTS`, from `LEAST_SLOPES` to `MOST_SLOPE`; linear between, so that bounds
            hold everywhere. Their weighted mean is 1: the curve maps 0 to 0 and 100 to 100.
        warmth: shift of b* of the lightest colors, and minus that of the darkest; below 0 lights get cooler.
        middle: L* after the curve without a shift of temperature.

    Raises:
        ValueError: if there is not one slope per knot, one is out of range, or their mean is not 1.
    """

    slopes: tuple[float, ...] = (1.0,) * len(KNOTS)
    warmth: float = 0.0
    middle: float = 50.0

    def __post_init__(self) -> None:
        if len(self.slopes) != len(KNOTS):
            raise ValueError(f"Values: there must be {len(KNOTS)} slopes, got {len(self.slopes)}")
        slopes = np.array(self.slopes)
        if not ((slopes >= LEAST_SLOPES - ROUNDING) & (slopes <= MOST_SLOPE + ROUNDING)).all():
            least = float(LEAST_SLOPES.min())
            raise ValueError(f"Values: slopes must be {least:g} to {MOST_SLOPE:g}, got {self.slopes}")
        if abs(climb := float(WEIGHTS @ self.slopes) - 100) > 100 * ROUNDING:
            raise ValueError(f"Values: the curve must lead from 0 to 100, got {100 + climb:g} at its end")

    @property
    def are_plain(self) -> bool:
        """Whether colors are unchanged."""
        return self.warmth == 0 and all(slope == 1 for slope in self.slopes)

    @property
    def without_warmth(self) -> "Values":
        """The curve alone: for a ground, whose temperature already contrasts with the scene."""
        return replace(self, warmth=0.0)

    def at(self, strength: float) -> "Values":
        """A share of the grading.

        Args:
            strength: 0, nothing, to 1, all.

        Raises:
            ValueError: if it is out of range.
        """
        if not 0 <= strength <= 1:
            raise ValueError(f"values must be in [0, 1], got {strength:g}")
        if strength == 1:
            return self
        slopes = tuple(1 + strength * (slope - 1) for slope in self.slopes)
        return replace(self, slopes=slopes, warmth=strength * self.warmth)

    def lightness(self, lightness: Array) -> F64:
        """L* after the curve, of any shape; clipped to 0 to 100 before."""
        return np.asarray(_climbs(lightness) @ np.asarray(self.slopes))

    def colors(self, rgb: Array) -> F64:
        """Colors after the grading.

        L* is a monotone function of L*, except out of gamut: a saturated light stays darker than a gray one,
        see `in_gamut`.

        Args:
            rgb: [n, 3] display-encoded; clipped to 0 to 1.

        Returns:
            [n, 3] float64, 0 to 1; the clipped colors if the grading is plain.
        """
        check("Values.colors", rgb=(rgb, "n 3"))
        inside = np.clip(np.asarray(rgb, np.float64), 0, 1)
        if self.are_plain:
            return inside
        lab = lab_of(inside)
        return in_gamut(lab, self._graded(lab), rgb_of_lab)

    def strokes(self, strokes: Gaussians) -> Gaussians:
        """Strokes in graded colors.

        Args:
            strokes: k strokes, of the subject or its surroundings.

        Returns:
            The strokes with other view-independent colors; the input itself if the grading is plain.
        """
        if self.are_plain or len(strokes) == 0:
            return strokes
        colors = base_colors(strokes.sh)
        return shift_base_colors(strokes, self.colors(colors) - colors)

    def picture(self, rgb: Array) -> F64:
        """A predicted picture [H, W, 3] of graded strokes: each pixel changes like a stroke."""
        return self.colors(np.reshape(rgb, (-1, 3))).reshape(np.shape(rgb))

    def _graded(self, lab: F64) -> F64:
        """CIELAB [n, 3] after the grading; it may be out of gamut."""
        light = lab[:, 0]
        new = self.lightness(light)
        ratio = np.divide(new, light, out=np.full_like(new, self.slopes[0]), where=light > 1e-6)
        chroma = lab[:, 1:] * np.clip(ratio**POWER, LEAST_CHROMA, MOST_CHROMA)[:, None]
        shift = self.warmth * np.tanh((new - self.middle) / REACH) * np.clip(new / NEAR_BLACK, 0, 1)
        return np.concatenate([new[:, None], chroma + shift[:, None] * (RED, 1.0)], axis=1)


def fit_values(
    frames: Sequence[Array],
    subjects: Sequence[Array],
    *,
    strength: float = 1.0,
    before: Sequence[Frame] = (),
) -> Values:
    """Fit the grading of a painting on pictures of it.

    A range of blurred L* below 44 is opened to that as far as the slope allows, and one above 46 is reduced a
    little. Lights of the subject become 8 warmer in b* than its darks if they are less; cooler if those of
    the scene are clearly cool. A subject without light and dark, or without color, keeps its temperature.
    Lights that are more than 12 warmer are reduced to that, or to the value of the scene itself.

    Args:
        frames: of views of the job, [H, W, 3] each, display-encoded, opaque: the whole unlit painting. If the
            longer side is above 144 pixels, every n-th pixel is read. Do not paint them much smaller than 480
            instead: thin strokes get wider in small pictures, which changes the masses of leaves.
        subjects: [H, W] each, 0 to 1: coverage by strokes of the subject.
        strength: see `Values.at`.
        before: plain pictures of the scene, whose temperature may be kept.

    Returns:
        Plain values if no frame shows a subject. They depend on the order of frames by rounding only.

    Raises:
        ValueError: if numbers or sizes of subjects and frames differ, or the strength is out of range.
    """
    if len(frames) != len(subjects):
        counts = f"{len(subjects)} and {len(frames)}"
        raise ValueError(f"fit_values: there must be one subject per frame, got {counts}")
    plain = Values().at(strength)
    pairs = zip(frames, subjects, strict=True)
    seen = [Squint.of(_thinned(frame), _thinned(subject)) for frame, subject in pairs]
    seen = [view for view in seen if view.has_subject]
    if not seen or strength == 0:
        return plain
    return _with_warmth(Values(_fit_slopes(seen)), seen, before).at(strength)


def _thinned(picture: Array) -> Array:
    """Every n-th pixel of a large picture [H, W, ...]: unlike means, these are colors of strokes."""
    step = max(round(max(picture.shape[:2], default=1) / MOST_SIDE), 1)
    return picture[::step, ::step] if step > 1 else picture


def _wanted_range(found: float) -> float:
    """The target range, continuous in the present one."""
    if found > RANGE:
        return max(min(found, WIDE) + CLOSED * max(found - WIDE, 0.0), found - MOST_CLOSED)
    return found + (RANGE - found) * min(found / LEAST_RANGE, 1.0)


def _fit_slopes(seen: Sequence[Squint]) -> tuple[float, ...]:
    """The least-squares change of slopes that gives the target range.

    A picture after the curve is linear in its slopes, and so is its blur. Its range is that between pixels
    near both ends, which are updated after each step.
    """
    maps = [_squinted_climbs(view) for view in seen]
    slopes, costs = np.ones(len(KNOTS)), _costs(seen)
    wanted = _wanted_range(float(np.mean([view.range for view in seen])))
    for _ in range(_ROUNDS):
        ends = [_ends_of(of_view, slopes) for of_view in maps]
        levers = np.mean([levers for levers, _ in ends], axis=0)
        missing = wanted - float(np.mean([found for _, found in ends]))
        if abs(missing) < ENOUGH:
            break
        slopes = _slopes_for(levers, costs, float(levers @ slopes) + missing)
    return tuple(float(slope) for slope in slopes)


def _ends_of(climbs: F64, slopes: F64) -> tuple[F64, float]:
    """[knots] derivative of the range of a view by each slope, and the range, from `_squinted_climbs`."""
    values = climbs @ slopes
    order = np.argsort(values, kind="stable")
    low, high = np.percentile(values, (LOW, HIGH))
    levers = _mean_of(climbs, order, AROUND_HIGH) - _mean_of(climbs, order, AROUND_LOW)
    return levers, float(high - low)


def _squinted_climbs(view: Squint) -> F64:
    """[H W, knots] blurred value of each pixel for a slope of 1 at each knot alone."""
    climbs = np.ascontiguousarray(np.moveaxis(_climbs(view.lab[..., 0]), -1, 0))
    return np.ascontiguousarray(squinted(climbs).reshape(len(KNOTS), -1).T)


def _mean_of(maps: F64, order: Rows, shares: tuple[float, float]) -> F64:
    """[knots] mean over the pixels between two shares of an order; at least one pixel."""
    first, last = (int(share * len(order)) for share in shares)
    return np.asarray(maps[order[first : max(last, first + 1)]].mean(axis=0))


def _slopes_for(levers: F64, costs: F64, asked: float) -> F64:
    """[knots] the slopes of mean 1 whose range, levers @ slopes, is as requested, or nearest to it."""
    pull = levers / WEIGHTS
    most = 2 * (MOST_SLOPE - float(LEAST_SLOPES.min())) * float(costs.max()) / max(float(np.ptp(pull)), 1e-9)
    low, high = -most, most
    for _ in range(_BISECTIONS):
        push = (low + high) / 2
        is_less = levers @ _slopes_of(push * pull, costs) < asked
        low, high = (push, high) if is_less else (low, push)
    return _slopes_of((low + high) / 2 * pull, costs)


def _slopes_of(wishes: F64, costs: F64) -> F64:
    """[knots] slopes within bounds: 1 plus wish over cost, lowered equally to a mean of 1."""

    def lowered(by: F64) -> F64:
        return np.clip(1 + (wishes - by[:, None]) / costs, LEAST_SLOPES, MOST_SLOPE)

    # Where a slope reaches a bound; between two such points the rise is linear.
    bounds = [wishes - costs * (bound - 1) for bound in (LEAST_SLOPES, MOST_SLOPE)]
    places = np.sort(np.concatenate(bounds))
    climbs = lowered(places) @ WEIGHTS
    slopes = lowered(np.interp([-100.0], -climbs, places))[0]
    return np.asarray(slopes + (100 - WEIGHTS @ slopes) / 100)


def _costs(seen: Sequence[Squint]) -> F64:
    """[knots] cost of a change of slope: least where no color of a subject or a picture lies."""
    shares = [
        (_hats(view.lab[view.is_subject, 0]).mean(axis=0) + _hats(view.lab[..., 0]).mean(axis=(0, 1))) / 2
        for view in seen
    ]
    return np.asarray(EMPTY + (1 - EMPTY) * np.mean(shares, axis=0) * len(KNOTS))


def _with_warmth(curve: Values, seen: Sequence[Squint], before: Sequence[Frame]) -> Values:
    """A curve with a shift of temperature, to correct the warmth of the subject."""
    own = [view.warmth for view in seen]
    lights, correlation, chroma, apart = (float(number) for number in np.mean(own, axis=0))
    share = min(chroma / CHROMA, 1.0) * min(apart / APART, 1.0)
    parts = [part for view in seen if (part := _masses_after(curve, view)) is not None]
    if share == 0 or not parts:
        return curve
    sign = -1.0 if correlation <= CLEAR and lights <= CLEAR_WARMTH else 1.0
    middle = float(np.median(np.concatenate([part.lightness for part in parts])))

    def values_with(shift: float) -> Values:
        return replace(curve, warmth=sign * shift, middle=middle)

    def warmth_with(shift: float) -> float:
        return sign * _warmth_of(values_with(shift), parts)

    start = warmth_with(0.0)
    wanted = max(start, WARMTH)
    if start > WARMEST:
        wanted = min(start, max([WARMEST, *(sign * _own_warmth(frame) for frame in before)]))
    if start == wanted:
        return curve
    low, high = (0.0, STRONGEST) if start < wanted else (-STRONGEST, 0.0)
    for _ in range(_TRIES):
        shift = (low + high) / 2
        low, high = (shift, high) if warmth_with(shift) < wanted else (low, shift)
    return values_with(share * (low + high) / 2)


def _warmth_of(values: Values, parts: "Sequence[_Part]") -> float:
    """b* of lights minus that of darks after a grading, mean of views."""
    means = [[lab_of(values.colors(mass))[:, 2].mean() for mass in part.masses] for part in parts]
    return float(np.mean([lights - darks for darks, lights in means]))


def _own_warmth(frame: Frame) -> float:
    """b* of the lights of a scene minus that of its darks, in a plain picture."""
    alpha = _thinned(frame.alpha)
    return Squint.of(_thinned(frame.rgb) + 0.5 * (1 - alpha[..., None]), alpha).warmth.lights


class _Part(NamedTuple):
    """Data of a view: [n] L* of its subject after the curve, and colors [m, 3] of its darks and lights
    before.
    """

    lightness: F64
    masses: tuple[F64, F64]


def _masses_after(curve: Values, view: Squint) -> _Part | None:
    """Pixels for the temperature of a subject; None if it has no darks or no lights."""
    light = curve.lightness(view.lab[..., 0])
    after = replace(view, lab=np.dstack([light, view.lab[..., 1:]]), values=squinted(light))
    darks, lights = (_some(rgb_of_lab(view.lab[mask])) for mask in after.masses)
    return _Part(light[view.is_subject], (darks, lights)) if len(darks) and len(lights) else None


def _some(colors: F64) -> F64:
    """Every n-th of many colors [n, 3]."""
    return colors[:: max(-(-len(colors) // MOST_PIXELS), 1)]


def _hats(lightness: F64) -> F64:
    """[..., knots] hat functions of L*: 1 at a knot, 0 at the next ones; they sum to 1."""
    return np.asarray(np.clip(1 - np.abs(lightness[..., None] - KNOTS) / STEP, 0, 1))


def _climbs(lightness: Array) -> F64:
    """[..., knots] L* after the curve whose slope is 1 at one knot and 0 at the others: integrals of hats."""
    light = np.clip(np.asarray(lightness, np.float64), 0, 100)[..., None]
    past = np.clip((light - KNOTS) / STEP, -1, 1)
    climbs = STEP * (0.5 + past - past * np.abs(past) / 2)
    climbs[..., 0] -= STEP / 2  # nothing lies below the first
    return np.asarray(climbs)
