"""Directions of constant color, and of the surface's extent, from the Gaussians around each stroke.

Gaussians are finer than strokes, so they show edges that strokes cross. The unit of length is the distance of
the farthest neighbor, whose weight is zero: the result depends neither on unit and position of the scene,
nor on the choice between equally far neighbors.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.color.color_space import Space
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.planes import Planes, blocks, ramp, unit_pairs
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

NUM_NEIGHBORS = 20
SURFACE = 0.6  # share of the Gaussians used, those with the most paint: the others are mostly hidden
FARTHEST = 1e6  # scene radii; larger distances are clipped
# Step of color across a stroke with weight 1/2, CIELAB / 100: 3 units are just visible side by side.
HALF_STEP = 0.03
FLATNESS = 0.02  # of the spread of neighbors, added to it: against neighbors on a line
LONG = (0.5, 0.9)  # 1 - smaller / larger spread over which neighbors count as elongated; 0.4 by chance
LEAST_SPREAD = 1e-12  # squared distances of the farthest neighbor


@dataclass(frozen=True, eq=False)
class Surface:
    """Directions from the Gaussians around n strokes, as pairs in the planes of the strokes.

    Attributes:
        color: [n, 2] along lines of equal color; weight 0 to 1, 1/2 for a step of `HALF_STEP`.
        long: [n, 2] along the extent of the surface; weight 0 to 1, 0 if it is as long as wide, or no
            surface.
    """

    color: F64
    long: F64


def surface_around(planes: Planes, gaussians: Gaussians) -> Surface:
    """Find these directions for strokes.

    Args:
        planes: of the strokes.
        gaussians: the N >= 1 Gaussians of the strokes.
    """
    near = _Near.of(gaussians, planes.means)
    color, long = np.empty((2, len(planes), 2))
    for rows in blocks(len(planes)):
        color[rows], long[rows] = _surface_of(planes.take(rows), near, rows)
    return Surface(color, long)


def _surface_of(planes: Planes, near: "_Near", rows: slice) -> tuple[F64, F64]:
    """Both fields of `Surface`, for some rows of the strokes."""
    weights, offsets, reach, colors = near.around(rows)
    offsets -= np.einsum("nk,nki->ni", weights, offsets)[:, None]
    colors -= np.einsum("nk,nkc->nc", weights, colors)[:, None]
    flat = offsets @ planes.axes.transpose(0, 2, 1)  # along, across, off the plane
    weighted = weights[:, :, None] * flat
    moments = weighted.transpose(0, 2, 1) @ flat
    xx, yy, zz = (moments[:, i, i] for i in range(3))
    xy = moments[:, 0, 1]
    slopes = _solved(xx, xy, yy, weighted[:, :, :2].transpose(0, 2, 1) @ colors)
    products = slopes @ slopes.transpose(0, 2, 1)
    across, contrast = unit_pairs(
        np.stack([products[:, 0, 0] - products[:, 1, 1], 2 * products[:, 0, 1]], axis=1)
    )
    with np.errstate(over="ignore"):
        sizes = np.minimum(planes.sizes / reach, FARTHEST)
    steps = np.sqrt(contrast) * sizes  # of color, across the stroke
    long, difference = unit_pairs(np.stack([xx - yy, 2 * xy], axis=1))
    widest, narrow = 0.5 * (xx + yy + difference), 0.5 * (xx + yy - difference)
    is_long = ramp(difference / np.maximum(widest, LEAST_SPREAD), *LONG)
    is_flat = 1 - np.minimum(zz / np.maximum(narrow, LEAST_SPREAD), 1)
    return -across * (steps / (steps + HALF_STEP))[:, None], long * (is_long * is_flat)[:, None]


@dataclass(frozen=True, eq=False)
class _Near:
    """The Gaussians of the surface nearest to each stroke. Positions are in scene radii from the center.

    Attributes:
        places: [n, 3] positions of the strokes.
        distances: [n, k] to the nearest Gaussians, nearest first.
        found: [n, k] the rows of these.
        points: [S, 3] positions of the Gaussians.
        radius: of the scene, world units.
        shares: [S] root of their paint over that of the largest.
        sh: [S, k, 3] their colors.
    """

    places: F64
    distances: F64
    found: NDArray[np.int64]
    points: F64
    radius: float
    shares: F64
    sh: Array

    @classmethod
    def of(cls, gaussians: Gaussians, means: F64) -> "_Near":
        paint = paint_of(gaussians)
        rank = int((1 - SURFACE) * len(paint))
        rows = np.flatnonzero(paint >= np.partition(paint, rank)[rank])
        center, radius = robust_frame(gaussians.means)
        points, places = (
            np.clip((x - center) / radius, -FARTHEST, FARTHEST) for x in (gaussians.means[rows], means)
        )
        distances, found = nearest(points, places, min(NUM_NEIGHBORS, len(rows)))
        shares = np.sqrt(paint[rows] / max(float(paint.max()), np.finfo(np.float64).tiny))
        return cls(places, distances, found, points, radius, shares, gaussians.sh[rows])

    def around(self, strokes: slice) -> tuple[F64, F64, F64, F64]:
        """Weights [n, k], positions [n, k, 3], their unit [n], world units, and colors [n, k, 3]."""
        places, distances, found = (x[strokes] for x in (self.places, self.distances, self.found))
        reach = np.where(distances[:, -1] > 0, distances[:, -1], 1.0)
        weights = (1 - (distances / reach[:, None]) ** 2) ** 2 * self.shares[found]
        totals = weights.sum(axis=1, keepdims=True)
        weights /= np.where(totals > 0, totals, 1.0)
        used, local = np.unique(found, return_inverse=True)
        colors = Space("lab").to(base_colors(self.sh[used]))[local.reshape(found.shape)]
        offsets = (self.points[found] - places[:, None]) / reach[:, None, None]
        return weights, offsets, reach * self.radius, colors


def _solved(xx: F64, xy: F64, yy: F64, sides: F64) -> F64:
    """Solve [[xx, xy], [xy, yy]] s = sides, [n, 2, 3], for well-conditioned matrices."""
    more = FLATNESS * (xx + yy) + LEAST_SPREAD
    xx, yy = xx + more, yy + more
    scaled = np.stack(
        [
            yy[:, None] * sides[:, 0] - xy[:, None] * sides[:, 1],
            xx[:, None] * sides[:, 1] - xy[:, None] * sides[:, 0],
        ],
        axis=1,
    )
    return np.asarray(scaled / (xx * yy - xy * xy)[:, None, None])
