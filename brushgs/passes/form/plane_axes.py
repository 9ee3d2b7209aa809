"""Directions of hatching: along the long axes of strokes, on flat surfaces along one axis of the plane.

On a wall, strokes turned by `orient` still differ a little from each other, and lines along them would swirl.
Where normals agree, all strokes of parallel planes share the mean of their directions.
"""

import numpy as np

from brushgs.passes.color.tone import painted_areas
from brushgs.passes.form.planes import Planes
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Mask
from brushgs.values.gaussians import Gaussians

FLAT = 0.94  # mean squared cosine of normals above which a stroke lies flat: most within 10 degrees
SAME = np.cos(np.radians(15.0))  # between normals of parallel planes
MOST_PLANES, LEAST_AREA = 8, 0.03  # orientations, and the share of the painted area that each needs
CANDIDATES = 256  # strokes whose normals are candidates for an orientation
AROUND = 20  # strokes to which a surface is fitted
OWN = 0.15  # weight of a stroke without a clear axis, relative to one with a clear axis


def mark_axes(strokes: Gaussians, *, with_planes: bool = True) -> tuple[F64, F64]:
    """The directions of marks on strokes.

    Args:
        strokes: n, turned along the form by `orient`.
        with_planes: whether strokes of flat surfaces share the direction of their plane.

    Returns:
        [n, 3] directions without sign, whose squared lengths are their weights, 0 to 1; and [n, 3] unit
        normals without sign.
    """
    if len(strokes) == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    planes = Planes.of(strokes)
    with np.errstate(invalid="ignore", divide="ignore"):
        weights = OWN + (1 - OWN) * np.clip(1 - 1 / planes.aspects, 0, 1)
    axes = planes.axes[:, 0] * np.sqrt(weights)[:, None]
    if not with_planes:
        return axes, planes.axes[:, 2]
    normals, agreement = _normals_around(strokes)
    areas, is_left = painted_areas(strokes), agreement >= FLAT
    least = LEAST_AREA * areas.sum()
    for _ in range(MOST_PLANES):
        is_of_plane = _largest_plane(normals, areas, is_left)
        if areas[is_of_plane].sum() <= least:
            break
        axes[is_of_plane] = _axis_of(axes[is_of_plane], normals[is_of_plane], areas[is_of_plane])
        is_left &= ~is_of_plane
    return axes, planes.axes[:, 2]


def _normals_around(strokes: Gaussians) -> tuple[F64, F64]:
    """Normals [n, 3] of the surface fitted to the strokes around each, and [n] its flatness, 0 to 1.

    Normals of single strokes are unreliable: on captured walls they differ by more than 30 degrees.
    """
    means = strokes.means.astype(np.float64)
    count = min(AROUND, len(means))
    _, rows = nearest(means, means, count)
    offsets = means[rows] - means[rows].mean(axis=1, keepdims=True)
    normals = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets))[1][:, :, 0]
    tensors = (normals[:, :, None] * normals[:, None, :])[rows].mean(axis=1)
    values, vectors = np.linalg.eigh(tensors)
    return vectors[:, :, 2], values[:, 2]


def _largest_plane(normals: F64, areas: F64, is_left: Mask) -> Mask:
    """[n] those remaining strokes whose normals agree with the normal that has the largest area around it."""
    rows = np.flatnonzero(is_left)
    if len(rows) == 0:
        return is_left
    some = rows[:: -(-len(rows) // CANDIDATES)]
    agree = np.abs(normals[some] @ normals[rows].T) >= SAME
    best = normals[some[np.argmax(agree @ areas[rows])]]
    return np.asarray(is_left & (np.abs(normals @ best) >= SAME))


def _axis_of(axes: F64, normals: F64, areas: F64) -> F64:
    """[3] the mean direction of axes [m, 3], perpendicular to the mean normal."""
    normal = np.linalg.eigh(np.einsum("m,mi,mj->ij", areas, normals, normals))[1][:, 2]
    inside = axes - (axes @ normal)[:, None] * normal
    return np.asarray(np.linalg.eigh(np.einsum("m,mi,mj->ij", areas, inside, inside))[1][:, 2])
