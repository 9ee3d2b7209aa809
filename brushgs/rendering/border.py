"""Thin out boxes toward the border of the picture, leaving the ground bare as painters do.

The border belongs to the canvas, so this applies to the boxes of each view. Boxes fade smoothly as the camera
moves.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.hashing import GOLDEN, uniform

WIDTH = 0.13  # of the border, over the picture's smaller side
# At the very border a fifth of the boxes is left; none with centers 0.35 border widths outside.
LEFT_AT_BORDER, SPREAD, FADE = 0.35, 1.1, 0.25  # in widths of the border


def thin_to_border(boxes: Boxes, camera: Camera, *, width: float = WIDTH, seed: int = 0) -> Boxes:
    """Lower the opacity of boxes near the border of the picture, by random amounts.

    The opacity of a box is multiplied by (d / width + 0.35 - 1.1 r) / 0.25, clipped to 0 to 1; d is the
    distance of its center from the nearest side (negative outside) over the picture's smaller side, r a hash
    of its row in 0 to 1.

    Args:
        boxes: M boxes of one view.
        camera: the view; only its size is used.
        width: of the border, over the picture's smaller side, > 0. Boxes further inside do not change.
        seed: 0 to 2^32 - 1.

    Raises:
        ValueError: if `width` or `seed` is out of range.
    """
    if not 0 < width < np.inf:
        raise ValueError(f"thin_to_border: width must be positive and finite, got {width}")
    if not 0 <= seed < 2**32:
        raise ValueError(f"thin_to_border: seed must be in 0 to {2**32 - 1}, got {seed}")
    places = boxes.centers.astype(np.float64)
    inside = np.minimum(places, (camera.width, camera.height) - places).min(axis=1)
    inside /= min(camera.width, camera.height)
    room = (inside / width + LEFT_AT_BORDER - SPREAD * uniform_of(boxes.ids, seed)) / FADE
    opacities = boxes.opacities * np.clip(room, 0, 1)
    return replace(boxes, opacities=opacities.astype(boxes.opacities.dtype))


def uniform_of(ids: NDArray[np.integer[Any]], seed: int) -> F64:
    """[M] hashes of rows, 0 to 1.

    Not multiples of the golden ratio: neighbors on a Fibonacci lattice would get almost equal numbers.
    """
    return uniform(ids.astype(np.uint64) + np.uint64(seed) * np.uint64(2**32) + np.uint64(GOLDEN))
