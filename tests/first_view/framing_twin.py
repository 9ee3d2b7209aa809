"""What a first view frames, and crumbs below it, in NumPy."""

import numpy as np
from scipy.ndimage import binary_propagation

from brushgs.cameras.framing import FLAT_ELEVATION, camera_axes, default_elevation
from brushgs.first_view.sample import Painter, thin, thinned
from brushgs.passes.reduce.contribution import paint_of, projected_areas
from brushgs.values.quats import rotation_matrices
from tests.first_view.twin import camera_around, subject, weighted_quantiles

MOST_ROWS, NUM_VIEWS, ELEVATION, SEEN, MOST_AROUND = 60_000, 4, np.radians(15.0), 0.5, 2.0
VOXELS, DENSE_TAIL = 64, 0.015
ATTACHED_VOXELS, FARTHEST, LARGEST, FILLED, MOST_OF_ONE, MARGIN = 48, 0.35, 0.05, 0.06, 0.05, 0.05
HANGS, REACH, SMEARED, SAMPLE, ABOVE, COARSE, FAINT, MOST = 0.006, 2.0, 2.0, 20_000, 0.7, 0.01, 0.1, 0.15


def has_surroundings(gaussians, up):
    """Whether most of the visible scene lies around its middle."""
    whole, _ = subject(gaussians, is_whole=True)
    middle, spans_more = subject(gaussians)
    if not spans_more:
        return False
    low, high = whole.min(axis=0), whole.max(axis=0)
    center, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    scene = thin(gaussians, np.arange(len(gaussians)), MOST_ROWS)
    inner = scene.take(_within(scene, middle))
    ratios, paint = [], Painter()
    for view in range(NUM_VIEWS):
        camera = camera_around(center, radius, camera_axes(up, 2 * np.pi * view / NUM_VIEWS, ELEVATION))
        covered, covered_by_inner = ((paint(g, camera).alpha > SEEN).sum() for g in (scene, inner))
        ratios.append((covered - covered_by_inner) / max(covered_by_inner, 1))
    return bool(np.median(ratios) > MOST_AROUND)


def dense_middle(gaussians):
    """[n, 3] centers of Gaussians in the dense middle of a scene, which was photographed from near.

    The box with most of the opacity along each axis, weighted by the number of Gaussians in the voxel.
    """
    whole, _ = subject(gaussians, is_whole=True)
    rows = np.flatnonzero(_within(gaussians, whole))
    rows = rows[thinned(len(rows), MOST_ROWS)]
    means = gaussians.means[rows].astype(np.float64)
    low = whole.min(axis=0)
    voxel = float(np.linalg.norm(whole.max(axis=0) - low)) / VOXELS
    cells = np.floor((means - low) / max(voxel, 1e-300)).astype(np.int64)
    keys = (cells[:, 0] * (VOXELS + 1) + cells[:, 1]) * (VOXELS + 1) + cells[:, 2]
    _, places, counts = np.unique(keys, return_inverse=True, return_counts=True)
    weights = gaussians.opacities[rows].astype(np.float64) * counts[places]
    at = (DENSE_TAIL, 1 - DENSE_TAIL)
    low, high = np.transpose([weighted_quantiles(column, weights, at) for column in means.T])
    return np.asarray(means[((means >= low) & (means <= high)).all(axis=1)])


def _within(gaussians, points):
    """Mask of the Gaussians in the box of points."""
    low, high = points.min(axis=0), points.max(axis=0)
    return np.asarray(((gaussians.means >= low) & (gaussians.means <= high)).all(axis=1))


