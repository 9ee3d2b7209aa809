"""The surface of a stage: a table that rises in a soft cove to a wall, around all cameras.

It is a surface of revolution around the subject, so it looks the same in every view of an orbit. Strokes lie
on it along a spiral of equal areas, small near the subject and large far away.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera

STEPS = 400  # of the profile
BEYOND_EYE = 1.5  # distance of the wall, relative to the farthest camera
TABLE = 3.0  # approximate radius of the level table, relative to the subject; the cove lies beyond
LEAST_WALL = 3.0  # minimum distance of the wall, in the same unit
RISE = 0.85  # height of the cove, relative to the distance of the wall
TOP = 1.1  # height of the wall above the cove, in the same unit
NOISE = 5  # random numbers of a stroke, besides those of its position
MARCH, HALVINGS = 48, 24  # steps along a line of sight until it meets the surface, and between two of them
GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))


@dataclass(frozen=True, eq=False)
class Surface:
    """The profile of a stage: distance from the axis, height, and arc length.

    Attributes:
        rho: [STEPS] distance from the axis, world units.
        height: [STEPS] over the table.
        length: [STEPS] along the profile, from the axis.
        table: radius of the level part.
        wall: distance of the wall.
    """

    rho: F64
    height: F64
    length: F64
    table: float
    wall: float

    def slope(self, at: F64) -> F64:
        """[n] angle of the surface with the level, radians, at lengths [n] along the profile."""
        angles = np.arctan2(np.gradient(self.height), np.gradient(self.rho))
        return np.interp(at, self.length, angles)


class Spots(NamedTuple):
    """Positions of strokes.

    n local points, [n] radians around the axis, [n] lengths along the profile, and [n, NOISE] random numbers
    of standard deviation 1, which do not depend on how many spots follow.
    """

    points: F64
    around: F64
    along: F64
    noise: F64


def surface_around(place: Place, farthest: float, *, table: float = 0.0) -> Surface:
    """The surface for a subject and its cameras.

    Args:
        place: of the subject.
        farthest: level distance of the farthest camera from the subject's axis, world units.
        table: least radius of the level part, world units.
    """
    flat = max(TABLE * max(1.2 * place.width, place.radius, 0.8 * place.height), table)
    wall = max(LEAST_WALL * place.radius, BEYOND_EYE * farthest, 1.6 * flat)
    rise = RISE * wall
    turn = np.linspace(0, np.pi / 2, STEPS // 2)
    level = np.linspace(0, flat, STEPS // 4, endpoint=False)
    upright = np.linspace(rise, rise + TOP * wall, STEPS // 4 + 1)[1:]
    rho = np.concatenate([level, flat + (wall - flat) * np.sin(turn), np.full(len(upright), wall)])
    height = np.concatenate([np.zeros(len(level)), rise * (1 - np.cos(turn)), upright])
    steps = np.hypot(np.diff(rho, prepend=0.0), np.diff(height, prepend=0.0))
    return Surface(rho, height, np.cumsum(steps), flat, wall)


def spots_on(
    surface: Surface, cells: F64, jitter: float, g: np.random.Generator, *, until: float = np.inf
) -> Spots:
    """Points on a surface, evenly spread where cells are equal.

    Args:
        surface: of the points.
        cells: [STEPS] the area of each point's cell, along the profile, world units squared.
        jitter: of positions, in widths of a cell.
        g: random numbers.
        until: maximum distance of points from the axis, world units.
    """
    counts = np.cumsum(2 * np.pi * surface.rho * np.gradient(surface.length) / cells)
    last = int(np.searchsorted(surface.rho, until))
    k = np.arange(int(counts[min(last, STEPS - 1)])) + 0.5
    noise = g.normal(0, 1, (len(k), 2 + NOISE))
    along = np.interp(k, counts, surface.length)
    around = k * GOLDEN_ANGLE
    rho = np.interp(along, surface.length, surface.rho)
    width = np.sqrt(np.interp(along, surface.length, cells))
    along = np.clip(along + jitter * width * noise[:, 0], 0, surface.length[-1])
    around = around + jitter * width / np.maximum(rho, width) * noise[:, 1]
    return Spots(at_lengths(surface, along, around), around, along, noise[:, 2:])


def at_lengths(surface: Surface, along: F64, around: F64) -> F64:
    """[n, 3] local points at lengths [n] along the profile and angles [n] around the axis, 0 to the right."""
    rho = np.interp(along, surface.length, surface.rho)
    height = np.interp(along, surface.length, surface.height)
    return np.stack([rho * np.cos(around), height, rho * np.sin(around)], axis=1)


def depth_of(surface: Surface, place: Place, camera: Camera) -> F64:
    """[H, W] camera z at which the pixels of a view show a surface; infinite where they show none.

    Args:
        surface: around the subject.
        place: of the subject.
        camera: before the wall.
    """
    y, x = np.mgrid[: camera.height, : camera.width] + 0.5
    K = camera.K
    rays = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones_like(x)], axis=-1)
    rays = rays.reshape(-1, 3) @ camera.viewmat[:3, :3] @ place.axes.T  # local, camera z 1
    eye = place.local(camera.position[None])[0]
    outside, wall = surface.rho[-1], surface.rho < surface.rho[-1]
    rho, height = np.append(surface.rho[wall], outside), np.append(surface.height[wall], 1e30)

    def is_beyond(z: F64) -> Mask:
        points = eye + z[:, None] * rays
        away = np.hypot(points[:, 0], points[:, 2])
        return np.asarray((points[:, 1] < np.interp(away, rho, height)) | (away > outside))

    low, high = np.zeros(len(rays)), np.full(len(rays), np.inf)
    for z in np.linspace(0, 3 * outside, MARCH + 1)[1:]:
        now = np.isinf(high) & is_beyond(np.full(len(rays), z))
        high[now] = z
        low[np.isinf(high)] = z
    found = np.isfinite(high)
    bounded = np.where(found, high, 1.0)
    for _ in range(HALVINGS):
        middle = (low + bounded) / 2
        beyond = is_beyond(middle)
        low, bounded = np.where(beyond, low, middle), np.where(beyond, middle, bounded)
    tops = (eye + bounded[:, None] * rays)[:, 1] <= surface.height[-1]
    return np.where(found & tops, bounded, np.inf).reshape(camera.height, camera.width)
