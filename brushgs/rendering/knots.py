"""A camera path -> knots: evenly spaced views at which stroke directions are chosen.

If strokes move too, a clip is a path through views and moments, and knots are at most 1/30 s apart.
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

# View change from knot to knot, independent of the frame rate.
KNOT_SPACING = radians(1.5)
# If strokes move, also the longest time from knot to knot, seconds.
KNOT_SECONDS = 1 / 30
# Limit of knots per frame; only paths with cuts reach it.
MOST_KNOTS_A_FRAME = 16
# If frames are mostly further apart, they are the knots: even turns from knot to knot would spin over several
# frames.
COARSE_STEP = radians(3.5)
MOST_TURN = radians(14.6)  # from frame to frame; a spin begins at 15 degrees
# Wider steps leave too few frames for half a turn without a spin: strokes may turn twice as far.
WIDE_STEP, MOST_WIDE_TURN = radians(12.4), radians(29)
# Largest growth of a box's area off its axis, per knot and per frame; 1.2 is a visible pop. Lower limits keep
# a box larger than its ellipse for longer, and its sides move more while it turns (kinks). With 1.17 per
# knot, strokes seen edge-on for a moment pop.
KNOT_GROWTH, FRAME_GROWTH = 1.10, 1.15
ROUNDING = 1e-9  # of a knot: a smaller remainder needs no further knot


@dataclass(frozen=True)
class Knots:
    """Views along a path, and the positions of its frames among them.

    Knots lie at even steps of view change, or of time if that passes faster; or they are the frames, if these
    are far apart. A fixed camera with still strokes has one knot.
    """

    viewmats: F64  # [K, 4, 4]
    Ks: F64  # [K, 3, 3]
    nears: F64  # [K]
    spacing: float  # radians of view change, or its equivalent in time; typical value if knots are frames
    is_closed: bool
    is_coarse: bool  # whether knots are the frames
    positions: F64  # [F]
    among_frames: F64  # [K] positions of knots among the frames, 0 to F - 1

    @property
    def knots_a_frame(self) -> float:
        """Knots per frame, >= 1; the 95 % quantile, so that a few cuts do not count."""
        steps = np.diff(self.positions)
        return max(1.0, float(np.quantile(steps[steps > 0], 0.95))) if steps.any() else 1.0

    @property
    def most_turn(self) -> float:
        """Largest turn of a stroke from knot to knot, radians."""
        is_wide = self.is_coarse and self.spacing > WIDE_STEP
        return MOST_WIDE_TURN if is_wide else MOST_TURN / self.knots_a_frame

    @property
    def growth(self) -> float:
        """Largest growth factor of a box's area from knot to knot."""
        return float(
            min(KNOT_GROWTH ** (self.spacing / KNOT_SPACING), FRAME_GROWTH ** (1 / self.knots_a_frame))
        )

    def core_arguments(self, width: int, height: int) -> dict[str, Any]:
        """Arguments for `_core.track_directions`, for a picture of this size in pixels."""
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
        seconds: [F - 1] scene time between frames; None if no stroke moves.
        ends_meet: whether strokes end where they began; a path is closed if its cameras do too.
    """
    viewmats = np.stack([camera.viewmat for camera in cameras])
    lens = lenses(cameras)
    eyes = np.stack([camera.position for camera in cameras])
    # A camera near the middle of the scene is surrounded by it at about this distance.
    distances = np.maximum(np.linalg.norm(eyes - middle, axis=1), reach)
    changes = view_changes(viewmats[:-1], viewmats[1:], np.minimum(distances[:-1], distances[1:]))
    typical = float(np.median(changes[changes > 0])) if (changes > 0).any() else 0.0
    if seconds is not None:
        changes = np.maximum(changes, seconds * (KNOT_SPACING / KNOT_SECONDS))
    ways = np.concatenate([[0.0], np.cumsum(changes)])
    is_closed = bool(ways[-1] > 0 and ends_meet and ends_where_it_begins(cameras, reach))
    if typical > COARSE_STEP * (1 + ROUNDING):
        is_moved = np.concatenate([[True], changes > 0])  # without motion, no stroke turns
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
    """Middle of the strokes, and the radius that contains half of them; robust against far outliers."""
    if len(gaussians) == 0:
        return np.zeros(3), 1.0
    means = gaussians.means.astype(np.float64)  # sums of the largest float32 leave its range
    middle = np.median(means, axis=0)
    reach = float(np.median(np.linalg.norm(means - middle, axis=1)))
    size = float(np.median(gaussians.scales.astype(np.float64)))
    return middle, max(reach, size, float(np.finfo(np.float32).tiny))


def is_closed(gaussians: Gaussians, cameras: Sequence[Camera]) -> bool:
    """Whether tracking treats a path as closed: three or more views, the last equal to the first."""
    return ends_where_it_begins(cameras, middle_and_reach(gaussians)[1])


def ends_where_it_begins(cameras: Sequence[Camera], reach: float) -> bool:
    """`is_closed` of a path through a scene of this reach, see `middle_and_reach`."""
    return len(cameras) > 2 and is_same_view(cameras[0], cameras[-1], reach)
