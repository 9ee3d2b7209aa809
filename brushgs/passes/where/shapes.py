"""Signed distances from the surfaces of boxes, balls, half spaces and colors; above 0 inside."""

import numpy as np

from brushgs.options.where_terms import Box, Color, Half, Sphere
from brushgs.values.arrays import F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors


def box_depths(box: Box, means: Array) -> F64:
    """[N] world units: the distance from the nearest face inside, minus that from the box outside."""
    points = means.astype(np.float64)
    beyond = np.maximum(np.array(box.low) - points, points - np.array(box.high))  # [N, 3], above 0 outside
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return np.asarray(np.where(outside > 0, -outside, -beyond.max(axis=1, initial=-np.inf)))


def sphere_depths(sphere: Sphere, means: Array) -> F64:
    """[N] world units."""
    away = means.astype(np.float64) - np.array(sphere.center)
    return np.asarray(sphere.radius - np.linalg.norm(away, axis=1))


def half_depths(half: Half, means: Array) -> F64:
    """[N] world units."""
    longest = max(map(abs, half.normal))  # squares of tiny and huge numbers stay in range
    normal = np.array(half.normal) / longest
    length = float(np.linalg.norm(normal))
    return np.asarray((means.astype(np.float64) @ normal - half.offset / longest) / length)


def color_depths(color: Color, gaussians: Gaussians) -> F64:
    """[N] in display-encoded RGB of 0 to 1."""
    away = base_colors(gaussians.sh) - np.array(color.rgb)
    return np.asarray(color.distance - np.linalg.norm(away, axis=1))
