"""Large pictures -> small ones; and the side in which the marks of one are measured."""

import numpy as np

from brushgs.values.arrays import F32, Array
from brushgs.values.colors import flatten


def averaged(image: Array, most: int) -> F32:
    """The opaque colors [h, w, 3] of a picture, averaged over blocks to at most so many pixels a side."""
    step = -(-max(image.shape[:2]) // most)
    height, width = max(image.shape[0] // step, 1), max(image.shape[1] // step, 1)
    small = np.empty((height, width, 3), np.float32)
    for row in range(height):  # whole copies of a large picture add up
        block = flatten(image[row * step : (row + 1) * step, : width * step].astype(np.float32))
        small[row] = block.reshape(len(block), width, -1, 3).mean(axis=(0, 2))
    return np.clip(small, 0, 1)


def shorter_side(shape: tuple[int, ...]) -> float:
    """Pixels of the shorter side of a picture (height, width); of a long narrow one that of 4:3 of its area.

    Marks are shares of it: those of a strip cut out of a painting are not larger than those of the painting.
    """
    height, width = shape
    return float(max(min(shape), np.sqrt(0.75 * height * width)))
