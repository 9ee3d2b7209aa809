"""Downscale large pictures; the side length that mark sizes are relative to."""

import numpy as np

from brushgs.values.arrays import F32, Array
from brushgs.values.colors import flatten


def averaged(image: Array, most: int) -> F32:
    """The opaque colors [h, w, 3] of a picture, block-averaged to at most `most` pixels a side."""
    step = -(-max(image.shape[:2]) // most)
    height, width = max(image.shape[0] // step, 1), max(image.shape[1] // step, 1)
    small = np.empty((height, width, 3), np.float32)
    for row in range(height):  # row by row: whole copies of a large picture would take much memory
        block = flatten(image[row * step : (row + 1) * step, : width * step].astype(np.float32))
        small[row] = block.reshape(len(block), width, -1, 3).mean(axis=(0, 2))
    return np.clip(small, 0, 1)


def shorter_side(shape: tuple[int, ...]) -> float:
    """Length of the shorter side of a picture (height, width), pixels.

    For long, narrow pictures: the shorter side of a 4:3 picture of the same area, because the marks in a
    strip cut out of a painting are as large as those of the painting.
    """
    height, width = shape
    return float(max(min(shape), np.sqrt(0.75 * height * width)))
