"""Press marks onto the tooth of a paper: a dry medium stays only on the peaks of the grain.

Applied to the finished frame, since the paper takes the paint whatever the number of strokes.
"""

from dataclasses import replace

import numpy as np

from brushgs.core.native import core as _core
from brushgs.values.arrays import Array, check
from brushgs.values.frame import Frame

SOFTNESS = 0.28  # in alpha: transition between bare paper and full paint


def press(frame: Frame, grain: Array, dry: float) -> Frame:
    """Reduce a frame to the paint that the grain of a paper takes.

    The share s(e) = e^2 (3 - 2 e) of the paint stays in a pixel, e = (alpha - dry (1 - grain)) / 0.28 clipped
    to 0 to 1: firm marks stay whole, faint ones only on the peaks. Alpha, color and height are scaled alike.

    Args:
        frame: H x W pixels.
        grain: [H, W] the surface of the paper, 0 (a valley) to 1 (a peak).
        dry: depth of the valleys for this medium, in alpha, 0 to 1; 0.42 is charcoal. At 0 only paint of an
            alpha below 0.28 gets fainter.

    Returns:
        The frame, in its dtype, with other colors, alpha and height; a depth is a mean and stays.

    Raises:
        TypeError: if `grain` is not an array.
        ValueError: if it has another size than the frame, or `dry` is out of range.
    """
    if not 0 <= dry <= 1:
        raise ValueError(f"press: dry must be in 0 to 1, got {dry}")
    check("press", alpha=(frame.alpha, "H W"), grain=(grain, "H W"))
    rgb, alpha = np.ascontiguousarray(frame.rgb), np.ascontiguousarray(frame.alpha)
    pressed_rgb, pressed_alpha = np.empty_like(rgb), np.empty_like(alpha)
    _core.press(
        rgb=rgb,
        alpha=alpha,
        grain=np.ascontiguousarray(grain, dtype=alpha.dtype),
        dry=dry,
        softness=SOFTNESS,
        pressed_rgb=pressed_rgb,
        pressed_alpha=pressed_alpha,
    )
    height = frame.height
    if height is not None:
        height = height * np.divide(pressed_alpha, alpha, out=np.zeros_like(alpha), where=alpha > 0)
    return replace(frame, rgb=pressed_rgb, alpha=pressed_alpha, height=height)
