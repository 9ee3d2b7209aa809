"""Glazes: transparent paint that tints without covering.

A glaze is a filter: a box transmits color^alpha of each channel. Overlapping glazes multiply, in any order.
"""

from typing import get_args

import numpy as np

from brushgs.options.choices import Blend
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes

DARKEST = 0.02  # of a channel: no pigment absorbs all light, and a product with 0 would stay 0


def check_glaze(where: str, blend: str, underpaint: Underpaint | None, streaks: float) -> None:
    """Raise ValueError if the blend is unknown, or a glaze has underpaint or streaks."""
    if blend not in get_args(Blend):
        raise ValueError(f"{where}: blend must be one of {', '.join(get_args(Blend))}, got {blend!r}")
    if blend == "glaze" and underpaint is not None:
        raise ValueError(
            f"{where}: a glaze has no underpaint: paint it over a coat that covers, in its own call"
        )
    if blend == "glaze" and streaks != 0:
        raise ValueError(f"{where}: a glaze has no streaks, got {streaks}")


def pigments(colors: Array) -> Array:
    """Transmittance of full paint per channel, `DARKEST` to 1, for colors of any shape."""
    return np.asarray(np.clip(colors, DARKEST, 1))


def glaze_colors(boxes: Boxes) -> Array:
    """[M, 3] colors of boxes for glazes in the core: logarithms to base 2."""
    return np.log2(pigments(boxes.colors))
