"""The smooth way through key views, at an even speed."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from brushgs.arrays import F64
from brushgs.cameras.motion import camera_with, lenses, screw_motion, view_changes
from brushgs.scene import Camera

Mix = Callable[[F64, F64, F64], F64]  # what lies between two values, at a share of the way

SAME_VIEW = 1e-6  # radians: views closer than this are one; text with seven digits tells no more
# Per pair of key views, by which the length of the way is measured; fewer where there are thousands of keys.
_SAMPLES, _FEWEST_SAMPLES, _MOST_SAMPLES = 64, 8, 200_000
_SECANT_STEPS = 4  # each gains two digits or more, on a way that is nearly even within a sample


class CameraSpline:
    """The smooth way through key views, and where on it a view is, by the length of the way.

    Between two keys the view follows a cubic Bezier curve of rigid motions: the construction of de
    Casteljau with screw motions for straight lines. Position, rotation and lens have no kink at the
    keys. Keys on an orbit give that orbit, whatever their spacing; two keys give the screw motion.
    Length is `view_change`, at the distance of the subject, so equal lengths look equally fast.
    Sources: Crouch, Kun and Silva Leite 1999, The De Casteljau Algorithm on Lie Groups and Spheres;
    the knots are centripetal (Yuksel et al. 2011), which makes no loops or cusps of uneven keys.

    Args:
        keys: views of one size; of neighbours that are the same view one counts.
        center: [3] where the subject is, world units.
        reach: half the size of the subject, > 0: a camera inside it counts as this far away.
        loop: whether the way goes on from the last key to the first.

    Raises:
        ValueError: if fewer than two views differ, or three for a loop.
    """

    def __init__(self, keys: list[Camera], *, center: ArrayLike, reach: float, loop: bool = False) -> None:
        self.center, self.reach = np.asarray(center, dtype=np.float64), reach
        self.size = keys[0].width, keys[0].height
        views, lens = np.stack([key.viewmat for key in keys]), lenses(keys)
        ends = [*range(1, len(keys)), 0] if loop else [*range(1, len(keys))]
        steps = self._changes(views[: len(ends)], views[ends])
        moves = steps > SAME_VIEW  # of a loop the last step leads back to the first key
        kept = moves if loop else np.append(moves, True)
        if kept.sum() < 2 + loop:
            found = max(1, int(kept.sum()))
            raise ValueError(f"a path must have at least {2 + loop} different key views, got {found}")
        views, lens, widths = views[kept], lens[kept], np.sqrt(steps[moves])
        self.knots = np.concatenate([[0.0], np.cumsum(widths)])
        self._views = _bezier_points(views, widths, loop, screw_motion)
        self._lens = _bezier_points(lens, widths, loop, _straight)
        fineness = max(_FEWEST_SAMPLES, min(_SAMPLES, _MOST_SAMPLES // len(widths)))
        pieces = np.arange(len(widths) * fineness + 1) / fineness
        self._places = np.interp(pieces, np.arange(len(self.knots)), self.knots)
        self._samples, _ = self._at(self._places)
        lengths = self._changes(self._samples[:-1], self._samples[1:])
        self._lengths = np.concatenate([[0.0], np.cumsum(lengths)])

    @property
    def length(self) -> float:
        """Of the whole way, radians."""
        return float(self._lengths[-1])

    def cameras(self, shares: ArrayLike) -> list[Camera]:
        """The cameras at shares [n] of the whole length, 0 to 1."""
        return self.at(self._place_of(np.asarray(shares, dtype=np.float64) * self.length))

    def at(self, places: ArrayLike) -> list[Camera]:
        """The cameras at places [n] of the parameter, 0 to `knots[-1]`; at a knot it is a key view."""
        views, lens = self._at(np.asarray(places, dtype=np.float64))
        return [camera_with(view, row, *self.size) for view, row in zip(views, lens, strict=True)]

    def _at(self, places: F64) -> tuple[F64, F64]:
        piece = np.clip(np.searchsorted(self.knots, places, side="right") - 1, 0, len(self.knots) - 2)
        shares = (places - self.knots[piece]) / np.diff(self.knots)[piece]
        views = _de_casteljau([points[piece] for points in self._views], shares, screw_motion)
        return views, _de_casteljau([points[piece] for points in self._lens], shares, _straight)

    def _place_of(self, lengths: F64) -> F64:
        """Places at which the way is so long: between two samples, then drawn closer by secants."""
        sample = np.searchsorted(self._lengths, lengths, side="right") - 1
        sample = np.clip(sample, 0, len(self._places) - 2)
        start, width = self._places[sample], np.diff(self._places)[sample]
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
    """`num_frames` cameras at an even speed along a `CameraSpline`; takes and raises the same.

    Of an open path first and last camera are its ends. Of a loop the first camera is not repeated.
    """
    path = CameraSpline(keys, center=center, reach=reach, loop=loop)
    num_steps = num_frames if loop else num_frames - 1
    return path.cameras(np.arange(num_frames) / max(1, num_steps))


def _bezier_points(keys: F64, widths: F64, loop: bool, mix: Mix) -> list[F64]:
    """Four control points [pieces, ...] of each piece of the curve through `keys`.

    At a key the speed is that of the parabola through it and its neighbours: the mean of the speeds of
    both pieces, each weighed with the width of the other. It is found as a point reached shortly after
    the key, because motions have no sum. At the ends of an open path it is the speed to the neighbour.
    """
    num_pieces = len(widths)
    start, end = keys[:num_pieces], np.roll(keys, -1, axis=0)[:num_pieces]
    after, before = mix(start, end, np.full(num_pieces, 1 / 3)), mix(start, end, np.full(num_pieces, 2 / 3))
    inner = slice(0, num_pieces) if loop else slice(1, num_pieces)
    into = np.roll(np.arange(num_pieces), 1)[inner]  # the pieces that end where those of `inner` start
    out_width, in_width = widths[inner], widths[into]
    short = np.minimum(in_width, out_width) / 3
    straight_on = mix(start[into], end[into], 1 + short / in_width)
    ahead = mix(start[inner], end[inner], short / out_width)
    reached = mix(straight_on, ahead, in_width / (in_width + out_width))
    after[inner] = mix(start[inner], reached, out_width / (3 * short))
    before[into] = mix(start[inner], reached, -in_width / (3 * short))
    return [start, after, before, end]


def _de_casteljau(points: list[F64], shares: F64, mix: Mix) -> F64:
    """Points of Bezier curves, by control points [n, ...] and shares [n]."""
    while len(points) > 1:
        points = [mix(a, b, shares) for a, b in pairwise(points)]
    return points[0]


def _straight(first: F64, second: F64, shares: F64) -> F64:
    return first + (second - first) * shares[:, None]
