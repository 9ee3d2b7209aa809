"""Deterministic workloads for the benchmarks: a lumpy sphere of strokes, its camera and a swirl stroke.

Sizes, depth complexity and timings resemble trained scenes brought down to as many strokes. The same call
gives the same values on every machine, so figures of different runs may be compared.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from brushgs.values.camera import Camera
from brushgs.values.gaussians import SH_TERMS, Gaussians

SEED = 20250612
FOV_Y = np.radians(50.0)
DISTANCE, AZIMUTH, ELEVATION = 3.0, 0.6, 0.35  # world units, radians, radians
SH_C0 = 0.28209479


def strokes(n: int, *, sh_degree: int = 3, dtype: type[np.floating] = np.float32) -> Gaussians:
    """Thin colored discs, roughly tangential to a lumpy sphere of radius about 1, with SH up to degree 3."""
    g = np.random.default_rng([SEED, n])
    d = _unit(g.normal(size=(n, 3)))
    th, ph = np.arctan2(d[:, 0], d[:, 2]), np.arcsin(d[:, 1])
    radius = 1 + 0.12 * np.sin(5 * th) * np.cos(3 * ph) + 0.06 * np.sin(9 * ph)
    means = d * radius[:, None] * (1 + 0.01 * g.normal(size=(n, 1)))
    size = 0.026 * (7000 / n) ** (1 / 3) * np.exp(0.35 * g.normal(size=n))
    anisotropy = np.exp(g.uniform(0, np.log(2), n))
    scales = np.stack([size * anisotropy, size / anisotropy, 0.2 * size], axis=1)
    rotations = _tangential_rotations(g, d)
    opacities = g.uniform(0.7, 1, n)
    base = 0.5 + 0.45 * np.sin(np.array([3, 4, 5]) * d + np.array([1, 2, 3]))
    sh = np.empty((n, 16, 3))
    sh[:, 0] = (base + 0.05 * g.normal(size=(n, 3)) - 0.5) / SH_C0
    sh[:, 1:] = 0.08 * g.normal(size=(n, 15, 3))
    quats = Rotation.from_matrix(rotations).as_quat()[:, [3, 0, 1, 2]]  # SciPy's order is x, y, z, w
    num_terms = next(terms for terms, degree in SH_TERMS.items() if degree == sh_degree)
    columns = (means, quats, scales, opacities, sh[:, :num_terms])
    return Gaussians(*(column.astype(dtype) for column in columns))


def camera(width: int, height: int) -> Camera:
    """The camera of every benchmark: vertical field of view 50 degrees, looking at the origin."""
    eye = DISTANCE * np.array(
        [np.cos(ELEVATION) * np.sin(AZIMUTH), np.sin(ELEVATION), np.cos(ELEVATION) * np.cos(AZIMUTH)]
    )
    return Camera.look_at(eye, (0, 0, 0), (0, 1, 0), width=width, height=height, fov_y=FOV_Y)


def swirl(size: int = 256) -> NDArray[np.uint8]:
    """Coverage [size, size] of a two-armed swirl: mean 0.40, 41 % empty, 28 % full."""
    centres = (np.arange(size) + 0.5) * 2 / size - 1
    x, y = np.meshgrid(centres, centres)
    r, t = np.hypot(x, y), np.arctan2(y, x)
    arms = 0.5 + 0.5 * np.cos(2 * t - 9 * r) + 0.6 * np.exp(-((r / 0.25) ** 2))
    alpha = _smoothstep(0.12, 0.55, arms) * (1 - _smoothstep(0.80, 0.98, r))
    return np.round(255 * alpha).astype(np.uint8)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _smoothstep(low: float, high: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
    s = np.clip((x - low) / (high - low), 0, 1)
    return s * s * (3 - 2 * s)


def _tangential_rotations(g: np.random.Generator, d: NDArray[np.float64]) -> NDArray[np.float64]:
    """[n, 3, 3] frames as columns: two axes at a random turn in a plane tilted a little off the surface."""
    n = len(d)
    normal = _unit(d + 0.25 * g.normal(size=(n, 3)))
    helper = np.where(np.abs(normal[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0])
    a = _unit(np.cross(normal, helper))
    b = np.cross(normal, a)
    turn = g.uniform(0, 2 * np.pi, (n, 1))
    e1 = np.cos(turn) * a + np.sin(turn) * b
    return np.stack([e1, np.cross(normal, e1), normal], axis=2)
