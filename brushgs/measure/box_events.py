"""Abrupt changes of the boxes of strokes from frame to frame, and boxes that do not fit their ellipse.

Everything here measures boxes and paints nothing, so any renderer can be measured.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.rendering.areas import areas_inside, upright_rectangles
from brushgs.values.boxes import Boxes

FLIP = np.pi / 2  # a larger step is a flip
SPIN = np.radians(15.0)  # a step above this and up to a flip is a spin
POP = 1.2  # factor of area in one step, relative to the area of the ellipse
KINK = 0.5  # pixels that a side moves relative to its ellipse in one step; rounding to pixels moves it by 1
INNER = 0.1  # of the smaller side: a stroke further inside cannot leave through the border in one step
ROUNDING = 1e-5  # of the length of a stroke: the rounding of float32 columns in its sides
SLENDER = 0.6  # anisotropy above which a stroke visibly has a direction
OFF_AXIS = np.radians(10.0)
TINY = np.finfo(np.float64).tiny  # in place of a length of zero


@dataclass(frozen=True)
class Events:
    """What happened to the strokes of a sequence; `orientation_events` defines each word.

    Attributes:
        num_steps: pairs of consecutive frames.
        stroke_frames: strokes with a box in both frames of a step, summed over the steps.
        flips: steps of a direction by more than 90 degrees.
        spins: by more than 15 and up to 90 degrees.
        size_pops: changes of area by more than a factor of 1.2 relative to the ellipse.
        kinks: strokes with a side that jumped by more than half a pixel relative to the ellipse.
        vanished: strokes that appeared or vanished inside the picture, each counted by its opacity.
        flip_share: painted area of the flips over that of all stroke-frames.
        spin_share: the same of the spins.
        pop_share: the same of the size pops.
        kink_share: the same of the kinks.
        vanished_share: the same of `vanished`.
        largest_step: of a direction, radians, 0 to pi.
    """

    num_steps: int
    stroke_frames: int
    flips: int
    spins: int
    size_pops: int
    kinks: int
    vanished: float
    flip_share: float
    spin_share: float
    pop_share: float
    kink_share: float
    vanished_share: float
    largest_step: float


def orientation_events(
    boxes: Iterable[Boxes], *, width: int, height: int, ellipses: Iterable[Boxes] | None = None
) -> Events:
    """Count abrupt changes of the strokes of a sequence.

    Boxes are matched by id from each frame to the next. Only strokes with a box in both count, except for
    `vanished`; if ellipses are given, only those with an ellipse. With d the step of a box's direction,
    wrapped to (-pi, pi]: a *flip* is |d| > 90 degrees, a *spin* 15 < |d| <= 90 degrees. The stroke image has
    a head and a tail, so half a turn is a flip.

    Sizes rightly change with the view. The ellipse behind the box (`project(..., lock="off")` of the same
    view and `num_sigmas`) tells which changes do not come from the view:
    - a *size pop*: with q = area of the box / area of the ellipse's own principal box, q changes by more
      than a factor of 1.2. It happens to a box that must cover its ellipse while its direction turns relative
      to the ellipse.
    - a *kink*: the half extent minus the reach of the ellipse along the same axis changes by more than half a
      pixel (and 1e-5 of the stroke's length, the rounding of float32), on either axis, and that change itself
      differs by as much from the one in the step before. The difference is 0 for a box that just covers its
      ellipse, whatever the view and the direction, and grows evenly where a box is widened on purpose; a half
      extent rounded to whole pixels jumps by one whenever the size passes a whole number.

    *Vanished* are strokes with a box in only one frame of a step, if that box reaches into the inner part of
    the picture (a tenth of the smaller side from the border, further than a stroke moves in one small step).
    They count by their opacity: a stroke that has faded out is not counted.

    Shares are weighted by painted area: area of the box x share of its upright bounding rectangle inside the
    picture x opacity, at most the picture; the mean over the two frames of the step (for `vanished` the one
    frame). The denominator is the sum of these weights over all stroke-frames.

    Args:
        boxes: the boxes of each frame, in the order of the frames.
        width: of the picture, pixels.
        height: of the picture, pixels.
        ellipses: the principal boxes of the same frames; None if `boxes` are those, so that nothing can pop.

    Raises:
        ValueError: if the two sequences differ in length or the size is not positive.
    """
    if width < 1 or height < 1:
        raise ValueError(f"orientation_events: size must be at least 1x1, got {width}x{height}")
    counts = _EventCounts()
    before: _BoxMeasures | None = None
    for matched in _match_ellipses(boxes, ellipses):
        now = _BoxMeasures(matched, width, height)
        if before is not None:
            counts.add_step(before, now)
        before = now
    return counts.events()


def off_axis_share(boxes: Iterable[Boxes], ellipses: Iterable[Boxes]) -> float:
    """Share of slender strokes that lie along neither axis of their ellipse.

    Slender is an anisotropy (l1 - l2)/(l1 + l2) above 0.6, l1 and l2 the squared half extents of the
    principal box (so an aspect above 2); off axis is a direction more than 10 degrees from both axes,
    modulo half a turn.

    Args:
        boxes: the boxes of each frame.
        ellipses: `project(..., lock="off")` of the same frames, matched by id.

    Returns:
        Stroke-frames off both axes / slender stroke-frames; 0 if there are none.

    Raises:
        ValueError: as `orientation_events`.
    """
    num_slender = num_off = 0
    for strokes in _match_ellipses(boxes, ellipses):
        squares = strokes.principal_extents**2
        is_slender = np.abs(squares[:, 0] - squares[:, 1]) > SLENDER * squares.sum(axis=1)
        turn = np.remainder(strokes.angles - strokes.principal_angles, np.pi / 2)
        is_off = np.minimum(turn, np.pi / 2 - turn) > OFF_AXIS
        num_slender += int(np.count_nonzero(is_slender))
        num_off += int(np.count_nonzero(is_slender & is_off))
    return num_off / max(1, num_slender)


def worst_shortfall(boxes: Iterable[Boxes], ellipses: Iterable[Boxes]) -> float:
    """How far the worst box falls short of its ellipse, as a share of the reach it needs.

    0 or less: every box contains its ellipse (rounding of float32 columns leaves about 1e-6).

    Args:
        boxes: the boxes of each frame.
        ellipses: `project(..., lock="off")` of the same frames and `num_sigmas`, matched by id.

    Raises:
        ValueError: as `orientation_events`.
    """
    worst = -np.inf
    for strokes in _match_ellipses(boxes, ellipses):
        if len(strokes.ids):
            worst = max(worst, float((1 - strokes.extents / np.maximum(strokes.reach(), TINY)).max()))
    return worst if np.isfinite(worst) else 0.0


class _MatchedBoxes(NamedTuple):
    """The boxes of one frame beside the ellipses they must cover, float64, by ascending id."""

    ids: NDArray[np.int32]  # [M]
    centers: NDArray[np.float64]  # [M, 2]
    extents: NDArray[np.float64]  # [M, 2]
    angles: NDArray[np.float64]  # [M]
    opacities: NDArray[np.float64]  # [M]
    principal_extents: NDArray[np.float64]  # [M, 2]
    principal_angles: NDArray[np.float64]  # [M]

    def reach(self) -> NDArray[np.float64]:
        """[M, 2] half extents of the smallest box around the ellipse along the box's own axes."""
        turn = self.angles - self.principal_angles
        along, across = np.cos(turn)[:, None], np.sin(turn)[:, None]
        a, b = self.principal_extents[:, :1], self.principal_extents[:, 1:]
        u, v = np.hypot(along * a, across * b), np.hypot(across * a, along * b)
        return np.concatenate([u, v], axis=1)


def _match_ellipses(boxes: Iterable[Boxes], ellipses: Iterable[Boxes] | None) -> Iterator[_MatchedBoxes]:
    """The boxes of each frame with the ellipses of the same ids.

    A box whose ellipse has no box of its own is skipped: only a corner of it reaches into the picture.
    """
    pairs = ((b, b) for b in boxes) if ellipses is None else zip(boxes, ellipses, strict=True)
    for box, ellipse in pairs:
        ids, i, j = np.intersect1d(box.ids, ellipse.ids, assume_unique=True, return_indices=True)
        columns = box.centers[i], box.half_extents[i], box.angles[i], box.opacities[i]
        principal = ellipse.half_extents[j], ellipse.angles[j]
        yield _MatchedBoxes(ids, *(column.astype(np.float64) for column in (*columns, *principal)))


class _BoxMeasures:
    """Measures of a frame that `orientation_events` compares."""

    def __init__(self, strokes: _MatchedBoxes, width: int, height: int) -> None:
        self.ids, self.angles, self.opacities = strokes.ids, strokes.angles, strokes.opacities
        extents, principal = (
            np.maximum(sides, TINY) for sides in (strokes.extents, strokes.principal_extents)
        )
        self.log_excess = np.log(extents).sum(axis=1) - np.log(principal).sum(axis=1)
        self.lengths = principal.max(axis=1)
        self.spare_steps = np.zeros_like(extents)  # of `spare`, since the frame before
        self.spare = strokes.extents - strokes.reach()
        low, high = upright_rectangles(strokes.centers, extents, self.angles)
        self.weights = areas_inside(extents, low, high, width, height) * self.opacities
        inset, size = INNER * min(width, height), np.array([width, height], np.float64)
        self.is_inner: NDArray[np.bool_] = np.all((high > inset) & (low < size - inset), axis=1)


class _EventCounts:
    """Running sums of `Events`."""

    def __init__(self) -> None:
        self.num_steps = self.stroke_frames = 0
        self.counts = np.zeros(4, np.int64)  # flips, spins, size pops, kinks
        self.areas = np.zeros(4)
        self.area = self.vanished = self.vanished_area = self.largest = 0.0

    def add_step(self, before: _BoxMeasures, now: _BoxMeasures) -> None:
        _, i, j = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
        step = np.abs(np.remainder(now.angles[j] - before.angles[i] + np.pi, 2 * np.pi) - np.pi)
        spare_steps = now.spare[j] - before.spare[i]
        jumps = np.minimum(np.abs(spare_steps), np.abs(spare_steps - before.spare_steps[i])).max(axis=1)
        now.spare_steps[j] = spare_steps
        lengths = np.maximum(before.lengths[i], now.lengths[j])
        is_event = np.stack(
            [
                step > FLIP,
                (step > SPIN) & (step <= FLIP),
                np.abs(now.log_excess[j] - before.log_excess[i]) > np.log(POP),
                jumps > KINK + ROUNDING * lengths,
            ]
        )
        weights = 0.5 * (before.weights[i] + now.weights[j])
        self.num_steps += 1
        self.stroke_frames += len(i)
        self.area += float(weights.sum())
        self.counts += np.count_nonzero(is_event, axis=1)
        self.areas += is_event @ weights
        self.largest = max(self.largest, float(step.max(initial=0)))
        for strokes, rows in ((before, i), (now, j)):
            is_alone = strokes.is_inner.copy()
            is_alone[rows] = False
            self.vanished += float(strokes.opacities[is_alone].sum())
            self.vanished_area += float(strokes.weights[is_alone].sum())

    def events(self) -> Events:
        area = self.area or 1.0
        flips, spins, size_pops, kinks = self.counts.tolist()
        flip_share, spin_share, pop_share, kink_share = (self.areas / area).tolist()
        return Events(
            num_steps=self.num_steps,
            stroke_frames=self.stroke_frames,
            flips=flips,
            spins=spins,
            size_pops=size_pops,
            kinks=kinks,
            vanished=self.vanished,
            flip_share=flip_share,
            spin_share=spin_share,
            pop_share=pop_share,
            kink_share=kink_share,
            vanished_share=self.vanished_area / area,
            largest_step=self.largest,
        )
