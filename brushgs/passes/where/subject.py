"""Separate the subject of a scene from its surroundings."""

import numpy as np

from brushgs.passes.reduce.contribution import paint_of
from brushgs.passes.where.ground import Ground
from brushgs.passes.where.hull import in_hull, size_of
from brushgs.passes.where.parts import connected_parts
from brushgs.values.arrays import Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes

MARGIN = 0.01  # of the subject's size, tolerance of its hull
# For a scene with surroundings, in sizes of the subject: maximum reach of a part beyond its hull, and maximum
# height of level Gaussians that belong to the ground.
AROUND = 0.3
LEVEL_ON_GROUND = 0.02
LEVEL = np.cos(np.radians(30.0))  # of the shortest axis against up
FLAT = 2.0  # minimum ratio of the second axis to the shortest for a normal
# Minimum shares of a connected part of the subject: its painted area inside the hull, and its part of all
# such area. The fence beside the truck lies in the hull in part.
MOSTLY, WORTH = 0.8, 0.005


def find_subject(gaussians: Gaussians, view: FirstView, ground: Ground) -> Mask:
    """[N] the Gaussians of the subject.

    Without surroundings and ground these are the Gaussians in the hull of its points. Otherwise the hull also
    contains ground and parts of other objects; then the subject consists of the connected parts above the
    ground that lie mostly in the hull, including parts that stick out.
    """
    size = size_of(view)
    inside = in_hull(gaussians.means, view.points, MARGIN * size)
    if not view.has_surroundings and not ground.is_found:
        return inside
    near = in_hull(gaussians.means, view.points, AROUND * size)
    if ground.is_found:
        near &= ~_on_ground(gaussians, ground, size)
    rows = np.flatnonzero(near)
    some = gaussians.take(rows)
    parts = connected_parts(some)
    areas = paint_of(some)
    num = int(parts.max(initial=-1)) + 1
    whole, in_it = (np.bincount(parts, weights, num) for weights in (areas, areas * inside[rows]))
    belongs = in_it >= MOSTLY * whole
    belongs &= in_it >= WORTH * in_it[belongs].sum()
    if not belongs.any():  # nothing rises above the ground: take the hull
        return inside
    found = np.zeros(len(gaussians), bool)
    found[rows] = belongs[parts]
    return found


def _on_ground(gaussians: Gaussians, ground: Ground, size: float) -> Mask:
    heights = ground.plane.heights(gaussians.means)
    found = heights <= 0
    rows = np.flatnonzero(~found & (heights <= LEVEL_ON_GROUND * size))
    sizes = np.sort(gaussians.scales[rows].astype(np.float64), axis=1)
    normals = shortest_axes(gaussians.quats[rows], gaussians.scales[rows])
    is_level = np.abs(normals @ ground.plane.normal) >= LEVEL
    found[rows] = is_level & (sizes[:, 1] > FLAT * sizes[:, 0])
    return np.asarray(found)
