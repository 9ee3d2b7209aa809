"""Strokes and cameras that are hard on a projection, for the tests of the page."""

import numpy as np

import brushgs as bg

VIEWS = [  # eye, target, width, height, vertical field of view in radians, near
    ((0, 0, -4), (0, 0, 0), 320, 240, 0.8, 0.01),
    ((3, -2, 1), (0, 0, 0), 640, 480, 0.6, 0.01),
    ((0.2, 0.1, -0.3), (0, 0, 1), 320, 240, 1.2, 0.2),  # among the strokes
    ((0, -4, 0.01), (0, 0, 0), 320, 240, 0.9, 0.01),  # from above
    ((50, 10, 30), (0, 0, 0), 640, 480, 0.05, 0.1),  # far
]
CAMERAS = [
    bg.Camera.look_at(eye, target, width=width, height=height, fov_y=fov_y, near=near)
    for eye, target, width, height, fov_y, near in VIEWS
]


def halved(values):
    """Float32 that float16 holds too, as the page stores opacities and colors."""
    return np.asarray(values, np.float16).astype(np.float32)


def hard_strokes(count, *, seed=0, degree=3, antialiased=False, brushes=None):
    """Of any shape between -1 and 1; a quarter are needles, tiny, larger than the picture, discs and spheres.

    Opacities and colors are such that float16 holds them.
    """
    rng = np.random.default_rng(seed)
    scales = np.exp(rng.uniform(np.log(0.005), np.log(0.2), (count, 3)))
    needles, tiny, large, discs, spheres, _ = np.split(
        np.arange(count), (np.array([0.1, 0.15, 0.17, 0.21, 0.25]) * count).astype(int)
    )
    scales[needles] = rng.uniform(0.1, 0.5, (len(needles), 1)) * (1, 1e-4, 1e-5)
    scales[tiny] = 1e-6
    scales[large] = 3.0
    scales[discs, 1] = scales[discs, 0]
    scales[spheres] = scales[spheres, :1]
    return bg.Gaussians(
        rng.uniform(-1, 1, (count, 3)).astype(np.float32),
        rng.normal(size=(count, 4)).astype(np.float32),
        rng.permutation(scales.T).T.astype(np.float32),
        halved(rng.uniform(0.05, 1, count)),
        halved(rng.normal(0, 0.3, (count, (degree + 1) ** 2, 3))),
        antialiased=antialiased,
        brushes=None if brushes is None else rng.integers(0, brushes, count).astype(np.uint8),
    )