def with_attached(gaussians, points):
    """Points of the middle of an object, with those that filled voxels connect to their box."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.linalg.norm(high - low))
    if not size > 0:
        return points
    border, voxel = FARTHEST * float((high - low).max()), size / ATTACHED_VOXELS
    origin = low - border
    means = gaussians.means
    is_near = ((means >= origin) & (means <= high + border)).all(axis=1)
    is_near &= gaussians.scales.max(axis=1) < LARGEST * size
    rows = np.flatnonzero(is_near & ~_within(gaussians, points))
    if len(rows) == 0:
        return points
    means = gaussians.means[rows].astype(np.float64)
    shape = tuple(np.floor((high - low + 2 * border) / voxel).astype(int) + 1)
    cells = np.minimum(np.floor((means - origin) / voxel).astype(int), np.array(shape) - 1)
    keys = np.ravel_multi_index(tuple(cells.T), shape)
    painted = 2 * np.pi * gaussians.opacities[rows] * projected_areas(gaussians.scales[rows]) / voxel**2
    filled = np.bincount(keys, np.minimum(painted, MOST_OF_ONE), int(np.prod(shape))).reshape(shape) >= FILLED
    first, last = (np.floor((corner - origin) / voxel).astype(int) for corner in (low, high))
    middle = np.zeros(shape, bool)
    middle[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))] = True
    # Over faces, edges and corners.
    is_reached = binary_propagation(middle, np.ones((3, 3, 3), bool), filled | middle)
    return np.concatenate([points, means[is_reached.ravel()[keys]]])


def fit_eye(points, tangents):
    """The nearest eye, in camera axes, with all points inside the frustum with a margin.

    A point is inside the right plane where x - t z <= eye_x - t eye_z, so only the outermost point per plane
    counts, and two opposite planes together bound eye_z.
    """
    tangents = tangents * (1 - 2 * MARGIN)
    xy, z = points[:, :2], points[:, 2:]
    high, low = (xy - tangents * z).max(axis=0), (-xy - tangents * z).max(axis=0)
    middle = 0.5 * (z.min() + z.max())
    size = max(float(np.ptp(points, axis=0).max()), 1e-6 * float(np.abs(points).max())) or 1e-9
    # A very wide lens could fit the points from between them: keep the eye in front of the nearest.
    in_front = min(middle - 0.5 * size, float(z.min()) - 0.05 * size)
    eye_z = min(float((-(high + low) / (2 * tangents)).min()), in_front)
    depths = z[:, 0] - eye_z
    return np.array([*(_center(column, depths) for column in xy.T), eye_z]), float(middle - eye_z)


def _center(x, depths):
    """Coordinate of the eye at which the outermost points are equally far from the middle of the picture.

    By bisection: the sum of the two outermost slopes decreases with the coordinate.
    """
    slopes, per_step = x / depths, 1 / depths
    low, high = float(x.min()), float(x.max())
    for _ in range(30):
        eye = 0.5 * (low + high)
        seen = slopes - eye * per_step
        low, high = (eye, high) if seen.max() + seen.min() > 0 else (low, eye)
    return 0.5 * (low + high)


def find_crumbs(gaussians, view):
    """[N] mask of the crumbs below an object; empty if the scene is not a single object in a void."""
    none = np.zeros(len(gaussians), bool)
    is_flat = default_elevation(view.points, view.up) == FLAT_ELEVATION
    levels = view.points @ view.up
    foot, height = levels.min(), float(np.ptp(levels))
    if view.eye is not None or view.has_surroundings or is_flat or not height > 0:
        return none
    above = (gaussians.means.astype(np.float64) @ view.up - foot) / height
    low = np.flatnonzero(above < ABOVE / height * gaussians.scales.max(axis=1))
    above, low_ones = above[low], gaussians.take(low)
    upright, level = (extent / height for extent in _extents(low_ones, view.up))
    every = slice(None, None, max(1, -(-len(gaussians) // SAMPLE)))
    usual = float(np.median(_extents(gaussians.take(every), view.up)[0])) / height
    hangs = (above < ABOVE * upright) & (above - REACH * upright < -HANGS) & (upright > SMEARED * usual)
    is_below = above + upright < 0
    found = none.copy()
    found[low] = hangs & (~is_below | (level > COARSE) | (low_ones.opacities < FAINT))
    paint = paint_of(gaussians)
    return found if paint[found].sum() <= MOST * paint.sum() else none


def _extents(gaussians, up):
    """[N] and [N] standard deviations of Gaussians along up, and across it, world units."""
    axes = rotation_matrices(gaussians.quats).astype(np.float64)
    squares = gaussians.scales.astype(np.float64) ** 2
    upright = (np.einsum("nij,i->nj", axes, up) ** 2 * squares).sum(axis=1)
    level = np.maximum(squares.sum(axis=1) - upright, 0)
    return np.sqrt(upright), np.sqrt(0.5 * level)
