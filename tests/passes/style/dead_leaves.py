"""Dead leaves: marks of one known size that lie on each other at random, over whatever is depicted."""

import numpy as np


def depicted(kind, height, width):
    """[H, W] what marks take their lightness from: nothing, a gradient, or large shapes."""
    y, x = np.mgrid[:height, :width] / min(height, width)
    if kind == "flat":
        return np.full((height, width), 0.5)
    if kind == "gradient":
        return 0.25 + 0.35 * x + 0.15 * np.sin(3 * y)
    found = 0.3 + 0.2 * (y > 0.62 + 0.05 * np.sin(5 * x))
    for cx, cy, radius, tone in ((0.35, 0.4, 0.2, 0.75), (0.9, 0.5, 0.26, 0.45), (0.7, 0.85, 0.12, 0.2)):
        found = np.where((x - cx) ** 2 + (y - cy) ** 2 < radius**2, tone, found)
    return found


def dead_leaves(length, width, *, kind="flat", jitter=0.05, seed=0, straight=False):
    """[H, W, 3] a painting of marks of a length and a width, shares of its shorter side."""
    height, columns, short = 512, 666, 512
    rng = np.random.default_rng(seed)
    base = depicted(kind, height, columns)
    image = np.repeat(base[..., None], 3, axis=2).astype(np.float32)
    half = 0.5 * short * np.array([length, width])
    number = int(4 * 1.3 / (length * width))
    reach = int(np.ceil(np.hypot(*half))) + 1
    for x, y in zip(rng.uniform(0, columns, number), rng.uniform(0, height, number), strict=True):
        angle = 0.2 if straight else 0.7 * np.sin(4 * x / short)
        left, top = max(int(x) - reach, 0), max(int(y) - reach, 0)
        right, bottom = min(int(x) + reach + 1, columns), min(int(y) + reach + 1, height)
        px, py = np.arange(left, right) + 0.5 - x, (np.arange(top, bottom) + 0.5 - y)[:, None]
        u, v = np.cos(angle) * px + np.sin(angle) * py, np.cos(angle) * py - np.sin(angle) * px
        cover = np.clip(half[0] - np.abs(u) + 0.5, 0, 1) * np.clip(half[1] - np.abs(v) + 0.5, 0, 1)
        own = base[min(int(y), height - 1), min(int(x), columns - 1)] + jitter * rng.normal()
        color = np.clip(own + 0.3 * jitter * rng.normal(size=3), 0, 1)
        part = image[top:bottom, left:right]
        part += cover[..., None].astype(np.float32) * (color - part).astype(np.float32)
    return image
