"""What the core computes of scenes before they are clustered, in NumPy, float64: short and obvious."""

from itertools import pairwise

import numpy as np

from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors

LINES = np.array([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)], float)
COLUMN, REACH, FARTHEST = 2.0 / 64, 0.25, 4.0  # radii


def robust_extent(points):
    low, high = np.percentile(points.astype(np.float64), (1, 99), axis=0)
    if not (high > low).any():
        low, high = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    return 0.5 * (low + high), 0.5 * np.linalg.norm(high - low) or 1.0


def contracted(means, center, radius):
    away = (means - center) / radius
    distance = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1.0)
    contraction = (2 - 1 / distance) / distance
    return away * contraction, contraction / radius


def features(scene, center, radius):
    places, factors = contracted(scene.means, center, radius)
    scales = np.minimum(scene.scales * factors, 2.0)
    return np.concatenate([places, scales, 0.07 * base_colors(scene.sh)], axis=1)


def spans(scene, points):
    return rotation_matrices(scene.quats) * points[:, None, 3:6]


def seen_scales(scales, finest):
    order = np.argsort(scales, axis=1)
    thin, middle, long = np.take_along_axis(scales.astype(np.float64), order, axis=1).T
    thick = np.maximum(thin, finest - middle), np.maximum(middle, finest), np.maximum(long, finest)
    seen = np.empty(scales.shape)
    np.put_along_axis(seen, order, np.stack(thick, axis=1), axis=1)
    return np.where((middle < finest)[:, None], seen, scales)


def visible_shares(means, opacities, areas):
    center, radius = robust_extent(means)
    points = np.clip((means - center) / radius, -FARTHEST, FARTHEST)
    painted = 2 * np.pi * opacities.astype(np.float64) * areas / radius**2 / COLUMN**2
    depths = -np.log1p(-np.minimum(painted, 0.99))
    light = np.zeros(len(points))
    for line in LINES / np.linalg.norm(LINES, axis=1, keepdims=True):
        across = np.cross(line, np.eye(3)[np.argmin(np.abs(line))])
        across /= np.linalg.norm(across)
        cells = np.floor((points @ np.stack([across, np.cross(line, across)], axis=1) + 8) / COLUMN)
        along = points @ line
        away = along - along[:, None]
        beside = (cells[:, None] == cells).all(axis=2) & (np.abs(away) <= REACH)
        light += sum(np.exp(-((beside & is_between) @ depths)) for is_between in (away > 0, away < 0))
    return np.maximum(light / (2 * len(LINES)), 1e-6)


def color_detail(sh, order):
    """`order` is along the Morton curve."""
    firsts = [*range(0, max(1, len(order) - 15), 16), len(order)]
    detail = np.empty(len(order))
    for begin, end in pairwise(firsts):
        rows = order[begin:end]
        colors = base_colors(sh[rows])
        detail[rows] = np.sqrt(((colors - colors.mean(axis=0)) ** 2).sum() / len(rows))
    return detail


def cluster_weights(contributions, detail):
    weights = contributions**0.375 * (0.01 + np.minimum(detail, 0.1))
    return np.maximum(weights / weights.max(), 1e-9) if weights.max() > 0 else np.ones(len(weights))


def spread(weights, order):
    """`order` is along the Morton curve."""
    turns = np.modf((np.arange(len(weights)) + 0.5) * (5**0.5 - 1) / 2)[0]
    factors = np.empty(len(weights))
    factors[order] = 4.0 ** (2 * turns - 1)
    return weights * factors


def num_spare(weights, ranked):
    lost = np.cumsum(np.minimum(weights, np.percentile(weights, 90))[np.argsort(ranked, kind="stable")])
    return np.count_nonzero(lost <= 0.05 * lost[-1])
