"""Where the light of a scene was, by the shadows on the ground that it brings.

Shadows are predicted for many lamps and compared with the darkness of the ground. A lamp is believed where
one side explains it well, and the other sides do not.
"""

from dataclasses import replace

import numpy as np

from brushgs.passes.add.ground_maps import Grid, blurred
from brushgs.passes.add.stage_ground import Ground
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

SIDE, REACH = 64, 1.6  # cells of a map, and half its side in radii
MOST_ROWS = 3000  # of what throws the shadow
AZIMUTHS = np.arange(0, 360, 20)  # degrees, from the right toward away
ELEVATIONS = np.array([30.0, 45.0, 62.0])  # degrees
BLUR = 0.06  # of shadows, in radii
FREE, INSIDE = 0.3, 0.7  # shade of what stands on it below which ground is free, and coverage inside of it
FEWEST, EVEN = 60, 0.02  # cells that are compared, and OKLab deviation below which they show no shadow
# Correlation of a believed shadow with the darkness of the ground, and how much better it is than the best of
# those that fall 75 degrees or more from it: under a truck it is dark wherever the lamp stands.
CORRELATION, MARGIN = 0.45, 0.15


def found_lamp(gaussians: Gaussians, ground: Ground, weights: F64) -> F64 | None:
    """[3] unit vector toward the light, local; None where shadows do not show it.

    Args:
        gaussians: the scene, N.
        ground: that it brings.
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
    """[SIDE, SIDE] how much of the light paint at level points [n, 2] keeps off, 0 to 1."""
    density = blurred(grid.sums(level, paint) / grid.cell**2, BLUR * place.radius / grid.cell)
    return np.asarray(1 - np.exp(-density))


def _correlation(a: F64, b: F64) -> float:
    """Of two columns; 0 where one is constant."""
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-12 else 0.0
