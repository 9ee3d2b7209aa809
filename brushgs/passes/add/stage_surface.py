"""The surface of a stage: a table that rises in a soft cove to a wall, around all cameras.

It is a surface of revolution around the subject, so it looks the same in every view of an orbit. Strokes lie
on it along a spiral of equal areas, small near the subject and large far away.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera

MARCH, HALVINGS = 48, 24  # steps along a line of sight until it meets the surface, and between two of them


class Surface(NamedTuple):
    """The profile of a stage: distance from the axis, height, and arc length.

    Attributes:
        rho: [steps] distance from the axis, world units.
        height: [steps] over the table.
        length: [steps] along the profile, from the axis.
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
        return np.asarray(_core.slopes_at(self, np.ascontiguousarray(at)))


class Spots(NamedTuple):
    """Positions of strokes.

    [n, 3] local points, [n] radians around the axis, [n] lengths along the profile, [n] sizes of strokes, the
    root of length times width, and [n, 7] random numbers of standard deviation 1, the first two of the
    place. None depends on how many spots follow.
    """

    points: F64
    around: F64
    along: F64
    sizes: F64
    noise: F64

    @classmethod
    def of(cls, columns: Sequence[F64]) -> "Spots":
        """Spots of flat columns."""
        points, around, along, sizes, noise = columns
        return cls(points.reshape(-1, 3), around, along, sizes, noise.reshape(len(sizes), -1))


def surface_around(place: Place, farthest: float, ground: Ground | None = None) -> Surface:
    """The surface for a subject and its cameras.

    Args:
        place: of the subject.
        farthest: level distance of the farthest camera from the subject's axis, world units.
        ground: of the scene itself, which the level part continues; None without.
    """
    return Surface(*_core.profile_around(place, farthest, 0.0 if ground is None else ground.extent))


def spots_on(surface: Surface, sizes: F64, overlap: float, g: np.random.Generator) -> Spots:
    """Spots of strokes all over a surface, evenly spread where they are equally large.

    Args:
        surface: of the points.
        sizes: [steps] of strokes along the profile, world units.
        overlap: strokes over each point.
        g: random numbers.
    """
    return Spots.of(_core.place_spots(surface, sizes, overlap, np.inf, noise_of([g])))


def noise_of(generators: Sequence[np.random.Generator]) -> Callable[[int, int], F64]:
    """Gives [count, 7] random numbers of spots in a layer, each layer from its own generator."""
    return lambda layer, count: generators[layer].normal(0, 1, (count, _core.SPOT_NOISE))


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
