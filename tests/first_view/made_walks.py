"""Captures that surround who took them, as trained scenes of streets are: sharp within, torn without."""

from functools import cache

import numpy as np

import brushgs as bg
from tests.first_view.scenes import gaussians, joined

WIDE, LONG, HIGH = 7.0, 20.0, 6.0  # half width and half length of the street, height of its houses; up is -y


@cache
def street() -> bg.Gaussians:
    """Two rows of houses with coarse backs, a road with a coarse underside, two cars, and far floaters."""
    rng = np.random.default_rng(0)
    parts = [_wall(rng, (-WIDE, 0, -LONG), (2 * WIDE, 0, 0), (0, 0, 2 * LONG), (0, -1, 0), 0.25, 0.1)]
    for side in (-1, 1):
        for z in np.arange(-LONG, LONG, 8.0):
            color = rng.uniform(0.3, 0.8, 3)
            corner = (side * WIDE, -HIGH, z)
            parts.append(_wall(rng, corner, (0, HIGH, 0), (0, 0, 8), (-side, 0, 0), 0.2, 0.2, color))
    for x, z, color in ((-4, -3, (0.8, 0.1, 0.1)), (4, 5, (0.1, 0.2, 0.8))):
        for wide, low, high, deep in ((0.9, 0, 1, 2), (0.8, 1, 1.6, 1.2)):
            parts += _box(rng, (x, z), wide, low, high, deep, color)
    backs = rng.uniform((WIDE + 3, -HIGH, -LONG), (WIDE + 9, 0, LONG), (1200, 3))
    backs *= rng.choice((-1, 1), (1200, 1))
    backs[:, 1] = -np.abs(backs[:, 1])
    under = rng.uniform((-12, 0.5, -25), (12, 3, 25), (400, 3))
    far = rng.normal(size=(250, 3))
    far = rng.uniform(40, 90, (250, 1)) * far / np.linalg.norm(far, axis=1, keepdims=True)
    parts += [_haze(rng, places, size) for places, size in ((backs, 0.9), (under, 1.2), (far, 2.5))]
    return joined(*parts)


def _wall(rng, corner, u, v, normal, size, contrast, color=(0.5, 0.5, 0.5)):
    """A rectangle of bricks of several shades."""
    u, v = np.array(u, float), np.array(v, float)
    lengths = np.linalg.norm(u), np.linalg.norm(v)
    count = int(lengths[0] * lengths[1] / size**2)
    a, b = rng.uniform(0, 1, (2, count))
    shades = rng.normal(0, contrast, (64, 64))
    bricks = shades[(a * lengths[0] / 0.5).astype(int) % 64, (b * lengths[1] / 0.9).astype(int) % 64]
    means = np.array(corner, float) + a[:, None] * u + b[:, None] * v
    colors = np.clip(np.array(color) + bricks[:, None] + rng.normal(0, 0.03, (count, 1)), 0, 1)
    return gaussians(means, np.tile(np.array(normal, float), (count, 1)), 0.7 * size, colors)


def _box(rng, place, wide, low, high, deep, color):
    """The sides and the top of a box that stands at a place [2] of the road."""
    x, z = place
    tall = (0, high - low, 0)
    along, across = (0, 0, 2 * deep), (2 * wide, 0, 0)
    corner = np.array([x - wide, -high, z - deep])
    sides = [(corner, along, (-1, 0, 0)), (corner + across, along, (1, 0, 0))]
    sides += [(corner, across, (0, 0, -1)), (corner + along, across, (0, 0, 1))]
    parts = [_wall(rng, start, tall, side, normal, 0.1, 0.1, color) for start, side, normal in sides]
    return [*parts, _wall(rng, corner, along, across, (0, -1, 0), 0.1, 0.1, color)]


def _haze(rng, means, size):
    """Large Gaussians of any direction and some opacity."""
    count = len(means)
    sizes = size * np.exp(rng.normal(0, 0.4, count))
    colors, opacities = rng.uniform(0.3, 0.7, (count, 3)), rng.uniform(0.1, 0.7, count)
    return gaussians(means, rng.normal(size=(count, 3)), sizes, colors, opacities, flatness=0.4)
