"""Maps on the ground: the shadow of a subject, its contact with the ground, and reflected color.

The shadow is the density of paint above the ground, projected along the lamp, in layers of height: the higher
a layer, the softer its edge. A point above the ground has the shade at its projection along the lamp.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.add.ground_maps import Grid, blurred
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

SIDE = 256  # pixels of a map
REACH = 3.2  # half its side, in radii of the subject
LAYERS = ((0.0, 0.25), (0.25, 0.6), (0.6, 1.2), (1.2, 9.0))  # of height, in radii
BLUR, BLUR_BY_HEIGHT = 0.02, 0.07  # of an edge, in radii: at the ground, and for each radius above it
DENSITY, CONTACT_DENSITY = 1.6, 1.2  # optical depth of paint that covers the ground once
TOUCHING, CONTACT_BLUR = 0.15, 0.05  # maximum height of paint that darkens the ground, and its blur, in radii
NEAR, REFLECTED_BLUR = 0.45, 0.16  # maximum height of paint that reflects its color, and the blur, in radii


@dataclass(frozen=True, eq=False)
class Shadow:
    """Maps of shadow, contact and reflected color, [SIDE, SIDE] by right and away around the foot.

    Attributes:
        place: of the subject.
        shade: 0 to 1, share of blocked light.
        contact: 0 to 1, nearness of paint above the ground.
        reflected: [SIDE, SIDE, 2] OKLab a and b of near objects.
        nearness: 0 to 1, weight of the reflection.
    """

    place: Place
    shade: F64
    contact: F64
    reflected: F64
    nearness: F64

    def at(self, points: F64) -> tuple[F64, F64, F64]:
        """At local points [n, 3]: [n] shade, [n] contact, [n, 2] a and b times nearness."""
        grid, level = _grid(self.place), points[:, [0, 2]]
        shade = grid.samples(self.shade, self.place.cast(points))
        ab = [grid.samples(self.reflected[..., k] * self.nearness, level) for k in (0, 1)]
        return shade, grid.samples(self.contact, level), np.stack(ab, axis=1)


def cast_shadow(gaussians: Gaussians, place: Place, weights: F64) -> Shadow:
    """The maps of a subject.

    Args:
        gaussians: N; those above the ground count.
        place: where they stand.
        weights: [N] the paint of each; 0 for those without a shadow, such as the ground itself.
    """
    points = place.local(gaussians.means)
    points[:, 1] = np.maximum(points[:, 1], 0)
    heights, grid = points[:, 1] / place.radius, _grid(place)

    def density(at: F64, rows: NDArray[np.intp], blur: float, values: F64 = weights) -> F64:
        found = grid.sums(at[rows], values[rows]) / grid.cell**2
        return blurred(found, blur * place.radius / grid.cell)

    light, thrown = np.ones((SIDE, SIDE)), place.cast(points)
    for low, high in LAYERS:
        rows = np.flatnonzero((heights >= low) & (heights < high) & (weights > 0))
        if len(rows):
            blur = BLUR + BLUR_BY_HEIGHT * (low + min(high, 2.0))
            light *= np.exp(-DENSITY * density(thrown, rows, blur))
    level, low_rows = points[:, [0, 2]], np.flatnonzero((heights < NEAR) & (weights > 0))
    touching = low_rows[heights[low_rows] < TOUCHING]
    contact = 1 - np.exp(-CONTACT_DENSITY * density(level, touching, CONTACT_BLUR))
    lab = oklab_of(base_colors(gaussians.sh[low_rows, :1]).astype(np.float64))
    near = density(level, low_rows, REFLECTED_BLUR)
    full = np.zeros(len(weights))
    sums = []
    for k in (1, 2):
        full[low_rows] = weights[low_rows] * lab[:, k]
        sums.append(density(level, low_rows, REFLECTED_BLUR, full))
    reflected = np.stack(sums, axis=2) / np.maximum(near, 1e-9)[..., None]
    return Shadow(place, 1 - light, contact, reflected, 1 - np.exp(-near))


def _grid(place: Place) -> Grid:
    return Grid(SIDE, REACH * place.radius)
