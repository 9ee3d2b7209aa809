"""Motion between two views: interpolation, distance, equality.

Interpolation is by the screw motion: one turn about a fixed axis with a translation along it, at constant
rate. Between two views of an orbit it stays on the orbit; a straight move and a turn in place are special
cases.
Source: Murray, Li and Sastry 1994, chapter 2 (Chasles).
"""

import numpy as np
from numpy.typing import ArrayLike

from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.quats import quats_of, rotation_matrices

# Views closer than this are equal, radians (relative for lenses): files have about seven digits.
SAME_VIEW = 1e-6


def view_change(first: Camera, second: Camera, distance: float) -> float:
    """Difference of two views, radians: the larger of the turn and the apparent shift.

    Args:
        first: a view.
        second: another.
        distance: from the cameras to the subject, world units, > 0. The apparent shift is the distance of the
            camera centers over this distance, so that the parts of a straight path add up.

    Returns:
        0 if only lenses differ; may exceed pi.

    Raises:
        ValueError: if `distance` is not positive.
    """
    if not distance > 0:
        raise ValueError(f"view_change: distance must be > 0, got {distance}")
    return float(view_changes(first.viewmat[None], second.viewmat[None], distance)[0])


def is_same_view(first: Camera, second: Camera, distance: float) -> bool:
    """Whether two cameras show the same picture: their `view_change` is below `SAME_VIEW`, and so is their
    relative difference of focal lengths and principal points.

    A path is closed if this holds for its ends.

    Args:
        first: a camera.
        second: another; views of different sizes are never the same.
        distance: see `view_change`.

    Raises:
        ValueError: if `distance` is not positive.
    """
    if (first.width, first.height) != (second.width, second.height):
        return False
    is_same_lens = np.allclose(first.K, second.K, rtol=SAME_VIEW, atol=SAME_VIEW)
    return is_same_lens and view_change(first, second, distance) < SAME_VIEW


def screw_motion(first: F64, second: F64, shares: ArrayLike) -> F64:
    """Views [n, 4, 4] at `shares` (one, or [n]) of the motions from `first` to `second`, [n, 4, 4] each.

    A share below 0 or above 1 extrapolates the same motion.

    With the turn theta about unit axis a, the translation along a grows with the share s. The translation
    across it is turned by (s - 1) theta / 2 and scaled by sin(s theta / 2) / sin(theta / 2), the chord of an
    arc. That holds for every theta up to pi and needs no series for small ones.
    """
    shares = np.asarray(shares, dtype=np.float64)
    step = _step(first, second)
    axis, theta = _axis_angle(step[:, :3, :3])
    half = 0.5 * theta
    is_turn = half > 0
    chord = np.where(is_turn, np.sin(shares * half) / np.sin(np.where(is_turn, half, 1.0)), shares)
    along = (step[:, :3, 3] * axis).sum(axis=1, keepdims=True) * axis
    across = (turns(axis, (shares - 1) * half) @ (step[:, :3, 3] - along)[..., None])[..., 0]
    part = np.zeros_like(step)
    part[:, :3, :3] = turns(axis, shares * theta)
    part[:, :3, 3] = np.asarray(shares)[..., None] * along + chord[:, None] * across
    part[:, 3, 3] = 1
    return part @ first


def view_changes(first: F64, second: F64, distances: ArrayLike) -> F64:
    """[n] `view_change` of views [n, 4, 4]; exactly 0 between a view and itself."""
    step = _step(first, second)
    _, theta = _axis_angle(step[:, :3, :3])
    shifts = np.linalg.norm(step[:, :3, 3], axis=1)
    is_same = (first == second).all(axis=(1, 2))
    return np.where(is_same, 0.0, np.maximum(theta, shifts / distances))


def lenses(cameras: list[Camera]) -> F64:
    """[n, 5] log fx, log fy, cx, cy, log near: interpolated linearly, they zoom at an even rate."""
    rows = [(c.K[0, 0], c.K[1, 1], c.K[0, 2], c.K[1, 2], c.near) for c in cameras]
    values = np.array(rows, dtype=np.float64).reshape(-1, 5)
    values[:, [0, 1, 4]] = np.log(values[:, [0, 1, 4]])
    return values


def camera_with(viewmat: F64, lens: F64, width: int, height: int) -> Camera:
    """The camera with a view and one row of `lenses`."""
    fx, fy, near = np.exp(lens[[0, 1, 4]])
    K = np.array([[fx, 0.0, lens[2]], [0.0, fy, lens[3]], [0.0, 0.0, 1.0]])
    return Camera(viewmat, K, width, height, float(near))


def _step(first: F64, second: F64) -> F64:
    """[n, 4, 4] transforms from the first camera to the second."""
    step = np.zeros_like(first)
    step[:, :3, :3] = second[:, :3, :3] @ first[:, :3, :3].transpose(0, 2, 1)
    step[:, :3, 3] = second[:, :3, 3] - (step[:, :3, :3] @ first[:, :3, 3, None])[..., 0]
    step[:, 3, 3] = 1
    return step


def _axis_angle(rotations: F64) -> tuple[F64, F64]:
    """[n, 3] unit axes and [n] angles, 0 to pi, from quaternions, which are accurate near 0 and pi."""
    quats = quats_of(rotations)
    quats = np.where(quats[:, :1] < 0, -quats, quats)
    sine = np.linalg.norm(quats[:, 1:], axis=1)
    axis = np.where(sine[:, None] > 0, quats[:, 1:] / np.where(sine > 0, sine, 1.0)[:, None], (1.0, 0.0, 0.0))
    return axis, 2 * np.arctan2(sine, quats[:, 0])


def turns(axis: F64, angles: F64) -> F64:
    """[n, 3, 3] rotations by `angles` about unit axes [n, 3]."""
    half = 0.5 * np.broadcast_to(angles, axis.shape[:1])[:, None]
    return rotation_matrices(np.concatenate([np.cos(half), np.sin(half) * axis], axis=1))
