"""Points with normals and tangents on analytic surfaces: the bodies of the example scene.

World axes are those of most trained scenes: x right, y down, z away from the viewer, so up is -y. Every
sampler distributes its points evenly by area with a low-discrepancy sequence, so equal input gives equal
points, and no two points clump.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from brushgs.values.arrays import F64

GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))  # azimuth step of the sunflower spiral
PLASTIC = 1.32471795724474602596  # its powers step the two-dimensional R2 sequence (Roberts 2018)


@dataclass(frozen=True, eq=False)
class Patch:
    """n points of one surface.

    Attributes:
        points: [n, 3] world units.
        normals: [n, 3] unit, out of the body.
        tangents: [n, 3] unit, the direction of the long axis of a Gaussian.
        spacing: [n] edge of the square of surface per point, world units.
        coords: [n, 2] surface coordinates for patterns: (azimuth or x, 0..1 along the profile or z).
    """

    points: F64
    normals: F64
    tangents: F64
    spacing: F64
    coords: F64

    def __len__(self) -> int:
        return len(self.points)

    def moved(self, offset: ArrayLike, rotation: F64 | None = None) -> "Patch":
        """The patch turned about the origin by `rotation` [3, 3], then moved by `offset` [3]."""
        turn = np.eye(3) if rotation is None else rotation
        return replace(
            self,
            points=self.points @ turn.T + np.asarray(offset),
            normals=self.normals @ turn.T,
            tangents=self.tangents @ turn.T,
        )


def unit(vectors: ArrayLike) -> F64:
    """Vectors scaled to length 1 along the last axis; a zero vector stays zero."""
    v = np.asarray(vectors, dtype=np.float64)
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12))


def turn(axis: ArrayLike, angle: float) -> F64:
    """[3, 3] rotation by `angle` radians about `axis` (Rodrigues)."""
    x, y, z = unit(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def smooth(controls: ArrayLike, num: int = 96) -> F64:
    """A curve through control points [p, d] as [num, d] points (Catmull-Rom; the end points double)."""
    p = np.asarray(controls, dtype=np.float64)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    at = np.linspace(0, len(p) - 3 - 1e-9, num)
    i, t = at.astype(int), (at % 1)[:, None]
    a, b, c, d = p[i], p[i + 1], p[i + 2], p[i + 3]
    return np.asarray(b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))))


def revolve(profile: F64, num: int) -> Patch:
    """A surface of revolution about the vertical axis.

    Args:
        profile: [p, 2] (radius, height); where it runs upward the outside is away from the axis.
        num: points.
    """
    steps = np.diff(profile, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    mean_radius = np.maximum(0.5 * (profile[1:, 0] + profile[:-1, 0]), 1e-6)
    areas = np.concatenate([[0], np.cumsum(2 * np.pi * mean_radius * lengths)])
    index = np.arange(num)
    along = np.interp((index + 0.5) / num * areas[-1], areas, np.arange(len(profile)))
    segment = np.minimum(along.astype(int), len(steps) - 1)
    radius, height = (profile[segment] + (along - segment)[:, None] * steps[segment]).T
    d_radius, d_height = (steps[segment] / np.maximum(lengths[segment], 1e-12)[:, None]).T
    azimuth = index * GOLDEN_ANGLE % (2 * np.pi)
    cos, sin, zero = np.cos(azimuth), np.sin(azimuth), np.zeros(num)
    return Patch(
        points=np.stack([radius * cos, -height, radius * sin], axis=1),
        normals=np.stack([d_height * cos, d_radius, d_height * sin], axis=1),
        tangents=np.stack([-sin, zero, cos], axis=1),
        spacing=np.full(num, np.sqrt(areas[-1] / num)),
        coords=np.stack([azimuth, along / (len(profile) - 1)], axis=1),
    )


def sphere(radius: float, num: int) -> Patch:
    """A ball about the origin."""
    polar = np.linspace(-np.pi / 2, np.pi / 2, 64)
    return revolve(radius * np.stack([np.cos(polar), np.sin(polar)], axis=1), num)


def tube(curve: F64, radii: F64, num: int) -> Patch:
    """A bent tube about `curve` [p, 3] with a radius [p] at each of its points; `num` points.

    Its tangents run along the curve. The curve must not run straight up or down.
    """
    forward = unit(np.gradient(curve, axis=0))
    side = unit(np.cross(forward, (0.0, 1.0, 0.0)) + 1e-9)
    lengths = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    areas = np.concatenate([[0], np.cumsum(np.pi * (radii[1:] + radii[:-1]) * lengths)])
    index = np.arange(num)
    along = np.interp((index + 0.5) / num * areas[-1], areas, np.arange(len(curve)))
    center, axis, right = (_between(column, along) for column in (curve, forward, side))
    axis = unit(axis)
    right = unit(right)
    azimuth = (index * GOLDEN_ANGLE)[:, None]
    normals = np.cos(azimuth) * right + np.sin(azimuth) * np.cross(axis, right)
    return Patch(
        points=center + normals * _between(radii[:, None], along),
        normals=normals,
        tangents=axis,
        spacing=np.full(num, np.sqrt(areas[-1] / num)),
        coords=np.stack([azimuth[:, 0] % (2 * np.pi), along / (len(curve) - 1)], axis=1),
    )


def sheet(
    low: tuple[float, float], high: tuple[float, float], height: Callable[[F64, F64], F64], num: int
) -> Patch:
    """A height field above the rectangle from `low` to `high`, each (x, z), seen from above.

    Args:
        low: least x and z.
        high: greatest x and z.
        height: (x [n], z [n]) -> [n] height above y = 0, world units.
        num: points.
    """
    index = np.arange(1, num + 1)[:, None]
    fractions = (0.5 + index / PLASTIC ** np.array([1, 2])) % 1
    x, z = (np.asarray(low) + fractions * (np.asarray(high) - np.asarray(low))).T
    step = 1e-3
    slope_x = (height(x + step, z) - height(x - step, z)) / (2 * step)
    slope_z = (height(x, z + step) - height(x, z - step)) / (2 * step)
    one, zero = np.ones(num), np.zeros(num)
    area = (high[0] - low[0]) * (high[1] - low[1]) * np.sqrt(1 + slope_x**2 + slope_z**2)
    return Patch(
        points=np.stack([x, -height(x, z), z], axis=1),
        normals=unit(np.stack([-slope_x, -one, -slope_z], axis=1)),
        tangents=unit(np.stack([one, -slope_x, zero], axis=1)),
        spacing=np.sqrt(area / num),
        coords=np.stack([x, z], axis=1),
    )


def _between(column: F64, along: F64) -> F64:
    """Rows of `column` at fractional positions, linear between neighbors."""
    i = np.minimum(along.astype(int), len(column) - 2)
    t = (along - i)[:, None]
    return np.asarray(column[i] * (1 - t) + column[i + 1] * t)
