"""Refine the up axis to the normal of the ground that the subject stands on.

Trainers keep the axes of COLMAP, which may lean: by 3 degrees for the truck of Tanks and Temples, so that its
horizon rolls along an orbit.

Tilted by 5 and 8 degrees, three real scenes with a ground return to within 0.7 degrees; five without one are
left alone.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from brushgs.cameras.framing import camera_axes, subject
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes

MOST_ROWS = 200_000  # for directions: of larger scenes every n-th Gaussian is used
MIN_OPACITY = 0.3
REACH = 1.5  # half width of the inspected ground, in half sizes of the subject
CELLS = 24  # per side of that square; the lowest layer of each cell counts
LOWEST = 0.9  # share of the weight of a cell above its lowest layer
MIN_CELL_ROWS = 8
# Least number of cells with the lowest layer in the plane, and its thickness in half sizes: 104 and more of
# 576 for the truck, a robot on a yard and a campsite; 73 and less if feet, legs or a cloth are lowest.
MIN_CELLS, THICKNESS = 85, 0.03
LARGEST = 0.3  # half sizes of the subject: larger Gaussians are sky or haze
CONES = (30.0, 20.0, 12.0, 8.0, 8.0)  # degrees from up within which a Gaussian counts as level, by iteration
CLIP = 0.99  # quantile at which weights are clipped
# Degrees. The two measures agree within 0.4 for the truck, rarely without a ground.
AGREE = 1.0
LEAST, MOST = 1.5, 30.0  # degrees of tilt: below, the axis is good enough; above, it is a slope


@dataclass(frozen=True, eq=False)
class Plane:
    """The points x with normal . x = offset.

    Attributes:
        normal: [3] unit vector.
        offset: world units.
    """

    normal: F64
    offset: float

    def heights(self, points: Array) -> F64:
        """[n] signed distances of points [n, 3], world units; > 0 on the side of the normal."""
        return np.asarray(points.astype(np.float64) @ self.normal - self.offset)


def level_up(gaussians: Gaussians, up: F64) -> F64:
    """The normal of the ground, if two measures of it agree.

    One is the plane through the lowest layer of a grid around the subject, the other the mean normal of
    level, flat Gaussians.

    Args:
        gaussians: N >= 1 Gaussians.
        up: [3] unit vector, roughly up.

    Returns:
        [3] unit vector; `up` itself if the measures disagree or the tilt is outside `LEAST` to `MOST`.
    """
    every = slice(None, None, -(-len(gaussians) // MOST_ROWS))
    gaussians = gaussians.take(every)
    by_places, by_normals = ground_plane(gaussians, up), _level_normal(gaussians, up)
    if by_places is None or by_normals is None or _degrees_between(by_places.normal, by_normals) > AGREE:
        return up
    found = by_places.normal + by_normals
    found /= np.linalg.norm(found)
    return found if LEAST < _degrees_between(found, up) <= MOST else up


def ground_plane(gaussians: Gaussians, up: F64) -> Plane | None:
    """The plane through the lowest layer around the subject; None if there is too little of it.

    Args:
        gaussians: N >= 1 Gaussians.
        up: [3] unit vector, roughly up.
    """
    points, _ = subject(gaussians)
    low, high = points.min(axis=0), points.max(axis=0)
    radius = 0.5 * float((high - low).max())
    if not radius > 0:
        return None
    axes = camera_axes(up, 0.0, 0.0)
    places = (gaussians.means - 0.5 * (low + high)) @ axes.T / radius  # y is down
    sizes = np.sort(gaussians.scales.astype(np.float64), axis=1)
    is_near = np.abs(places[:, [0, 2]]).max(axis=1) < REACH
    rows = is_near & (gaussians.opacities > MIN_OPACITY) & (sizes[:, 2] < LARGEST * radius)
    if np.count_nonzero(rows) < MIN_CELL_ROWS * MIN_CELLS:
        return None
    places, weights = places[rows], (gaussians.opacities * sizes[:, 1] * sizes[:, 2])[rows]
    weights = np.minimum(weights, np.quantile(weights, CLIP))
    cells = ((places[:, [0, 2]] + REACH) * (0.5 * CELLS / REACH)).astype(int) @ (1, CELLS)
    order = np.lexsort((places[:, 1], cells))
    places, weights, cells = places[order], weights[order], cells[order]
    bounds = [*np.flatnonzero(np.diff(cells, prepend=-1)), len(cells)]
    lowest = []
    for start, stop in pairwise(bounds):
        if stop - start >= MIN_CELL_ROWS:
            total = np.cumsum(weights[start:stop])
            row = start + min(int(np.searchsorted(total, LOWEST * total[-1])), stop - start - 1)
            x, z = places[start:stop, [0, 2]].mean(axis=0)
            lowest.append((x, places[row, 1], z))
    if len(lowest) < MIN_CELLS:
        return None
    plane = _plane_through(np.array(lowest))
    if plane is None:
        return None
    normal = np.asarray(plane.normal @ axes)
    return Plane(normal, plane.offset * radius + float(normal @ (0.5 * (low + high))))


def _plane_through(points: F64) -> Plane | None:
    """The upward plane through most of the points [n, 3]; None if these are too few.

    Least squares with squared Cauchy weights, robust against points far from the plane. y is down.
    """
    columns = np.column_stack([points[:, 0], points[:, 2], np.ones(len(points))])
    weights = np.ones(len(points))
    found = np.zeros(3)
    for _ in range(30):
        root = np.sqrt(weights)
        found = np.linalg.lstsq(columns * root[:, None], points[:, 1] * root, rcond=None)[0]
        errors = points[:, 1] - columns @ found
        scale = max(1.48 * float(np.median(np.abs(errors))), 1e-3)
        weights = 1 / (1 + (errors / scale) ** 2) ** 2
    if np.count_nonzero(np.abs(errors) < THICKNESS) < MIN_CELLS:
        return None
    normal = np.array([found[0], -1.0, found[1]])
    length = float(np.linalg.norm(normal))
    return Plane(np.asarray(normal / length), -float(found[2]) / length)


def _level_normal(gaussians: Gaussians, up: F64) -> F64 | None:
    """[3] mean normal of level, flat Gaussians; None if there are none."""
    sizes = np.sort(gaussians.scales.astype(np.float64), axis=1)
    is_flat = (sizes[:, 1] > 2 * sizes[:, 0]) & (gaussians.opacities > MIN_OPACITY)
    rows = np.flatnonzero(is_flat)
    if not len(rows):
        return None
    weights = gaussians.opacities[rows] * sizes[rows, 1] * sizes[rows, 2]
    weights = np.minimum(weights, np.quantile(weights, CLIP))
    normals = shortest_axes(gaussians.quats[rows], gaussians.scales[rows])
    found = up
    for cone in CONES:
        cosines = normals @ found
        is_level = np.abs(cosines) > np.cos(np.radians(cone))
        total = (np.sign(cosines) * weights * is_level) @ normals
        length = float(np.linalg.norm(total))
        if not length > 0:
            return None
        found = total / length
    return found


def _degrees_between(one: F64, other: F64) -> float:
    return float(np.degrees(np.arccos(min(float(one @ other), 1.0))))
