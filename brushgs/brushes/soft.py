"""The soft brush: the 3DGS kernel as an image, for plain Gaussians among strokes.

A kernel cannot be mixed with images, see `BrushSet`. The image is rounded to 8 bits and filtered by "mip":
pictures of 960 x 600 have a PSNR of 57 dB (still life), 55 (koala) and 49 (truck) to those of the kernel.
"""

from functools import lru_cache

import numpy as np

from brushgs.brushes.texture import KERNEL_SIGMAS, StrokeTexture

SOFT = "soft"
SIZE = 256  # texels; 128 loses 1 to 2.4 dB, 64 loses 3 to 7


@lru_cache
def soft_brush() -> StrokeTexture:
    """A brush whose coverage is that of the kernel "gaussian" over its box, without bristles or relief."""
    s = (2 * np.arange(SIZE) + 1) / SIZE - 1
    across = np.exp(-0.5 * (KERNEL_SIGMAS["gaussian"] * s) ** 2)
    coverage = np.rint(255 * across[:, None] * across).astype(np.uint8)
    return StrokeTexture("image", SOFT, coverage, None, KERNEL_SIGMAS["gaussian"], has_bristles=False)
