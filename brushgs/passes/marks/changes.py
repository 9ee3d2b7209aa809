"""What a paint-over changes in the strokes of the scene: some are not painted, some are turned."""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from brushgs.values.arrays import F64, Array, Mask, smoothstep
from brushgs.values.gaussians import Gaussians
from brushgs.values.marks import Combs, Erased, Overpaint
from brushgs.values.quats import quat_products, rotation_matrices

DEEP = 1.0  # radii by which what is erased reaches below the surface, and above it


def changed(strokes: Gaussians, overpaint: Overpaint) -> Gaussians:
    """The strokes with erased ones of opacity 0, so that rows stay, and combed ones turned."""
    if overpaint.combs is not None:
        strokes = combed(strokes, overpaint.combs)
    if overpaint.erased is not None and (gone := is_erased(strokes.means, overpaint.erased)).any():
        strokes = replace(strokes, opacities=np.where(gone, 0, strokes.opacities))
    return strokes


def is_erased(points: Array, erased: Erased) -> Mask:
    """[P] whether points [P, 3] lie on an erased patch of the surface."""
    gone = np.zeros(len(points), bool)
    tree = cKDTree(points)
    for mean, normal, radius in zip(erased.means, erased.normals, erased.radii, strict=True):
        rows = np.array(tree.query_ball_point(mean, radius * np.hypot(1, DEEP)), np.intp)
        offsets = points[rows] - mean
        away = offsets @ normal
        beside = np.linalg.norm(offsets - away[:, None] * normal, axis=1)
        gone[rows[(np.abs(away) <= DEEP * radius) & (beside <= radius)]] = True
    return gone


def combed(strokes: Gaussians, combs: Combs) -> Gaussians:
    """Strokes turned about their shortest axis, so that the longest one runs along the combs around them."""
    axes, order = rotation_matrices(strokes.quats), np.argsort(-strokes.scales, axis=1)
    rows = np.arange(len(strokes))
    along, across, normal = (axes[rows, :, order[:, axis]] for axis in range(3))
    pairs = np.zeros((len(strokes), 2))  # of the angle, doubled: a direction has no sign
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
    """Strokes turned about unit axes [N, 3] by angles [N] in radians, right-handed; 0 leaves one as it is."""
    turns = np.concatenate([np.cos(angles / 2)[:, None], np.sin(angles / 2)[:, None] * axes], axis=1)
    quats = strokes.quats.astype(np.float64)
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    quats = np.where((angles != 0)[:, None], quat_products(turns, quats), strokes.quats)
    return replace(strokes, quats=quats.astype(strokes.quats.dtype))
