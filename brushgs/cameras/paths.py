"""Camera paths from options: an orbit around the scene, or the views of a file, with `spline` between them.

A loop of N frames has N different views, 1/N of its length apart; frame N would equal frame 0 and is omitted.
Its frames are every second one of 2 N, so the frame rate does not change the path. An open path includes both
ends: its N frames are every second one of 2 N - 1.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.around import turned
from brushgs.cameras.first_view import framed_camera, framed_orbit
from brushgs.cameras.framing import NEAR_SHARE
from brushgs.cameras.motion import SAME_VIEW, camera_with, is_same_view, lenses, screw_motion, view_changes
from brushgs.cameras.orbit import pivot_of, swing
from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile
from brushgs.options.choices import file_size_rule
from brushgs.options.painting import ViewConfig
from brushgs.options.sequence import DEFAULT_FPS, MAX_FPS, MAX_FRAMES, PathConfig
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera, FirstView


@dataclass(frozen=True)
class _Ball:
    """Bounding ball of the subject: center [3] and radius, world units."""

    center: F64
    radius: float


@dataclass(frozen=True)
class CameraPath:
    """The views of a sequence, all of one size.

    Attributes:
        cameras: one per frame, at least one. A loop does not repeat its first view at the end.
        is_loop: whether the first view follows the last.
        fps: frames per second, > 0.
        source: origin of the path in words, for the report.
    """

    cameras: list[Camera]
    is_loop: bool
    fps: float
    source: str

    @property
    def closed(self) -> list[Camera]:
        """The cameras for tracking: a loop ends with its first view again."""
        return [*self.cameras, self.cameras[0]] if self.is_loop else self.cameras


def standing(camera: Camera, num_frames: int, fps: float) -> CameraPath:
    """The path of a fixed camera."""
    return CameraPath([camera] * num_frames, False, fps, "one view")


def plan_path(first_view: FirstView | None, view: ViewConfig, path: PathConfig) -> CameraPath:
    """The camera path of options.

    Args:
        first_view: of the scene, for distances; None for a scene without Gaussians.
        view: framing of an orbit, and size of the pictures. For a path from a file only `size` is used; None
            takes the size of the file's first camera.
        path: see `PathConfig`.

    Raises:
        ValueError: if `view` has a camera file, or an orbit has no subject.
        SceneError: if the file cannot be read, or holds too few different views for a curve.
    """
    if view.camera_file is not None:
        raise ValueError("camera-file cannot be combined with a camera path, which places the cameras")
    if path.orbit is None:
        return _file_path(first_view, view, path)
    if first_view is None:
        raise ValueError("orbit: the scene must have at least one Gaussian, got none")
    fps = path.fps or DEFAULT_FPS
    photograph = first_view.photograph if view.look_at is None and view.side is None else None
    angle = path.sway
    if angle is None and photograph is not None:
        angle = photograph.cone
    if angle is not None:
        camera = framed_camera(first_view, view)
        pivot = pivot_of(first_view, camera, view.look_at) if photograph is None else photograph.pivot
        cameras = swing(camera, pivot, first_view.up, path.orbit, angle)
        return CameraPath(cameras, True, fps, f"a sway of {np.degrees(angle):.3g} degrees to each side")
    cameras = framed_orbit(first_view, view, path.orbit)
    if first_view.eye is not None and view.look_at is None and view.side is None:
        source = f"a small circle in {path.orbit} steps, inside the scene"
    else:
        source = f"one turn in steps of {360 / path.orbit:g} degrees"
    return CameraPath(cameras, True, fps, source)


def path_through(
    keys: list[Camera],
    first_view: FirstView | None,
    *,
    size: tuple[int, int],
    seconds: float,
    fps: float = DEFAULT_FPS,
    loop: bool = False,
) -> CameraPath:
    """A smooth path through key views, at constant speed.

    Args:
        keys: of any sizes.
        first_view: of the scene, for distances.
        size: (width, height) of the pictures.
        seconds: duration, > 0.
        fps: frames per second, > 0.
        loop: whether the path continues from the last view to the first.

    Raises:
        ValueError: if fewer than two views differ, or three for a loop; or for 100,000 frames or more.
    """
    ball, num_frames = _ball_of(first_view), _num_frames(seconds, fps, loop)
    cameras = _fitted(keys, size, ball)
    frames = through(cameras, num_frames, center=ball.center, reach=ball.radius, loop=loop)
    return CameraPath(frames, loop, fps, f"a curve through {len(keys)} key views")


def turn_around(
    camera: Camera, center: ArrayLike, up: ArrayLike, *, seconds: float, fps: float = DEFAULT_FPS
) -> CameraPath:
    """One turn of a camera around a point, a loop from its position; to its right, like `orbit`.

    Args:
        camera: the first view.
        center: [3] any point of the axis, world units.
        up: [3] direction of the axis, any length > 0.
        seconds: duration, > 0.
        fps: frames per second, > 0.

    Raises:
        ValueError: for 100,000 frames or more.
    """
    num_frames = max(_num_frames(seconds, fps, True), 3)
    turns = (2 * np.pi * (index / num_frames) for index in range(num_frames))
    cameras = [turned(camera, center, up, turn) for turn in turns]
    return CameraPath(cameras, True, fps, f"one turn in steps of {360 / num_frames:g} degrees")


def _file_path(first_view: FirstView | None, view: ViewConfig, path: PathConfig) -> CameraPath:
    from brushgs.formats.cameras.read import read_cameras

    assert path.file is not None
    file = read_cameras(path.file)
    is_loop, fps = path.loop or file.is_loop, path.fps or file.fps or DEFAULT_FPS
    if fps > MAX_FPS:
        raise SceneError(path.file, f"says {fps:g} frames a second, above {MAX_FPS:g}; give --fps")
    ball, size = _ball_of(first_view), view.fixed_size or _size_of(path.file, file.cameras[0])
    cameras = _fitted(_views_of(file, path, fps), size, ball)
    of_file = f"{path.file.name}{file.choice and ', ' + file.choice}"
    if file.motion is not None or not (path.frames or path.seconds):
        if is_loop and len(cameras) > 1 and is_same_view(cameras[-1], cameras[0], ball.radius):
            cameras.pop()
        return CameraPath(cameras, is_loop, fps, f"{len(cameras)} views of {of_file}")
    num_frames = path.frames or _num_frames(path.seconds or 0.0, fps, is_loop)
    try:
        frames = through(cameras, num_frames, center=ball.center, reach=ball.radius, loop=is_loop)
    except ValueError as error:
        raise SceneError(path.file, f"{error}; omit frames and seconds to paint its views") from None
    return CameraPath(frames, is_loop, fps, f"a curve through {len(cameras)} key views of {of_file}")


def _views_of(file: CameraFile, path: PathConfig, fps: float) -> list[Camera]:
    """The views that a path takes from a file: moments of its motion, key views of a curve, or all."""
    if file.motion is not None and (path.frames or path.seconds or path.fps):
        # Continuous motion: another rate or duration samples other moments.
        if path.frames:  # of a loop its caller leaves out the last, which is the first again
            return file.motion.views(path.frames + file.is_loop)
        return file.motion.views(_num_frames(path.seconds or file.motion.seconds, fps, False))
    is_curve = path.frames or path.seconds
    return file.keys if is_curve and len(file.keys) > 1 else file.cameras


def _size_of(path: Path, first: Camera) -> tuple[int, int]:
    """The size of a file's first camera. Raises SceneError if it is too large."""
    if broken := file_size_rule(first.width, first.height):
        raise SceneError(path, broken)
    return first.width, first.height


