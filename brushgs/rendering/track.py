"""A whole camera path -> which way each stroke points in each view: no flips, no spins, no pops.

One view alone chooses directions by `project(lock="anchor")`, which is steady except for views along a
stroke's longest axis. Where the path is known before the first frame is drawn, directions are chosen over all
of it at once: see `track_directions`. Given the `Track`, every frame can be drawn alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil, pi, radians

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64
from brushgs.cameras.motion import is_same_view, lenses, screw_motion, view_changes
from brushgs.native import core as _core
from brushgs.options.choices import Order
from brushgs.rendering.project import LOW_PASS, Directions, project
from brushgs.scene import Boxes, Camera, Gaussians
from brushgs.threads import num_threads_or_default

# The path is sampled each time the view has changed by this much, whatever the frame rate.
KNOT_SPACING = radians(1.5)
# A path with more knots per frame (cuts, mostly) is sampled less often.
MOST_KNOTS_A_FRAME = 16
# Where frames mostly lie further apart, they alone are the knots: what turns evenly from knot to knot would
# spin in several frames. Up to here half a turn can be spent without a spin.
COARSE_STEP = radians(3.5)
MOST_TURN = radians(14.6)  # from frame to frame; a spin begins at 15 degrees
# Of the area of a box, at most, for being off its axis: from knot to knot, and from frame to frame; 1.2 is a
# visible pop. The less, the longer a box stays larger than its ellipse, and the more its sides move while it
# turns: these are kinks. With 1.17 a knot strokes that are seen edge-on for a moment pop.
KNOT_GROWTH, FRAME_GROWTH = 1.10, 1.15
ROUNDING = 1e-9  # of a knot: a path that is longer by less needs no further knot


@dataclass(frozen=True, eq=False)
class Track:
    """Which way every stroke points along a camera path.

    Attributes:
        turns: [K, N] int16, directions at the K knots of the path in 2^-16 turns from +x towards +y.
        area_scales: [K, N] uint16 or None, see `Directions`; as octaves, `_core.AREA_SCALE_STEPS` to one.
        positions: [F] where the frames lie among the knots, 0 to K - 1.
    """

    turns: NDArray[np.int16]  # [K, N]
    area_scales: NDArray[np.uint16] | None  # [K, N]
    positions: F64  # [F]

    def __len__(self) -> int:
        """How many frames the path has."""
        return len(self.positions)

    def directions(self, frame: int) -> Directions:
        """Which way each Gaussian's stroke points in one frame of the path: for `project` and `render`.

        Args:
            frame: which camera of the path, 0 to F - 1.

        Raises:
            IndexError: if there is no such frame.
        """
        if not 0 <= frame < len(self):
            raise IndexError(f"directions: frame must be 0 to {len(self) - 1}, got {frame}")
        knot = min(int(self.positions[frame]), len(self.turns) - 1)
        after = min(knot + 1, len(self.turns) - 1)
        share = np.float32(self.positions[frame] - knot)
        step = self.turns[after] - self.turns[knot]  # wraps: steps are less than half a turn
        angles = (self.turns[knot] + share * step) * np.float32(2 * pi / 65536)
        angles -= np.float32(2 * pi) * (angles > pi)
        angles += np.float32(2 * pi) * (angles <= -pi)
        if self.area_scales is None:
            return Directions(angles)
        octaves = (1 - share) * self.area_scales[knot] + share * self.area_scales[after]
        return Directions(angles, np.exp2(octaves / np.float32(_core.AREA_SCALE_STEPS)))


def track(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    *,
    num_sigmas: float | F64 = 2.0,
    low_pass: float = LOW_PASS,
    fade: bool = False,
    order: Order = "soft",
    num_threads: int | None = None,
) -> Iterator[Boxes]:
    """The boxes of every view of a path, in directions chosen over the whole path.

    Args:
        gaussians: N Gaussians in world space.
        cameras: the views in order, all of one size. Where the last equals the first the path is closed, and
            the strokes come back to the directions they started with.
        num_sigmas: see `project`.
        low_pass: see `project`.
        fade: see `project`.
        order: see `project`.
        num_threads: see `project`.

    Raises:
        ValueError: if there is no camera, sizes differ, or an option is out of range.
    """
    path = track_directions(gaussians, cameras, low_pass=low_pass, num_threads=num_threads)
    for frame, camera in enumerate(cameras):
        yield project(
            gaussians,
            camera,
            num_sigmas=num_sigmas,
            low_pass=low_pass,
            lock=path.directions(frame),
            fade=fade,
            order=order,
            num_threads=num_threads,
        )


def track_directions(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    *,
    low_pass: float = LOW_PASS,
    num_threads: int | None = None,
) -> Track:
    """Choose which way every stroke points, over a whole camera path.

    The path is sampled at knots at most 1.5 degrees of view change apart (camera turn, or shift over the
    distance of the scene), between frames along screw motions, so the outcome hardly depends on the frame
    rate, as long as frames are mostly at most 3.5 degrees apart. Per stroke, dynamic programming finds the
    cheapest sequence of directions: one off the axes of the ellipse costs what the box must grow to cover
    it, the minor axis costs a little, a turn of more than 5.2 degrees a knot is not allowed. Weighted least
    squares then pulls the directions toward the exact axes, the closer the more slender the ellipse. A
    closed path comes back to the direction it started with: where the axis winds an odd number of half
    turns, the half turn is spent where it costs least, at up to 7.2 degrees a knot. Where the box of a
    slender stroke has to grow while it turns, its area grows by at most 10 % a knot and 15 % a frame.

    Frames that lie further apart are the knots themselves. From one to the next a direction may turn by 14
    degrees at next to no cost, and by up to 88 for the price of a box 1.35 times as large: strokes spin where
    they would otherwise lie across their ellipse for long. On five trained scenes, at 3.75 to 15 degrees a
    frame, that leaves no flips, and 0.01 to 0.25 of the spins of strokes without a lock.

    Args:
        gaussians: N Gaussians in world space.
        cameras: the F views in order, all of one size; closed where the last equals the first.
        low_pass: variance added to both axes, pixels squared, >= 0; see `project`.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if there is no camera or sizes differ.
    """
    cameras = list(cameras)
    if not cameras:
        raise ValueError("track: cameras must hold at least one, got none")
    sizes = sorted({(camera.width, camera.height) for camera in cameras})
    if len(sizes) > 1:
        raise ValueError(
            f"track: cameras must have one size, got {sizes[0]} and {sizes[1]}; use Camera.resized"
        )
    knots = _knots_of(cameras, *_middle_and_reach(gaussians))
    turns, area_scales = _core.track_directions(
        means=gaussians.means,
        quats=gaussians.quats,
        scales=gaussians.scales,
        opacities=gaussians.opacities,
        carried=None,
        jumps=None,
        views=knots.views(cameras[0].width, cameras[0].height),
        is_closed=knots.is_closed,
        is_coarse=knots.is_coarse,
        step=knots.spacing / KNOT_SPACING,
        most_turn=MOST_TURN / knots.knots_a_frame,
        growth=knots.growth,
        low_pass=float(low_pass),
        num_threads=num_threads_or_default(num_threads),
    )
    return Track(turns, area_scales, knots.positions)


def is_closed(gaussians: Gaussians, cameras: Sequence[Camera]) -> bool:
    """Whether tracking takes a path as closed: it has three views or more, and ends with the first."""
    return _is_closed(cameras, _middle_and_reach(gaussians)[1])


def _is_closed(cameras: Sequence[Camera], reach: float) -> bool:
    return len(cameras) > 2 and is_same_view(cameras[0], cameras[-1], reach)


@dataclass(frozen=True)
class _Knots:
    """Views along a path, and the positions of its frames among them.

    They lie at even steps of view change; or are the frames themselves, where these are far apart. A resting
    camera has one.
    """

    viewmats: F64  # [K, 4, 4]
    Ks: F64  # [K, 3, 3]
    nears: F64  # [K]
    spacing: float  # radians of view change; a typical one where the knots are the frames
    is_closed: bool
    is_coarse: bool  # whether they are the frames
    positions: F64  # [F]

    @property
    def knots_a_frame(self) -> float:
        """How many knots a frame moves on by, 1 or more; cuts, of which there are few, do not count."""
        steps = np.diff(self.positions)
        return max(1.0, float(np.quantile(steps[steps > 0], 0.95))) if steps.any() else 1.0

    @property
    def growth(self) -> float:
        """Factor that the area of a box may grow by from knot to knot."""
        return float(
            min(KNOT_GROWTH ** (self.spacing / KNOT_SPACING), FRAME_GROWTH ** (1 / self.knots_a_frame))
        )

    def views(self, width: int, height: int) -> list[_core.View]:
        """As the core takes them; the size of the picture in pixels."""
        size = {"width": int(width), "height": int(height)}
        views = zip(self.viewmats, self.Ks, self.nears, strict=True)
        return [_core.View(viewmat=viewmat, K=K, near=float(near), **size) for viewmat, K, near in views]


def _knots_of(cameras: list[Camera], middle: F64, reach: float) -> _Knots:
    viewmats = np.stack([camera.viewmat for camera in cameras])
    lens = lenses(cameras)
    eyes = np.stack([camera.position for camera in cameras])
    # A camera near the middle of the scene has most of it around itself, at about this distance.
    distances = np.maximum(np.linalg.norm(eyes - middle, axis=1), reach)
    changes = view_changes(viewmats[:-1], viewmats[1:], np.minimum(distances[:-1], distances[1:]))
    ways = np.concatenate([[0.0], np.cumsum(changes)])
    is_closed = bool(ways[-1] > 0 and _is_closed(cameras, reach))
    typical = float(np.median(changes[changes > 0])) if ways[-1] > 0 else 0.0
    if typical > COARSE_STEP * (1 + ROUNDING):
        is_moved = np.concatenate([[True], changes > 0])  # while the camera rests, so do the strokes
        nears = np.array([camera.near for camera in cameras])[is_moved]
        Ks = np.stack([camera.K for camera in cameras])[is_moved]
        positions = np.cumsum(is_moved) - 1.0
        return _Knots(viewmats[is_moved], Ks, nears, typical, is_closed, is_coarse=True, positions=positions)
    num_steps = min(ceil(ways[-1] / KNOT_SPACING - ROUNDING), MOST_KNOTS_A_FRAME * len(cameras))
    num_steps = max(num_steps, 2 if is_closed else int(ways[-1] > 0))
    at = np.linspace(0, ways[-1], num_steps + 1)

    frames = np.clip(np.searchsorted(ways, at, side="right") - 1, 0, max(len(cameras) - 2, 0))
    after = np.minimum(frames + 1, len(cameras) - 1)
    steps = ways[after] - ways[frames]
    shares = np.clip((at - ways[frames]) / np.where(steps > 0, steps, 1.0), 0, 1)
    lens = (1 - shares)[:, None] * lens[frames] + shares[:, None] * lens[after]
    Ks = np.zeros((len(at), 3, 3))
    Ks[:, 0, 0], Ks[:, 1, 1] = np.exp(lens[:, 0]), np.exp(lens[:, 1])
    Ks[:, :2, 2], Ks[:, 2, 2] = lens[:, 2:4], 1
    positions = ways / ways[-1] * num_steps if ways[-1] > 0 else np.zeros(len(cameras))
    return _Knots(
        viewmats=np.ascontiguousarray(screw_motion(viewmats[frames], viewmats[after], shares)),
        Ks=Ks,
        nears=np.exp(lens[:, 4]),
        spacing=ways[-1] / num_steps if num_steps else KNOT_SPACING,
        is_closed=is_closed,
        is_coarse=False,
        positions=positions,
    )


def _middle_and_reach(gaussians: Gaussians) -> tuple[F64, float]:
    """Middle of the strokes, and the distance within which half of them lie; robust against far outliers."""
    if len(gaussians) == 0:
        return np.zeros(3), 1.0
    means = gaussians.means.astype(np.float64)  # sums of the largest float32 leave its range
    middle = np.median(means, axis=0)
    reach = float(np.median(np.linalg.norm(means - middle, axis=1)))
    size = float(np.median(gaussians.scales.astype(np.float64)))
    return middle, max(reach, size, float(np.finfo(np.float32).tiny))
