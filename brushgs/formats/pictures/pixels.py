"""A frame becomes the pixels that a video is made of: rounded once, from float.

Formats of 8 bits take 8, others 16, which their encoder rounds to its own number. Transparency is straight
(colours are not multiplied by alpha), as readers of ProRes 4444 and of VP9 in browsers expect.
"""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.pictures.oiio import Background, pixels_of, quantise, straight_colors
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame

Pixels: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]  # [H, W, 3 or 4]


def video_pixels(frame: Frame, background: Background, bits: int) -> Pixels:
    """The pixels of one frame of a video.

    Args:
        frame: the picture.
        background: as `write_frame` takes it; None keeps the transparency.
        bits: of a channel in the file.

    Returns:
        uint8 for 8 bits, else uint16 over its full range; [H, W, 3], without a background [H, W, 4] with
        straight alpha.
    """
    if background is not None:
        return pixels_of(frame, background, bits)
    values = np.concatenate([spread_colors(frame), frame.alpha[..., None]], axis=-1)
    return quantise(values, np.uint8 if bits == 8 else np.uint16)


def spread_colors(frame: Frame) -> Array:
    """[H, W, 3] straight colours, which go on where nothing is painted.

    Codecs mix the colours of neighbours, seen or not: black ones beside the paint would darken its edge. A
    pixel without paint takes the mean of the smallest block of 2, 4, 8 ... pixels a side that has some.
    """
    colors = straight_colors(frame)
    is_bare = frame.alpha <= 0
    if is_bare.any() and not is_bare.all():
        colors[is_bare] = _means_of_blocks(frame.rgb, frame.alpha)[is_bare]
    return colors


def _means_of_blocks(rgb: Array, alpha: Array) -> Array:
    """For each pixel the colour of the smallest block around it that is not bare, weighted by alpha."""
    height, width = alpha.shape
    if height == width == 1:
        return np.divide(rgb, alpha[..., None], out=np.zeros_like(rgb), where=alpha[..., None] > 0)
    padded = np.pad(np.dstack([rgb, alpha]), ((0, height % 2), (0, width % 2), (0, 0)))
    halves = padded[0::2] + padded[1::2]
    sums = halves[:, 0::2] + halves[:, 1::2]
    coarse = _means_of_blocks(sums[..., :3], sums[..., 3])
    fine = np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:height, :width]
    return np.divide(rgb, alpha[..., None], out=np.ascontiguousarray(fine), where=alpha[..., None] > 0)
