"""Apply erased areas and combs of a paint-over to strokes: some are cut, some are turned."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from brushgs.rendering.cut import Cut
from brushgs.values.arrays import F64, smoothstep
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Combs, Erased
from brushgs.values.quats import quat_products, quats_of, rotation_matrices

REACH = 3.0  # radius of the paint of a stroke in standard deviations
TOLERANCE = 2.0  # thicknesses of the erased surface: paint up to this far in front of a disc does not hide it


def cut_of(strokes: Gaussians, erased: Erased) -> Cut | None:
    """The erased part of strokes; None if none of them lies on the erased surface.

    A stroke lies on it if its center is no farther above or below a disc than the radius plus its own size.

    Args:
        strokes: N strokes, at the moment of the erasure.
        erased: discs.
    """
    scales = np.sort(strokes.scales.astype(np.float64), axis=1)
    sizes, reaches = np.sqrt(scales[:, 1] * scales[:, 2]), REACH * scales[:, 2]
    touching, inside = np.zeros(len(strokes), bool), np.zeros(len(strokes), bool)
    thick = np.zeros(len(erased))
    for row in range(len(erased)):
        radius, normal = erased.radii[row], erased.normals[row]
        offsets = strokes.means - erased.means[row]
        away = offsets @ normal
        beside = np.linalg.norm(offsets - away[:, None] * normal, axis=1)
        here = (np.abs(away) <= radius + sizes) & (beside <= radius + reaches)
        thick[row] = radius + sizes[here].max(initial=0)
        touching |= here
        inside |= here & (beside <= radius)
    if not touching.any():
        return None
    flat = np.zeros((len(erased), 3))
    flat[:, :2] = erased.radii[:, None] * (1, 1 - 1e-6)
    along = np.cross(erased.normals, np.eye(3)[np.abs(erased.normals).argmin(axis=1)])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    axes = np.stack([along, np.cross(-erased.normals, along), -erased.normals], axis=2)
    columns = erased.means, quats_of(axes), flat, np.ones(len(erased)), np.zeros((len(erased), 1, 3))
    discs = Gaussians(*(column.astype(np.float32) for column in columns))
    return Cut(discs, erased.normals, TOLERANCE * thick, touching, inside)


def combed(strokes: Gaussians, combs: Combs) -> Gaussians:
    """Strokes turned about their shortest axis, so that the longest one follows the combs around them."""
    axes, order = rotation_matrices(strokes.quats), np.argsort(-strokes.scales, axis=1)
    rows = np.arange(len(strokes))
    along, across, normal = (axes[rows, :, order[:, axis]] for axis in range(3))
    pairs = np.zeros((len(strokes), 2))  # cosine and sine of the doubled angle: directions are unsigned
    weights = np.zeros(len(strokes))
    tree = cKDTree(strokes.means)
    columns = zip(combs.means, combs.radii, combs.directions, combs.strengths, strict=True)
    for mean, radius, direction, strength in columns:
        near = np.array(tree.query_ball_point(mean, radius), np.intp)
        distance = np.linalg.norm(strokes.means[near] - mean, axis=1)
        weight = strength * (1 - smoothstep(distance / radius))
        angle = 2 * np.arctan2(across[near] @ direction, along[near] @ direction)
        pairs[near] += weight[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        weights[near] += weight
    turn = 0.5 * np.arctan2(pairs[:, 1], pairs[:, 0]) * np.minimum(weights, 1)
    turn *= np.sign((np.cross(along, across) * normal).sum(axis=1))
    return turned(strokes, normal, turn)


def turned(strokes: Gaussians, axes: F64, angles: F64) -> Gaussians:
    """Strokes turned about unit axes [N, 3] by angles [N] in radians, right-handed; 0 changes nothing."""
    turns = np.concatenate([np.cos(angles / 2)[:, None], np.sin(angles / 2)[:, None] * axes], axis=1)
    quats = strokes.quats.astype(np.float64)
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    quats = np.where((angles != 0)[:, None], quat_products(turns, quats), strokes.quats)
    return replace(strokes, quats=quats.astype(strokes.quats.dtype))
