"""A smooth camera path through key views, at constant speed."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.motion import SAME_VIEW, camera_with, lenses, screw_motion, view_changes
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera

Interpolate = Callable[[F64, F64, F64], F64]  # (first, second, shares) -> values between them

# Samples per pair of key views, for arc length; fewer for thousands of keys.
_SAMPLES, _FEWEST_SAMPLES, _MOST_SAMPLES = 64, 8, 200_000
_SECANT_STEPS = 4  # each gains two digits or more: speed is nearly constant between samples


class CameraSpline:
    """A spline of rigid motions through key views, parametrized by arc length.

    Between two keys the view follows a cubic Bezier curve: de Casteljau's algorithm with screw motions in
    place of straight lines. Position, rotation and lens have continuous derivatives at the keys. Keys on an
    orbit give that orbit, whatever their spacing; two keys give the screw motion. Arc length is `view_change`
    at the distance of the subject, so equal lengths look equally fast.
    Sources: Crouch, Kun and Silva Leite 1999, The De Casteljau Algorithm on Lie Groups and Spheres; the knots
    are centripetal (Yuksel et al. 2011), which avoids loops and cusps at uneven keys.

    Args:
        keys: views of one size; a key equal to its neighbor is dropped.
        center: [3] of the subject, world units.
        reach: half the size of the subject, > 0; the least distance of a camera.
        loop: whether the path continues from the last key to the first.

    Raises:
        ValueError: if fewer than two views differ, or three for a loop.
    """

    def __init__(self, keys: list[Camera], *, center: ArrayLike, reach: float, loop: bool = False) -> None:
        self.center, self.reach = np.asarray(center, dtype=np.float64), reach
        self.size = keys[0].width, keys[0].height
        views, lens = np.stack([key.viewmat for key in keys]), lenses(keys)
        ends = [*range(1, len(keys)), 0] if loop else [*range(1, len(keys))]
        steps = self._changes(views[: len(ends)], views[ends])
        moves = steps > SAME_VIEW  # in a loop the last step leads to the first key
        kept = moves if loop else np.append(moves, True)
        if kept.sum() < 2 + loop:
            found = max(1, int(kept.sum()))
            raise ValueError(f"a path must have at least {2 + loop} different key views, got {found}")
        views, lens, widths = views[kept], lens[kept], np.sqrt(steps[moves])
        self.knots = np.concatenate([[0.0], np.cumsum(widths)])
        self._views = _bezier_points(views, widths, loop, screw_motion)
        self._lens = _bezier_points(lens, widths, loop, _linear)
        fineness = max(_FEWEST_SAMPLES, min(_SAMPLES, _MOST_SAMPLES // len(widths)))
        pieces = np.arange(len(widths) * fineness + 1) / fineness
        self._sample_parameters = np.interp(pieces, np.arange(len(self.knots)), self.knots)
        self._samples, _ = self._at(self._sample_parameters)
        lengths = self._changes(self._samples[:-1], self._samples[1:])
        self._lengths = np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """Arc length of the whole path, radians."""
        return float(self._lengths[-1])

    def cameras(self, shares: ArrayLike) -> list[Camera]:
        """The cameras at shares [n] of the arc length, 0 to 1."""
        return self.at(self._parameters_at(np.asarray(shares, dtype=np.float64) * self.length))

    def at(self, parameters: ArrayLike) -> list[Camera]:
        """The cameras at parameters [n], 0 to `knots[-1]`; at a knot they are key views."""
        views, lens = self._at(np.asarray(parameters, dtype=np.float64))
        return [camera_with(view, row, *self.size) for view, row in zip(views, lens, strict=True)]

    def _at(self, parameters: F64) -> tuple[F64, F64]:
        piece = np.clip(np.searchsorted(self.knots, parameters, side="right") - 1, 0, len(self.knots) - 2)
        shares = (parameters - self.knots[piece]) / np.diff(self.knots)[piece]
        views = _de_casteljau([points[piece] for points in self._views], shares, screw_motion)
        return views, _de_casteljau([points[piece] for points in self._lens], shares, _linear)

    def _parameters_at(self, lengths: F64) -> F64:
        """Parameters at arc lengths [n]: by the samples on both sides, then refined by the secant method."""
        sample = np.searchsorted(self._lengths, lengths, side="right") - 1
        sample = np.clip(sample, 0, len(self._sample_parameters) - 2)
        start, width = self._sample_parameters[sample], np.diff(self._sample_parameters)[sample]
        rest, whole = lengths - self._lengths[sample], np.diff(self._lengths)[sample]
        ratio = np.where(whole > 0, rest / np.where(whole > 0, whole, 1.0), 0.0)
        shares = np.clip(ratio, 0, 1)
        for _ in range(_SECANT_STEPS):
            views, _ = self._at(start + shares * width)
            reached = self._changes(self._samples[sample], views)
            rate = np.where(reached > 0, shares / np.where(reached > 0, reached, 1.0), 0.0)
            shares = np.clip(rate * rest, 0, 1)
        return np.asarray(start + shares * width)

    def _changes(self, first: F64, second: F64) -> F64:
        distances = 0.5 * (self._distances(first) + self._distances(second))
        return view_changes(first, second, np.maximum(distances, self.reach))

    def _distances(self, views: F64) -> F64:
        return np.asarray(np.linalg.norm(views[:, :3, :3] @ self.center + views[:, :3, 3], axis=1))


def through(
    keys: list[Camera], num_frames: int, *, center: ArrayLike, reach: float, loop: bool = False
) -> list[Camera]:
    """`num_frames` cameras at constant speed along a `CameraSpline`; other arguments and errors are the same.

    An open path includes both ends; a loop does not repeat its first camera.
    """
    path = CameraSpline(keys, center=center, reach=reach, loop=loop)
    num_steps = num_frames if loop else num_frames - 1
    return path.cameras(np.arange(num_frames) / max(1, num_steps))


def _bezier_points(keys: F64, widths: F64, loop: bool, interpolate: Interpolate) -> list[F64]:
    """Four control points [pieces, ...] of each piece of the curve through `keys`.

    The velocity at a key is that of the parabola through it and its neighbors: the mean of the velocities of
    both pieces, each weighted by the width of the other. Motions cannot be added, so it is represented by the
    pose shortly after the key. At the ends of an open path it is the velocity to the neighbor.
    """
    num_pieces = len(widths)
    start, end = keys[:num_pieces], np.roll(keys, -1, axis=0)[:num_pieces]
    after, before = (
        interpolate(start, end, np.full(num_pieces, 1 / 3)),
        interpolate(start, end, np.full(num_pieces, 2 / 3)),
    )
    inner = slice(0, num_pieces) if loop else slice(1, num_pieces)
    into = np.roll(np.arange(num_pieces), 1)[inner]  # the pieces that end where those of `inner` start
    out_width, in_width = widths[inner], widths[into]
    short = np.minimum(in_width, out_width) / 3
    straight_on = interpolate(start[into], end[into], 1 + short / in_width)
    ahead = interpolate(start[inner], end[inner], short / out_width)
    reached = interpolate(straight_on, ahead, in_width / (in_width + out_width))
    after[inner] = interpolate(start[inner], reached, out_width / (3 * short))
    before[into] = interpolate(start[inner], reached, -in_width / (3 * short))
    return [start, after, before, end]


def _de_casteljau(points: list[F64], shares: F64, interpolate: Interpolate) -> F64:
    """Points of Bezier curves, by control points [n, ...] and shares [n]."""
    while len(points) > 1:
        points = [interpolate(a, b, shares) for a, b in pairwise(points)]
    return points[0]


def _linear(first: F64, second: F64, shares: F64) -> F64:
    return first + (second - first) * shares[:, None]