def _num_frames(seconds: float, fps: float, is_loop: bool) -> int:
    """Number of frames of a duration; an open path has one more, as both its ends are frames."""
    num_steps = round(min(seconds * fps, 2.0 * MAX_FRAMES))
    if not 1 <= num_steps < MAX_FRAMES:
        raise ValueError(f"seconds times fps must give 1 to {MAX_FRAMES} frames, got {seconds * fps:g}")
    return num_steps + (not is_loop)


def _ball_of(first_view: FirstView | None) -> _Ball:
    """The ball of the subject; the unit ball at the origin without one."""
    if first_view is None:
        return _Ball(np.zeros(3), 1.0)
    low, high = first_view.points.min(axis=0), first_view.points.max(axis=0)
    return _Ball(0.5 * (low + high), 0.5 * float((high - low).max()) or 1e-9)


def _fitted(cameras: list[Camera], size: tuple[int, int], ball: _Ball) -> list[Camera]:
    """Cameras of a file in one size, with a common near plane.

    The default near plane, 0.01, is that of training; it is lowered only for small scenes.
    """
    distance = float(np.median([np.linalg.norm(camera.position - ball.center) for camera in cameras]))
    near = min(cameras[0].near, NEAR_SHARE * max(distance, ball.radius))
    same_size = [c if (c.width, c.height) == size else c.resized(*size) for c in cameras]
    return [replace(camera, near=near) for camera in same_size]


# A smooth camera path through key views, at constant speed.


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
