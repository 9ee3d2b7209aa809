"""Glazes: transparent paint, which tints what lies behind it and covers nothing.

A glaze is a filter: of the light from behind, a box lets the share colour^alpha of each channel through. So
where many overlap their shares multiply, and which lies in front plays no part.
"""

from typing import get_args

import numpy as np

from brushgs.options.choices import Blend
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes

DARKEST = 0.02  # of a channel: no pigment swallows all light, and a product with 0 would stay 0


def check_glaze(where: str, blend: str, underpaint: Underpaint | None, streaks: float) -> None:
    """Raise ValueError if the blend is unknown, or a glaze is to have what only paint that covers has."""
    if blend not in get_args(Blend):
        raise ValueError(f"{where}: blend must be one of {', '.join(get_args(Blend))}, got {blend!r}")
    if blend == "glaze" and underpaint is not None:
        raise ValueError(
            f"{where}: a glaze has no underpaint: paint it over a coat that covers, in its own call"
        )
    if blend == "glaze" and streaks != 0:
        raise ValueError(f"{where}: a glaze has no streaks, got {streaks}")


def pigments(colors: Array) -> Array:
    """The share of each channel that full paint lets through, `DARKEST` to 1, of colours of any shape."""
    return np.asarray(np.clip(colors, DARKEST, 1))


def glaze_colors(boxes: Boxes) -> Array:
    """[M, 3] the colours of boxes as the core takes them for a glaze: logarithms to base 2."""
    return np.log2(pigments(boxes.colors))
