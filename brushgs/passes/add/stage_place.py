"""The place of a subject: its foot, size, up axis and lamp."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera

LEAST_RISE = 0.14  # minimum sine of the elevation of a lamp, 8 degrees: below, shadows are too long


class Place(NamedTuple):
    """A subject on level ground.

    Its local coordinates are right, up and away in the level first view, world units, from the middle of the
    subject on the ground.

    Attributes:
        foot: [3] the origin of these coordinates in the world.
        axes: [3, 3] rows right, up and away, world axes.
        radius: of the subject, see `robust_frame`.
        width: half the larger of its two level sizes.
        height: from the ground to its top.
        lamp: [3] unit vector toward the light, local, above the ground.
    """

    foot: F64
    axes: F64
    radius: float
    width: float
    height: float
    lamp: F64

    def local(self, points: Array) -> F64:
        """[n, 3] local coordinates of world points [n, 3]."""
        return np.asarray((points.astype(np.float64) - self.foot) @ self.axes.T)

    @property
    def above(self) -> F64:
        """[4] whose product with (x, y, z, 1) is the height of a world point over that of the subject."""
        up = self.axes[1] / max(self.height, np.finfo(np.float64).tiny)
        return np.append(up, -up @ self.foot)

    def world(self, points: F64) -> F64:
        """[n, 3] world coordinates of local points [n, 3]."""
        return np.asarray(self.foot + points @ self.axes)

    def seen_width(self, cameras: Sequence[Camera]) -> float:
        """Width of a picture at the subject, world units: the median over the views."""
        distances = [np.linalg.norm(self.local(camera.position[None])[0]) for camera in cameras]
        views = [camera.width / camera.K[0, 0] for camera in cameras]
        return float(np.median(np.multiply(distances, views)))

    def quats(self, frames: F64) -> F64:
        """[n, 4] world quaternions of local frames [n, 3, 3] with axes as columns; the second may be flipped.

        The local axes are left-handed.
        """
        return np.asarray(_core.turned_quats(self.axes, frames)).reshape(-1, 4)

    def cast(self, points: F64) -> F64:
        """[n, 2] shadows of local points [n, 3] on the plane of the ground: right and away."""
        lamp = self.lamp / self.lamp[1]
        return np.asarray(points[:, [0, 2]] - points[:, 1:2] * lamp[[0, 2]])


def lamp_direction(lamp: Sequence[float] = _core.STAGE_LAMP) -> F64:
    """[3] a lamp as a unit vector; the usual one in the local axes of places."""
    return np.asarray(np.asarray(lamp) / np.linalg.norm(lamp))


def above_ground(lamp: F64) -> F64:
    """[3] a local unit vector toward a lamp, raised to the minimum elevation for a finite shadow."""
    up = max(float(lamp[1]), LEAST_RISE)
    level = lamp[[0, 2]]
    level = level * (np.sqrt(1 - up**2) / max(float(np.linalg.norm(level)), 1e-9))
    return np.array([level[0], up, level[1]])
