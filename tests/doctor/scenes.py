"""Scenes that the tests of the doctor make."""

from dataclasses import replace
from functools import cache

import numpy as np

import brushgs as bg
from tests.passes.scenes import gaussians_at
from tests.scenes import still_life_of


@cache
def fruit() -> bg.Gaussians:
    """The example still life with few Gaussians."""
    return still_life_of(3000)


@cache
def ball(seed: int = 0, num_gaussians: int = 3000) -> bg.Gaussians:
    """Flat Gaussians on a sphere of radius 1, of random size, color and opacity."""
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(num_gaussians, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quats = np.stack([1 + normals[:, 2], -normals[:, 1], normals[:, 0], np.zeros(num_gaussians)], 1)
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)  # turn +z into the normal
    sizes = 1.5 / np.sqrt(num_gaussians) * np.exp(rng.normal(0, 0.4, (num_gaussians, 3)))
    sizes[:, 2] *= 0.05
    opacities, colors = rng.uniform(0.1, 0.99, num_gaussians), rng.normal(0.5, 0.28, (num_gaussians, 3))
    return gaussians_at(normals, sizes, colors, opacity=opacities, quats=quats, dtype=np.float32)


def scaled(gaussians: bg.Gaussians, factor: float) -> bg.Gaussians:
    """The same scene in another unit."""
    unit = np.float32(factor)
    return replace(gaussians, means=gaussians.means * unit, scales=gaussians.scales * unit)
