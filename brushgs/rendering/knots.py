"""A camera path -> the views at which directions of strokes are chosen: knots, evenly spaced along it.

Where strokes move too, a clip is a path through views and moments, and knots are no further apart than a
thirtieth of a second either.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, radians
from typing import Any

import numpy as np

from brushgs.cameras.motion import is_same_view, lenses, screw_motion, view_changes
from brushgs.core.native import core as _core
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

# The path is sampled each time the view has changed by this much, whatever the frame rate.
KNOT_SPACING = radians(1.5)
# And where strokes move, each time this much of the clip has been played, in seconds.
KNOT_SECONDS = 1 / 30
# A path with more knots per frame (cuts, mostly) is sampled less often.
MOST_KNOTS_A_FRAME = 16
# Where frames mostly lie further apart, they alone are the knots: what turns evenly from knot to knot would
# spin in several frames.
COARSE_STEP = radians(3.5)
MOST_TURN = radians(14.6)  # from frame to frame; a spin begins at 15 degrees
# Frames further apart are too few to spend half a turn without a spin: there strokes may turn twice as far.
WIDE_STEP, MOST_WIDE_TURN = radians(12.4), radians(29)
# Of the area of a box, at most, for being off its axis: from knot to knot, and from frame to frame; 1.2 is a
# visible pop. The less, the longer a box stays larger than its ellipse, and the more its sides move while it
# turns: these are kinks. With 1.17 a knot strokes that are seen edge-on for a moment pop.
KNOT_GROWTH, FRAME_GROWTH = 1.10, 1.15
ROUNDING = 1e-9  # of a knot: a path that is longer by less needs no further knot


@dataclass(frozen=True)
class Knots:
    """Views along a path, and the positions of its frames among them.

    They lie at even steps of view change, or of time where that passes faster; or are the frames themselves,
    where these are far apart. A resting camera has one, where strokes rest too.
    """

    viewmats: F64  # [K, 4, 4]
    Ks: F64  # [K, 3, 3]
    nears: F64  # [K]
    spacing: float  # radians of view change, or the time it stands for; a typical one where knots are frames
    is_closed: bool
    is_coarse: bool  # whether they are the frames
    positions: F64  # [F]
    among_frames: F64  # [K] where the knots lie among the frames, 0 to F - 1

    @property
    def knots_a_frame(self) -> float:
        """How many knots a frame moves on by, 1 or more; cuts, of which there are few, do not count."""
        steps = np.diff(self.positions)
        return max(1.0, float(np.quantile(steps[steps > 0], 0.95))) if steps.any() else 1.0

    @property
    def most_turn(self) -> float:
        """Radians that a stroke may turn by from knot to knot."""
        is_wide = self.is_coarse and self.spacing > WIDE_STEP
        return MOST_WIDE_TURN if is_wide else MOST_TURN / self.knots_a_frame

    @property
    def growth(self) -> float:
        """Factor that the area of a box may grow by from knot to knot."""
        return float(
            min(KNOT_GROWTH ** (self.spacing / KNOT_SPACING), FRAME_GROWTH ** (1 / self.knots_a_frame))
        )

    def core_arguments(self, width: int, height: int) -> dict[str, Any]:
        """What `_core.track_directions` takes of them, for a picture of this size in pixels."""
        size = {"width": int(width), "height": int(height)}
        views = zip(self.viewmats, self.Ks, self.nears, strict=True)
        return {
            "views": [
                _core.View(viewmat=viewmat, K=K, near=float(near), **size) for viewmat, K, near in views
            ],
            "is_closed": self.is_closed,
            "is_coarse": self.is_coarse,
            "step": self.spacing / KNOT_SPACING,
            "most_turn": self.most_turn,
            "growth": self.growth,
        }


def knots_of(
    cameras: list[Camera],
    middle: F64,
    reach: float,
    *,
    seconds: F64 | None = None,
    ends_meet: bool = True,
) -> Knots:
    """The knots of a path.

    Args:
        cameras: the F views in order, all of one size.
        middle: of the scene, see `middle_and_reach`.
        reach: of the scene, see `middle_and_reach`.
        seconds: [F - 1] for which strokes move from each frame to the next; None where they all rest.
        ends_meet: whether strokes are at the last frame where they are at the first: closed is a path of
            which the cameras meet as well.
    """
    viewmats = np.stack([camera.viewmat for camera in cameras])
    lens = lenses(cameras)
    eyes = np.stack([camera.position for camera in cameras])
    # A camera near the middle of the scene has most of it around itself, at about this distance.
    distances = np.maximum(np.linalg.norm(eyes - middle, axis=1), reach)
    changes = view_changes(viewmats[:-1], viewmats[1:], np.minimum(distances[:-1], distances[1:]))
    typical = float(np.median(changes[changes > 0])) if (changes > 0).any() else 0.0
    if seconds is not None:
        changes = np.maximum(changes, seconds * (KNOT_SPACING / KNOT_SECONDS))
    ways = np.concatenate([[0.0], np.cumsum(changes)])
    is_closed = bool(ways[-1] > 0 and ends_meet and ends_where_it_begins(cameras, reach))
    if typical > COARSE_STEP * (1 + ROUNDING):
        is_moved = np.concatenate([[True], changes > 0])  # where nothing moves, no stroke turns
        nears = np.array([camera.near for camera in cameras])[is_moved]
        Ks = np.stack([camera.K for camera in cameras])[is_moved]
        positions = np.cumsum(is_moved) - 1.0
        return Knots(
            viewmats[is_moved],
            Ks,
            nears,
            typical,
            is_closed,
            is_coarse=True,
            positions=positions,
            among_frames=np.flatnonzero(is_moved).astype(np.float64),
        )
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
    return Knots(
        viewmats=np.ascontiguousarray(screw_motion(viewmats[frames], viewmats[after], shares)),
        Ks=Ks,
        nears=np.exp(lens[:, 4]),
        spacing=ways[-1] / num_steps if num_steps else KNOT_SPACING,
        is_closed=is_closed,
        is_coarse=False,
        positions=positions,
        among_frames=frames + shares,
    )


def middle_and_reach(gaussians: Gaussians) -> tuple[F64, float]:
    """Middle of the strokes, and the distance within which half of them lie; robust against far outliers."""
    if len(gaussians) == 0:
        return np.zeros(3), 1.0
    means = gaussians.means.astype(np.float64)  # sums of the largest float32 leave its range
    middle = np.median(means, axis=0)
    reach = float(np.median(np.linalg.norm(means - middle, axis=1)))
    size = float(np.median(gaussians.scales.astype(np.float64)))
    return middle, max(reach, size, float(np.finfo(np.float32).tiny))


def is_closed(gaussians: Gaussians, cameras: Sequence[Camera]) -> bool:
    """Whether tracking takes a path as closed: it has three views or more, and ends with the first."""
    return ends_where_it_begins(cameras, middle_and_reach(gaussians)[1])


def ends_where_it_begins(cameras: Sequence[Camera], reach: float) -> bool:
    """`is_closed` of a path through a scene of this reach, see `middle_and_reach`."""
    return len(cameras) > 2 and is_same_view(cameras[0], cameras[-1], reach)
