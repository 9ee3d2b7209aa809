"""Computed brush images: the 3DGS kernel for plain Gaussians among strokes, dots, and an even line.

A kernel cannot be mixed with images, see `BrushSet`. The image is rounded to 8 bits and filtered by "mip":
pictures of 960 x 600 have a PSNR of 57 dB (still life), 55 (koala) and 49 (truck) to those of the kernel.
"""

from functools import lru_cache

import numpy as np

from brushgs.brushes.texture import KERNEL_SIGMAS, StrokeTexture

SOFT = "soft"
DOT_SIZE, DOT_RIM = 32, 3.0  # texels of a dot, which is a few pixels wide, and of its rim
PEN_SIZE, PEN_RIM, PEN_EDGE = (16, 64), 2.0, 1.2  # texels of a line, of its rims, and of paper beside them
SIZE = 256  # texels; 128 loses 1 to 2.4 dB, 64 loses 3 to 7


@lru_cache
def soft_brush() -> StrokeTexture:
    """A brush whose coverage is that of the kernel "gaussian" over its box, without bristles or relief."""
    s = (2 * np.arange(SIZE) + 1) / SIZE - 1
    across = np.exp(-0.5 * (KERNEL_SIGMAS["gaussian"] * s) ** 2)
    coverage = np.rint(255 * across[:, None] * across).astype(np.uint8)
    return StrokeTexture("image", SOFT, coverage, None, KERNEL_SIGMAS["gaussian"], has_bristles=False)


@lru_cache
def dot_brush() -> StrokeTexture:
    """A round dot of ink that fills its box, with a soft rim."""
    s = (2 * np.arange(DOT_SIZE) + 1) / DOT_SIZE - 1
    rim = (1 - np.hypot(s[:, None], s)) * DOT_SIZE / 2  # texels inside the circle that touches the box
    coverage = np.rint(255 * np.clip(rim / DOT_RIM, 0, 1)).astype(np.uint8)
    return StrokeTexture("image", "dot", coverage, None, has_bristles=False)


@lru_cache
def pen_brush() -> StrokeTexture:
    """An even line of ink with square ends and soft rims; its pieces join without a seam.

    It is 0.77 as wide as its box.
    """
    s = np.arange(PEN_SIZE[0]) + 0.5
    rim = np.minimum(s, PEN_SIZE[0] - s) - PEN_EDGE
    across = np.rint(255 * np.clip(rim / PEN_RIM, 0, 1)).astype(np.uint8)
    coverage = across[:, None].repeat(PEN_SIZE[1], axis=1)
    return StrokeTexture("image", "pen", coverage, None, has_bristles=False)
