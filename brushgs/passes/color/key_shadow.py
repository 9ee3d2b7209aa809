"""The share of a lamp's light that reaches each stroke.

Paint between a stroke and the lamp is counted in cells along the direction of the lamp. Every stroke is
spread over a few points, and these over the cells around them, so small motions of lamp or scene cause no
jumps. The light of a stroke is read above its surface, so that it does not shade itself.
Source: Kim and Neumann 2001, Opacity shadow maps.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, F64, smoothstep
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

SIDE = 96  # cells per side, each 1/37 of the subject's radius; 128 take three times as long
REACH = 1.3  # half a side, in radii; paint beyond casts no shadow
FADES = 0.3  # radii within REACH over which shadows fade out
DENSITY = 1.5  # optical depth of paint that covers a cell once, as for the shadow on a table
LEAST_SEEN = 0.15  # minimum visible share of a stroke's area, seen edge-on
OFF_SURFACE, TOWARD_LAMP = 2.0, 2.0  # cells above a stroke where its light is read; less is speckled
ROUNDS = 2  # of blurs (1/4, 1/2, 1/4) across the lamp: penumbra, and no gaps between points
LARGEST = 0.5  # radii; points of larger strokes would be far apart
# Three points along each axis of a stroke, standard deviations, with the moments of a Gaussian (Gauss and
# Hermite), and their weights.
_POINTS, _SHARES = np.array([-(3**0.5), 0.0, 3**0.5]), np.array([1 / 6, 2 / 3, 1 / 6])
_PAIR = np.arange(2)


@dataclass(frozen=True, eq=False)
class Blockers:
    """n points that block light, in radii from the middle of a subject.

    Attributes:
        points: [n, 3] local axes, of which the second is up.
        paint: [n] opacity times area, radii squared.
        normals: [n, 3] of their surfaces.
    """

    points: F64
    paint: F64
    normals: F64

    @classmethod
    def of(cls, strokes: Gaussians, centers: F64, axes: F64, radius: float, normals: F64) -> "Blockers":
        """The points of strokes.

        Args:
            strokes: k strokes.
            centers: [k, 3] their positions, local, in radii.
            axes: [3, 3] rows are the local axes.
            radius: world units.
            normals: [k, 3] local.
        """
        order = np.argsort(strokes.scales, axis=1)[:, 1:]
        scales = np.take_along_axis(strokes.scales, order, axis=1).astype(np.float64)
        scales = np.minimum(scales / radius, LARGEST)
        turned = axes @ rotation_matrices(strokes.quats)
        along = np.take_along_axis(turned, order[:, None, :], axis=2) * scales[:, None, :]
        steps = np.stack(np.meshgrid(_POINTS, _POINTS, indexing="ij"), axis=2).reshape(-1, 2)
        shares = np.outer(_SHARES, _SHARES).ravel()
        points = (centers[:, None] + np.einsum("kij,pj->kpi", along, steps)).reshape(-1, 3)
        away = np.linalg.norm(points, axis=1)
        near = 1 - smoothstep((away - (REACH - FADES)) / FADES)
        area = 2 * np.pi * scales[:, 0] * scales[:, 1] * strokes.opacities
        paint = (area[:, None] * shares).ravel() * near
        rows = np.flatnonzero(paint > 0)
        return cls(points[rows], paint[rows], np.repeat(normals, len(shares), axis=0)[rows])


def lamp_axes(lamp: F64) -> F64:
    """[3, 3] rows: two directions across a unit vector, and itself, by the shortest rotation from upright."""
    x, y, z = lamp
    rise = 1 / max(1 + y, 1e-6)
    return np.array([[1 - x * x * rise, -x, -x * z * rise], [-x * z * rise, -z, 1 - z * z * rise], lamp])


def light_through(blockers: Blockers, lamp: F64, centers: F64, normals: F64, *, is_inside: bool) -> F64:
    """[k] share of the light of a lamp, 0 to 1, that reaches strokes.

    Args:
        blockers: block light.
        lamp: [3] unit vector toward it, local.
        centers: [k, 3] positions of strokes, local, in radii.
        normals: [k, 3] local.
        is_inside: whether the light comes in from outside: then surfaces that face away from the lamp, such
            as walls and ceiling of a room, block none.
    """
    if len(blockers.points) == 0 or len(centers) == 0:
        return np.ones(len(centers))
    cell, axes = 2 * REACH / SIDE, lamp_axes(lamp)
    facing = blockers.normals @ lamp
    paint = blockers.paint * (LEAST_SEEN + (1 - LEAST_SEEN) * np.abs(facing))
    if is_inside:
        paint = paint * smoothstep(2 * facing)
    cells, weights = _corners(_cells(blockers.points @ axes.T))
    sums = np.bincount(cells.ravel(), (weights * paint[:, None]).ravel(), SIDE**3)
    depths = _blurred((DENSITY / cell**2 * sums).astype(np.float32).reshape(SIDE, SIDE, SIDE))
    # Paint above the middle of a cell.
    above = np.cumsum(depths[:, :, ::-1], axis=2)[:, :, ::-1] - 0.5 * depths
    offset = centers + cell * (OFF_SURFACE * normals + TOWARD_LAMP * lamp)
    cells, weights = _corners(_cells(offset @ axes.T))
    return np.asarray(np.einsum("kc,kc->k", weights, np.exp(-above.ravel()[cells])))


def _cells(points: F64) -> F64:
    """[n, 3] fractional cells, counted from the middle of the first, clamped to the border."""
    return np.clip((points / REACH + 1) * (SIDE / 2) - 0.5, 0, SIDE - 1 - 1e-9)


def _corners(at: F64) -> tuple[NDArray[np.int64], F64]:
    """[n, 8] the cells around each fractional cell [n, 3], and their weights, which add up to 1."""
    low = at.astype(np.int64)
    share = at - low
    both = np.stack([1 - share, share], axis=2)
    weights = both[:, 0, :, None, None] * both[:, 1, None, :, None] * both[:, 2, None, None, :]
    first = (low[:, 0] * SIDE + low[:, 1]) * SIDE + low[:, 2]
    steps = (_PAIR[:, None, None] * SIDE + _PAIR[None, :, None]) * SIDE + _PAIR
    return first[:, None] + steps.ravel(), weights.reshape(-1, 8)


def _blurred(volume: F32) -> F32:
    """A volume softened across its first two axes, in place."""
    for _ in range(ROUNDS):
        for ends in (volume, volume.transpose(1, 0, 2)):
            mean = ends * np.float32(0.5)
            mean[1:] += 0.25 * ends[:-1]
            mean[:-1] += 0.25 * ends[1:]
            ends[:] = mean
    return volume
