"""Few pigments: move the colors of strokes toward a small palette of the scene."""

import numpy as np

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.reduce.lloyd import GAIN, NUM_STEPS, draws_for
from brushgs.rendering.relief import paint_arguments
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

SHARE = 0.85  # of the way to the pigment: 1 makes faces of five flat patches


def use_pigments(strokes: Gaussians, num_pigments: int, *, share: float = SHARE, seed: int = 0) -> Gaussians:
    """Move the colors of strokes to the means of weighted k-means in OKLab.

    Args:
        strokes: k strokes.
        num_pigments: >= 1; fewer if strokes have fewer colors.
        share: of the way, 0 to 1.
        seed: of the start of k-means.

    Returns:
        The strokes in colors that do not depend on the view.

    Raises:
        ValueError: if `num_pigments` is below 1.
    """
    if num_pigments < 1:
        raise ValueError(f"use_pigments: num_pigments must be at least 1, got {num_pigments}")
    if len(strokes) == 0:
        return strokes
    rgb = np.empty((len(strokes), 3))
    count = min(num_pigments, len(strokes))
    _core.mix_pigments(
        **paint_arguments(strokes),
        num_pigments=count,
        share=share,
        draws=draws_for(count, seed),
        num_steps=NUM_STEPS,
        gain=GAIN,
        num_threads=num_threads_or_default(None),
        rgb=rgb,
    )
    return in_colors(strokes, rgb)
