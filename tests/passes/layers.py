"""Surfaces of a single opaque layer of nearly equal Gaussians, as scanners and programs make them."""

import numpy as np

from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0

COVER = 0.6  # standard deviation over distance: closed, and not blurred
SIZE = 140  # pixels
JITTER = 0.25  # of the distance, standard deviation


def relief(num=4900):
    x, y, spacing = _lattice(num)
    z = 0.06 * np.sin(5 * x) * np.cos(4 * y) + 0.015 * np.sin(13 * x)
    slope_x = 0.3 * np.cos(5 * x) * np.cos(4 * y) + 0.195 * np.cos(13 * x)
    slope_y = -0.24 * np.sin(5 * x) * np.sin(4 * y)
    return _layer(np.stack([x, y, z], axis=1), np.stack([-slope_x, -slope_y, 1 + 0 * x], axis=1), spacing)


def sphere(num=4900):
    turn, height = np.pi * (1 + 5**0.5) * np.arange(num), 1 - (2 * np.arange(num) + 1) / num
    radius = np.sqrt(1 - height**2)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    spacing = np.sqrt(4 * np.pi / num)
    points += JITTER * spacing * np.random.default_rng(0).normal(size=points.shape)
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return _layer(points, points, spacing)


def cameras(distance=2.8):
    """Two views of what lies within one unit of the origin: along z, and aslant."""
    return [
        Camera.look_at(eye, (0, 0, 0), (0, -1, 0), width=SIZE, height=SIZE, fov_y=0.75)
        for eye in ((0, 0, distance), (0.5 * distance, 0.2 * distance, 0.8 * distance))
    ]


def _lattice(num):
    side = round(num**0.5)
    spacing = 2 / side
    steps = (np.arange(side) + 0.5) * spacing - 1
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    shifts = JITTER * spacing * np.random.default_rng(0).normal(size=(2, len(x)))
    return x + shifts[0], y + shifts[1], spacing


def _layer(points, normals, spacing):
    z = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    x = np.cross(np.where(np.abs(z[:, :1]) < 0.9, [[1.0, 0, 0]], [[0, 1.0, 0]]), z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    scales = np.tile(COVER * spacing * np.array([1.0, 1.0, 0.1]), (len(points), 1))
    sh = ((_colors(points) - 0.5) / C0)[:, None]
    quats = quats_of(np.stack([x, np.cross(z, x), z], axis=2))
    return Gaussians(points, quats, scales, np.full(len(points), 0.97), sh)


def _colors(points):
    """Waves with dark spots."""
    x, y, z = points.T
    waves = [0.3 * np.sin(9 * x), 0.3 * np.sin(7 * y + 4 * z), 0.25 * np.sin(8 * (x + y)) * np.cos(6 * z)]
    colors = np.array([0.5, 0.45, 0.4]) + np.stack(waves, axis=1)
    colors[np.sin(9 * x) * np.sin(8 * y + 5 * z) > 0.5] *= 0.4
    return np.clip(colors, 0.02, 0.95)
