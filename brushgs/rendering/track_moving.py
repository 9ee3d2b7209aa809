"""A camera path through a clip -> directions of strokes in each frame, for moving strokes.

Still strokes are tracked by `track_directions`. Moving ones are tracked over views and moments at once,
relative to the object that they paint: an object that turns in the picture takes its strokes with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, inf, pi, radians

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.knots import Knots, knots_of, middle_and_reach
from brushgs.rendering.motion import SHIFT, TURN, Pose, StrokeMotion, match, zeros_over_time
from brushgs.rendering.project import LOW_PASS, Directions
from brushgs.rendering.track import (
    NUM_STILLS,
    TRACKED_COLUMNS,
    Agreement,
    Track,
    checked_cameras,
    directions_along,
    pointing_as_stills,
    sampled,
)
from brushgs.values.arrays import F32, F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import conjugates, normalized, quat_products, rotation_matrices, twists

# An object whose view changes by more from knot to knot jumps: the eye cannot follow. A quarter turn per step
# jumps; a board at one turn per second, 12 degrees per step, does not.
JUMP = radians(30)
CHUNK = 1 << 26  # bytes of a chunk of strokes at all knots
LEAST_ROWS = 64  # rows per chunk in the core
SAME_MOMENT = 1e-6  # in frames: tolerance for a knot at a frame


@dataclass(frozen=True, eq=False)
class MovingTrack:
    """Directions of strokes along a clip.

    Attributes:
        resting: track of still strokes.
        moving: track of moving strokes, relative to their objects.
        rests: [r] rows of still strokes.
        moves: [m] rows of moving strokes.
        things: [m] row in `carried` of each moving stroke's object.
        carried: [F, S] int16, rotation of objects in the picture by their own motion, in 2^-16 turns.
    """

    resting: Track
    moving: Track
    rests: Rows
    moves: Rows
    things: Rows
    carried: NDArray[np.int16]

    def __len__(self) -> int:
        """Number of frames of the clip."""
        return len(self.positions)

    @property
    def positions(self) -> F64:
        """[F] positions of frames among the knots; consecutive frames at the same position are equal."""
        return self.moving.positions if len(self.moves) else self.resting.positions

    def place(self, frame: int) -> float:
        """Position of a frame among the knots."""
        return float(self.positions[frame])

    def directions(self, frame: int) -> Directions:
        """Directions of strokes in one frame, for `project` and `render`.

        Args:
            frame: index of the frame, 0 to F - 1.

        Raises:
            IndexError: if there is no such frame.
        """
        resting, moving = self.resting.directions(frame), self.moving.directions(frame)
        angles = np.empty(len(self.rests) + len(self.moves), np.float32)
        angles[self.rests] = resting.angles
        carried = self.carried[frame][self.things] * np.float32(2 * pi / 65536)
        turned = moving.angles + carried
        angles[self.moves] = turned - np.float32(2 * pi) * np.rint(turned * np.float32(0.5 / pi))
        if resting.area_scales is None and moving.area_scales is None:
            return Directions(angles)
        area_scales = np.ones(len(angles), np.float32)
        for rows, part in ((self.rests, resting), (self.moves, moving)):
            if part.area_scales is not None:
                area_scales[rows] = part.area_scales
        return Directions(angles, area_scales)


def track_moving(
    strokes: Gaussians,
    cameras: Sequence[Camera],
    motion: StrokeMotion,
    positions: F64,
    *,
    fps: float,
    low_pass: float = LOW_PASS,
    num_threads: int | None = None,
) -> MovingTrack:
    """Choose the directions of strokes over a whole clip.

    Still strokes are tracked as by `track_directions`. For moving ones the path leads through views and
    moments: its knots are also at most 1/30 s of playing time apart, so that the result hardly depends on the
    frame rate. At each knot the core uses the ellipse of the stroke at that moment.

    Directions are chosen relative to the object that a stroke paints. Its rotation in the picture is the sum
    over moments of the twist of the stroke's motion about the line of sight to its pivot (swing-twist
    decomposition), independent of the camera. So a stroke turns by at most 5.2 degrees per 1/30 s (7.2 on a
    closed path with a half turn; at coarse camera steps as far as stated in `track_directions`) beyond the
    object's own rotation.

    Where the view of an object changes by more than 30 degrees from knot to knot (cuts in time, teleports,
    very fast tumbling), directions before and after are independent: the stroke may spin by up to 88 degrees,
    at the cost of a box 1.35 times as large, as between camera frames far apart.

    If the last camera equals the first, and strokes return to their first pose, as in a loop forward and
    back, the path is closed: directions return to their first values. The net rotation of an object in the
    picture (a wheel that rolls forth in front of the camera and back behind it) is subtracted evenly where it
    turns.

    Args:
        strokes: N strokes at their reference moments, with the ids of `motion`; others do not move.
        cameras: the F views in order, all of one size.
        motion: poses of the strokes.
        positions: [F] moment of each frame among those of the motion, 0 to T - 1, in any order; between
            frames the moments are traversed evenly.
        fps: frames per second of playback.
        low_pass: variance added to both axes, pixels squared, >= 0; see `project`.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if there is no camera, sizes differ, there is not one position for each camera, one is out
            of range, or `fps` is not positive.
    """
    cameras = checked_cameras(cameras)
    positions = _checked_positions(positions, len(cameras), len(motion.times))
    if not 0 < fps < inf:
        raise ValueError(f"track: fps must be positive and finite, got {fps}")
    extent, threads = middle_and_reach(strokes), num_threads_or_default(num_threads)
    moves, found = match(strokes, motion.ids)
    is_resting = np.ones(len(strokes), bool)
    is_resting[moves] = False
    rests = np.flatnonzero(is_resting)
    still = knots_of(cameras, *extent)
    resting = directions_along(
        still,
        strokes.take(rests).columns(),
        cameras[0],
        low_pass=low_pass,
        num_threads=threads,
    )
    resting = pointing_as_stills(resting, still, strokes, cameras[0], threads, rests)
    seconds = np.where(np.diff(positions) == 0, 0.0, 1 / fps)
    knots = knots_of(cameras, *extent, seconds=seconds, ends_meet=positions[0] == positions[-1])
    clip = _Clip(motion, knots, _moments_of(knots, cameras, positions), cameras[0], low_pass, threads)
    moves, found = (rows[np.argsort(found, kind="stable")] for rows in (moves, found))
    moving, carried = clip.track(strokes.take(moves), found)
    things = np.unique(found, return_inverse=True)[1]
    path = MovingTrack(resting, moving, rests, moves, things, carried)
    return _pointing_as_stills(path, strokes, cameras, motion, positions, threads)


def _pointing_as_stills(
    path: MovingTrack,
    strokes: Gaussians,
    cameras: Sequence[Camera],
    motion: StrokeMotion,
    positions: F64,
    num_threads: int,
) -> MovingTrack:
    """The path with moving strokes reversed that point opposite to stills in most of their visible area."""
    if len(path.moves) == 0:
        return path
    found = Agreement(len(strokes), num_threads)
    for frame in sampled(len(cameras), NUM_STILLS):
        moved = motion.pose(float(positions[frame])).moved(strokes)
        found.look(moved, cameras[frame], path.directions(frame).angles)
    path.moving.turns[:] += found.half_turns[path.moves]  # in place, as turns of a long clip are in a file
    return path


def _checked_positions(positions: F64, num_frames: int, num_moments: int) -> F64:
    positions = np.asarray(positions, np.float64)
    if positions.shape != (num_frames,):
        raise ValueError(
            f"track: positions must be one for each of {num_frames} cameras, got shape {positions.shape}"
        )
    is_wrong = ~((positions >= 0) & (positions <= max(num_moments - 1, 0)))
    if is_wrong.any():
        raise ValueError(
            f"track: positions must lie in 0 to {num_moments - 1}, got {positions[np.argmax(is_wrong)]:g}"
        )
    return positions


@dataclass(frozen=True, eq=False)
class _Moments:
    """Knots and frames of a clip in playing order, without duplicates.

    Attributes:
        positions: [m] among the moments of the motion.
        eyes: [m, 3] camera centers, world units.
        knots: [K] rows of the knots.
        frames: [F] rows of the frames.
    """

    positions: F64
    eyes: F64
    knots: Rows
    frames: Rows

    def __len__(self) -> int:
        return len(self.positions)


def _moments_of(knots: Knots, cameras: list[Camera], positions: F64) -> _Moments:
    nearest = np.rint(knots.among_frames)
    is_frame = np.abs(knots.among_frames - nearest) < SAME_MOMENT
    of_knots = np.where(is_frame, nearest, knots.among_frames)
    of_frames = np.arange(len(cameras), dtype=np.float64)
    at = np.union1d(of_knots, of_frames)
    rows_of_knots, rows_of_frames = np.searchsorted(at, of_knots), np.searchsorted(at, of_frames)
    eyes = np.empty((len(at), 3))
    turns, shifts = knots.viewmats[:, :3, :3], knots.viewmats[:, :3, 3]
    eyes[rows_of_knots] = -np.einsum("kji,kj->ki", turns, shifts)
    eyes[rows_of_frames] = [camera.position for camera in cameras]
    return _Moments(np.interp(at, of_frames, positions), eyes, rows_of_knots, rows_of_frames)


@dataclass(frozen=True, eq=False)
class _Clip:
    """Inputs for tracking moving strokes."""

    motion: StrokeMotion
    knots: Knots
    moments: _Moments
    camera: Camera  # gives the picture size
    low_pass: float
    num_threads: int

    def track(self, strokes: Gaussians, found: Rows) -> tuple[Track, NDArray[np.int16]]:
        """Directions relative to the objects, and the objects' own rotation [F, S].

        `found` is the row of the motion for each stroke, ascending.
        """
        num_knots, n = len(self.knots.among_frames), len(strokes)
        things = np.unique(found)
        carried = zeros_over_time((len(self.moments.frames), len(things)), np.int16)
        turns, area_scales = zeros_over_time((num_knots, n), np.int16), None
        num_bytes = 11 * strokes.means.itemsize + 21  # per stroke and knot, including its object
        step = max(LEAST_ROWS, int(CHUNK / (num_knots * num_bytes)))
        for begin in range(0, n, step):
            rows = slice(begin, min(begin + step, n))
            part = slice(found[rows.start], found[rows.stop - 1] + 1)
            motion = replace(
                self.motion,
                ids=self.motion.ids[part],
                pivots=self.motion.pivots[part],
                table=self.motion.table[:, part],
            )
            of_rows = found[rows] - part.start
            sample = self._sample(strokes.take(rows), motion, of_rows)
            tracked = directions_along(
                self.knots,
                sample.columns,
                self.camera,
                carried=_wrapped(np.take(sample.carried[self.moments.knots], of_rows, axis=1)),
                jumps=np.take(sample.jumps, of_rows, axis=1),
                low_pass=self.low_pass,
                num_threads=self.num_threads,
            )
            turns[:, rows] = tracked.turns
            if tracked.area_scales is not None:
                if area_scales is None:
                    area_scales = zeros_over_time((num_knots, n), np.uint16)
                area_scales[:, rows] = tracked.area_scales
            here = np.flatnonzero((things >= part.start) & (things < part.stop))
            of_frames = sample.carried[self.moments.frames][:, things[here] - part.start]
            carried[:, here] = np.rint(_wrapped(of_frames) * np.float32(65536 / (2 * pi))).astype(np.int32)
        return Track(turns, area_scales, self.knots.positions), carried

    def _sample(self, strokes: Gaussians, motion: StrokeMotion, found: Rows) -> "_Sample":
        """Strokes at every knot; `found` is the row of the motion for each."""
        num_knots, num_things, moments = len(self.moments.knots), len(motion.ids), self.moments
        bare = replace(strokes, sh=np.zeros((len(strokes), 1, 3), strokes.sh.dtype), brushes=None)
        columns = {
            name: np.empty((num_knots, *column.shape), column.dtype)
            for name, column in bare.columns().items()
            if name in TRACKED_COLUMNS
        }
        carried, spent = np.zeros((2, len(moments), num_things))
        jumps = np.zeros((num_knots, num_things), np.uint8)
        knots = iter([*moments.knots, -1])
        knot, next_knot = 0, next(knots)
        before: _Sight | None = None
        at_knot: _Sight | None = None
        for moment, position in enumerate(moments.positions):
            pose = motion.pose(position)
            sight = _Sight.of(pose, moments.eyes[moment])
            if before is not None:
                turn = sight.turn_since(before)
                carried[moment] = carried[moment - 1] + turn
                spent[moment] = spent[moment - 1] + np.abs(turn)
            before = sight
            if moment != next_knot:
                continue
            if at_knot is not None:
                jumps[knot] = sight.has_jumped_since(at_knot)
            moved = pose.moved(bare, has_color=False)
            for name, column in columns.items():
                column[knot] = getattr(moved, name)
            at_knot, knot, next_knot = sight, knot + 1, next(knots)
        if self.knots.is_closed:
            left = carried[-1] - 2 * pi * np.rint(carried[-1] / (2 * pi))
            carried -= left * (spent / np.maximum(spent[-1], np.finfo(float).tiny))
            jumps[0] = jumps[-1]
        return _Sample(columns, carried, jumps)


@dataclass(frozen=True, eq=False)
class _Sample:
    """A chunk of strokes at every knot, with the motion of their s objects.

    Attributes:
        columns: [K, n, ...] by name.
        carried: [m, s] rotation of objects in the picture by their own motion, at every moment, radians.
        jumps: [K, s] whether objects jump from the previous knot.
    """

    columns: dict[str, Array]
    carried: F64
    jumps: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class _Sight:
    """Objects seen by a camera at one moment: their rotations, and rays to their pivots.

    Attributes:
        turns: [s, 4] unit quaternions, since the reference moments.
        rays: [s, 3] unit vectors, world axes.
    """

    turns: F64
    rays: F64

    @classmethod
    def of(cls, pose: Pose, eye: F64) -> "_Sight":
        """For a camera center."""
        numbers = pose.numbers.astype(np.float64)
        return cls(normalized(numbers[:, TURN]), _unit(pose.pivots + numbers[:, SHIFT] - eye))

    def turn_since(self, before: "_Sight") -> F64:
        """[s] rotation of objects in the picture by their own motion, radians."""
        turns = quat_products(self.turns, conjugates(before.turns))
        # About the mean ray, so that the way back cancels it.
        return twists(turns, _unit(self.rays + before.rays))

    def has_jumped_since(self, before: "_Sight") -> Mask:
        """[s] whether the view of the object changes by more than `JUMP`."""
        return np.asarray(np.einsum("nj,nj->n", self._own_rays(), before._own_rays()) < cos(JUMP))

    def _own_rays(self) -> F64:
        """Rays in object axes at the reference moments."""
        return np.asarray(np.einsum("nij,ni->nj", rotation_matrices(self.turns), self.rays))


def _unit(vectors: F64) -> F64:
    """Vectors [n, 3] scaled to length 1; zero vectors stay."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1.0))


def _wrapped(angles: F64) -> F32:
    """Angles wrapped to -pi to pi, radians."""
    return (angles - 2 * pi * np.rint(angles / (2 * pi))).astype(np.float32)
