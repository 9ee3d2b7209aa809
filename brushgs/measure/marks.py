"""The three goals of painted animation: flatness, motion coherence and temporal continuity.

They conflict: marks of constant size on the picture cannot stick to a surface that comes nearer, and
otherwise marks must be replaced. Source of the terms: Benard, Bousseau and Thollot 2011, State-of-the-Art
Report on Temporal Coherence for Stylized Animations. This module measures them for marks with known boxes.
Everything here measures boxes and paints nothing.

All figures are weighted by the painted area of a mark: the area of its box within the picture times its
opacity.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.measure.box_events import INNER
from brushgs.measure.flow import SceneFlow
from brushgs.rendering.areas import TINY, areas_inside, upright_rectangles
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.boxes import Boxes

POP = 0.2  # of the area of a mark: a larger change of its painted area in one step is a pop


@dataclass(frozen=True)
class MarkFigures:
    """Figures of the marks of a clip, defined by `MarkMeter`; 0 is best for each.

    Attributes:
        size_drift: flatness: difference of sizes on the picture from those of the first frame, octaves.
        direction_drift: flatness: the same for directions, radians, 0 to pi / 2.
        slip: motion coherence: motion of marks relative to the scene, in mark sizes per step; None if no
            mark was on a known surface.
        slip_pixels: the same in pixels per step.
        births: temporal continuity: share of the painted area that appears at once, per second.
        deaths: temporal continuity: share that vanishes at once, per second.
        pops: temporal continuity: share that changes at once, per second.
    """

    size_drift: float
    direction_drift: float
    slip: float | None
    slip_pixels: float | None
    births: float
    deaths: float
    pops: float


def earth_movers(values: F64, weights: F64, others: F64, other_weights: F64) -> float:
    """The earth mover's distance of two weighted samples on a line; 0 if one has no weight."""
    ends, ahead = _ahead(values, weights, others, other_weights)
    return float(np.abs(ahead[:-1]) @ np.diff(ends)) if len(ends) else 0.0


def circular_earth_movers(
    values: F64, weights: F64, others: F64, other_weights: F64, *, period: float
) -> float:
    """The same on a circle of length `period`. Source: Rabin, Delon and Gousseau 2011."""
    ends, ahead = _ahead(np.mod(values, period), weights, np.mod(others, period), other_weights)
    if not len(ends):
        return 0.0
    lengths = np.diff(ends, append=ends[0] + period)
    order = np.argsort(ahead)  # circulation around the circle is free: the weighted median is best
    middle = ahead[order][np.searchsorted(np.cumsum(lengths[order]), 0.5 * period)]
    return float(np.abs(ahead - middle) @ lengths)


def _ahead(values: F64, weights: F64, others: F64, other_weights: F64) -> tuple[F64, F64]:
    """All values in order, and after each the difference of the cumulative shares of the two samples."""
    if not (weights.sum() > 0 and other_weights.sum() > 0):
        return np.empty(0), np.empty(0)
    both = np.concatenate([values, others])
    shares = np.concatenate([weights / weights.sum(), -other_weights / other_weights.sum()])
    order = np.argsort(both)
    return both[order], np.cumsum(shares[order])


class _Marks(NamedTuple):
    """Data of a frame for comparison, by ascending id."""

    ids: NDArray[np.int32]  # [M]
    centers: F64  # [M, 2]
    sizes: F64  # [M] log2 pixels
    angles: F64  # [M]
    areas: F64  # [M] within the picture, pixels
    opacities: F64  # [M]
    depths: F64 | None  # [M]
    is_inner: Mask  # [M]

    @classmethod
    def of(cls, boxes: Boxes, width: int, height: int, *, in_space: bool) -> "_Marks":
        rows = np.argsort(boxes.ids)
        columns = boxes.centers, boxes.half_extents, boxes.angles, boxes.opacities, boxes.depths
        centers, extents, angles, opacities, depths = (c[rows].astype(np.float64) for c in columns)
        extents = np.maximum(extents, TINY)
        low, high = upright_rectangles(centers, extents, angles)
        inset, size = INNER * min(width, height), np.array([width, height], np.float64)
        return cls(
            boxes.ids[rows],
            centers,
            1 + 0.5 * np.log2(extents).sum(axis=1),
            angles,
            areas_inside(extents, low, high, width, height),
            opacities,
            depths if in_space else None,
            np.all((high > inset) & (low < size - inset), axis=1),
        )

    @property
    def weights(self) -> F64:
        """[M] painted areas."""
        return self.areas * self.opacities


