"""Downscaling of pictures for pages."""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64


def reduced(image: NDArray[np.generic], longest: int) -> F64:
    """[h, w, C] a picture [H, W, C] averaged down to at most a longest side."""
    pixels = np.asarray(image, np.float64)
    factor = longest / max(pixels.shape[:2])
    if factor >= 1:
        return pixels
    for axis, size in enumerate(pixels.shape[:2]):
        ends = np.linspace(0, size, max(1, round(size * factor)) + 1)
        sums = np.concatenate([np.zeros_like(pixels.take([0], axis)), np.cumsum(pixels, axis)], axis)
        low = np.minimum(np.floor(ends).astype(int), size - 1)
        part = (ends - low).reshape([-1 if k == axis else 1 for k in range(3)])
        at = sums.take(low, axis) * (1 - part) + sums.take(low + 1, axis) * part
        pixels = np.diff(at, axis=axis) * ((len(ends) - 1) / size)
    return pixels
