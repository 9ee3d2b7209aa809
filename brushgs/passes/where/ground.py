"""The ground below the subject, the origin of heights.

It is the plane through the lowest layer around the subject, if there is one, raised to the visible surface:
captured ground is a layer of some thickness, on the truck 0.06 of the subject's size. Without a ground it is
the horizontal plane at the lowest end of the subject.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.cameras.ground import MOST_ROWS, Plane, ground_plane
from brushgs.options.where_terms import Height, Length
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

# In sizes of the subject: the ring around it, whose Gaussians show the top of the ground; their maximum
# distance from the plane; and the thickness of counted layers.
RING, THICKEST, LAYER = 0.3, 0.1, 0.005
DENSE = 0.1  # of the densest layer: the ground ends below layers with less
FEWEST = 100  # minimum number of Gaussians for this
STEEPEST = np.cos(np.radians(12.0))  # cosine of the ground's normal with up: steeper planes are not ground


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground of a scene.

    Attributes:
        plane: its normal points up.
        is_found: whether there is one; else the plane touches the lowest end of the subject.
        subject_height: height of the top of the subject above it, world units, >= 0.
    """

    plane: Plane
    is_found: bool
    subject_height: float

    @classmethod
    def under(cls, gaussians: Gaussians, view: FirstView) -> "Ground":
        """The ground of N Gaussians with this first view."""
        up = view.up
        every = slice(None, None, max(1, -(-len(gaussians) // MOST_ROWS)))
        plane = ground_plane(gaussians.take(every), up) if len(gaussians) else None
        is_found = plane is not None and float(plane.normal @ up) >= STEEPEST
        if plane is None or not is_found:
            plane = Plane(up, float((view.points @ up).min()))
        else:
            plane = Plane(plane.normal, plane.offset + _top(gaussians, view, plane))
        return cls(plane, is_found, max(float(plane.heights(view.points).max()), 0.0))


def height_depths(height: Height, ground: Ground, means: Array) -> F64:
    """[N] how far inside a range of heights, world units."""
    heights = ground.plane.heights(means)
    depths = np.full(len(heights), np.inf)
    if height.low is not None:
        depths = np.minimum(depths, heights - _in_units(height.low, ground))
    if height.high is not None:
        depths = np.minimum(depths, _in_units(height.high, ground) - heights)
    return depths


def _top(gaussians: Gaussians, view: FirstView, plane: Plane) -> float:
    """Height of the top of the ground above its plane, world units."""
    size = size_of(view)
    heights = plane.heights(gaussians.means)
    rows = np.flatnonzero(np.abs(heights) <= THICKEST * size)
    means = gaussians.means[rows]
    around = in_hull(means, view.points, RING * size)
    if view.has_surroundings:
        around &= ~in_hull(means, view.points, 0.0)
    rows = rows[around]
    if len(rows) < FEWEST:
        return 0.0
    layers = np.arange(-THICKEST, THICKEST + 0.5 * LAYER, LAYER)
    counts, _ = np.histogram(heights[rows] / size, layers)
    densest = int(np.argmax(counts))
    is_thin = counts[densest:] < DENSE * counts[densest]
    last = densest + (int(np.argmax(is_thin)) if is_thin.any() else len(is_thin))
    return float(layers[last] * size)


def _in_units(length: Length, ground: Ground) -> float:
    return length.value / 100 * ground.subject_height if length.is_percent else length.value


# The hull of a subject: its size, and the points inside.


def size_of(view: FirstView) -> float:
    """The longest distance between two points of the subject, world units, > 0."""
    points = view.points
    lengths = np.linalg.norm(points[:, None] - points, axis=2)
    return max(float(lengths.max()), float(np.finfo(np.float64).tiny))


def in_hull(points: Array, corners: F64, margin: float) -> Mask:
    """[N] which points [N, 3] lie within a margin of the convex hull of others [m, 3]."""
    from scipy.spatial import ConvexHull, QhullError

    places = points.astype(np.float64)
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    inside = ((places >= low) & (places <= high)).all(axis=1)
    try:
        planes = ConvexHull(corners).equations
    except (QhullError, ValueError):  # flat, a line or a point: use its box
        return np.asarray(inside)
    rows = np.flatnonzero(inside)
    inside[rows] = (places[rows] @ planes[:, :3].T + planes[:, 3]).max(axis=1) <= margin
    return np.asarray(inside)