class MarkMeter:
    """Measures the marks of a clip frame by frame. Marks are matched by id from each frame to the next.

    *Flatness*: do sizes and directions of marks on the picture stay constant, even if the camera comes near?
    The size of a mark is log2 of the geometric mean of its two sides in pixels, its direction its angle
    modulo half a turn. The distribution of each in a frame, weighted by painted area, is compared with that
    of the first frame by the earth mover's distance, for directions on the circle (Rabin, Delon and Gousseau
    2011): how far paint has to be moved, on average. The drift is the mean over the frames after the first. 1
    octave is twice the size.

    *Motion coherence*: do marks move with the scene? For each mark in both frames of a step that lies on the
    scene (`SceneFlow.at`), its own motion minus the flow of the scene at it, from the later frame. The slip
    is the root of the mean square, weighted by the mean painted area of both frames, in pixels and in sizes
    of the mark in the later frame.

    *Temporal continuity*: does paint appear and disappear gradually? Births are marks of the later frame
    without a box in the earlier one, deaths the reverse, pops marks of both whose painted area changes by
    more than 0.2 of the larger of their two areas. Each is weighted by its painted area, a pop by the mean of
    both, so that a mark that fades in over several frames hardly counts as a birth. Marks outside the inner
    part of the picture (a tenth of the smaller side from the border) do not count, since they may have
    crossed the border. The sum over all steps is divided by the mean painted area of a frame and by the
    duration of the clip in seconds.

    Args:
        width: of the picture, pixels.
        height: of the picture, pixels.
        in_space: whether the depths of the marks are those of the scene; for marks on the picture they only
            define an order.
    """

    def __init__(self, *, width: int, height: int, in_space: bool = True) -> None:
        if width < 1 or height < 1:
            raise ValueError(f"MarkMeter: the size must be > 0, got {width}x{height}")
        self._width, self._height, self._in_space = width, height, in_space
        self._first: _Marks | None = None
        self._before: _Marks | None = None
        self._frames = 0
        self._area = self._births = self._deaths = self._pops = 0.0
        self._slip = self._slip_pixels = self._slip_weight = 0.0
        self._sizes: list[float] = []
        self._directions: list[float] = []

    def add(self, boxes: Boxes, flow: SceneFlow | None) -> None:
        """Take the next frame.

        Args:
            boxes: its marks.
            flow: from the frame before to this one; None for the first.

        Raises:
            ValueError: if a frame after the first has no flow.
        """
        now = _Marks.of(boxes, self._width, self._height, in_space=self._in_space)
        first, before = self._first or now, self._before
        self._first, self._before = first, now
        self._frames += 1
        self._area += float(now.weights.sum())
        if before is None:
            return
        if flow is None:
            raise ValueError(f"MarkMeter: {self._frames} frames need {self._frames - 1} flows")
        self._sizes.append(earth_movers(first.sizes, first.weights, now.sizes, now.weights))
        angles = first.angles, first.weights, now.angles, now.weights
        self._directions.append(circular_earth_movers(*angles, period=np.pi))
        self._add_step(before, now, flow)

    def _add_step(self, before: "_Marks", now: "_Marks", flow: SceneFlow) -> None:
        _, i, j = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
        old, new = before.weights, now.weights
        weights = 0.5 * (old[i] + new[j])
        depths = None if now.depths is None else now.depths[j]
        expected, is_known = flow.at(now.centers[j], depths)
        squares = ((now.centers[j] - before.centers[i] - expected)[is_known] ** 2).sum(axis=1)
        known = weights[is_known]
        self._slip_pixels += float(known @ squares)
        self._slip += float(known @ (squares / 4 ** now.sizes[j][is_known]))
        self._slip_weight += float(known.sum())
        is_pop = np.abs(new[j] - old[i]) > POP * np.maximum(before.areas[i], now.areas[j])
        is_pop &= before.is_inner[i] & now.is_inner[j]
        self._pops += float(weights[is_pop].sum())
        self._births += _alone(now, j)
        self._deaths += _alone(before, i)

    def figures(self, fps: float) -> MarkFigures:
        """The figures of all frames so far, at `fps` > 0 frames per second.

        Raises:
            ValueError: if there is no frame, or `fps` is not above 0.
        """
        if not fps > 0:
            raise ValueError(f"MarkMeter: fps must be > 0, got {fps:g}")
        if not self._frames:
            raise ValueError("MarkMeter: there must be a frame, got none")
        rate = fps * self._frames / (max(1, self._frames - 1) * (self._area or 1.0))
        known = self._slip_weight
        return MarkFigures(
            size_drift=float(np.mean(self._sizes)) if self._sizes else 0.0,
            direction_drift=float(np.mean(self._directions)) if self._directions else 0.0,
            slip=float(np.sqrt(self._slip / known)) if known > 0 else None,
            slip_pixels=float(np.sqrt(self._slip_pixels / known)) if known > 0 else None,
            births=rate * self._births,
            deaths=rate * self._deaths,
            pops=rate * self._pops,
        )


def _alone(marks: _Marks, matched: Rows) -> float:
    """Painted area of the inner marks that are not among the matched ones."""
    is_alone = marks.is_inner.copy()
    is_alone[matched] = False
    return float(marks.weights[is_alone].sum())
