"""Estimate the light of a scene from the shadows on its ground.

Shadows are predicted for many lamps and compared with the darkness of the ground. A lamp is accepted if one
direction explains it well, and the others do not.
"""

from dataclasses import replace

import numpy as np

from brushgs.passes.add.ground_maps import Grid, blurred
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

SIDE, REACH = 64, 1.6  # cells of a map, and half its side in radii
MOST_ROWS = 3000  # of the objects that cast the shadow
AZIMUTHS = np.arange(0, 360, 20)  # degrees, from right to away
ELEVATIONS = np.array([30.0, 45.0, 62.0])  # degrees
BLUR = 0.06  # of shadows, in radii
FREE, INSIDE = 0.3, 0.7  # maximum shade of free ground, and minimum coverage inside it
FEWEST, EVEN = 60, 0.02  # minimum number of compared cells, and minimum OKLab deviation of a visible shadow
# Minimum correlation of an accepted shadow with the darkness of the ground, and its minimum lead over the
# best shadow 75 degrees or more away: under a truck it is always dark.
CORRELATION, MARGIN = 0.45, 0.15


def found_lamp(gaussians: Gaussians, ground: Ground, weights: F64) -> F64 | None:
    """[3] unit vector toward the light, local; None if shadows do not show it.

    Args:
        gaussians: the scene, N.
        ground: of the scene.
        weights: [N] the paint of each; 0 for the ground.
    """
    rows = np.flatnonzero(weights > 0)
    if len(rows) == 0:
        return None
    rows = rows[:: max(len(rows) // MOST_ROWS, 1)]
    place, grid = ground.place, Grid(SIDE, REACH * ground.place.radius)
    points = place.local(gaussians.means[rows])
    paint = weights[rows] * (weights.sum() / weights[rows].sum())
    axis = (np.arange(SIDE) + 0.5) * grid.cell - grid.half
    cells = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=2).reshape(-1, 2)
    coverage, lab = ground.at(np.insert(cells, 1, 0.0, axis=1))
    standing = _shade(grid, points[:, [0, 2]], paint, place).ravel()
    free = (coverage > INSIDE) & (standing < FREE)
    if free.sum() < FEWEST:
        return None
    dark = -lab[free, 0]
    if dark.std() < EVEN:
        return None
    lamps = [_lamp(float(azimuth), float(elevation)) for azimuth in AZIMUTHS for elevation in ELEVATIONS]
    fits = np.array(
        [
            _correlation(
                dark, _shade(grid, replace(place, lamp=lamp).cast(points), paint, place).ravel()[free]
            )
            for lamp in lamps
        ]
    ).reshape(len(AZIMUTHS), len(ELEVATIONS))
    best = np.unravel_index(fits.argmax(), fits.shape)
    is_aside = np.cos(np.radians(AZIMUTHS - AZIMUTHS[best[0]])) < 0.3
    if fits[best] < CORRELATION or fits[best] - fits[is_aside].max() < MARGIN:
        return None
    return lamps[int(fits.argmax())]


def _lamp(azimuth: float, elevation: float) -> F64:
    """[3] a unit vector at angles in degrees, local."""
    turn, rise = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(turn) * np.cos(rise), np.sin(rise), np.sin(turn) * np.cos(rise)])


def _shade(grid: Grid, level: F64, paint: F64, place: Place) -> F64:
    """[SIDE, SIDE] share of the light that paint at level points [n, 2] blocks, 0 to 1."""
    density = blurred(grid.sums(level, paint) / grid.cell**2, BLUR * place.radius / grid.cell)
    return np.asarray(1 - np.exp(-density))


def _correlation(a: F64, b: F64) -> float:
    """Correlation of two columns; 0 if one is constant."""
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-12 else 0.0
