"""Boxes thin out toward the border of the picture, as a painter leaves the ground bare there.

The border belongs to the canvas and stays with the picture, so this is done to the boxes of each view. While
the camera moves, each box fades smoothly.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.hashing import GOLDEN, uniform

WIDTH = 0.13  # of the border, over the length of the smaller side of the picture
# At the very border a fifth of the boxes is left, and none whose centre lies 0.35 of the border beyond it.
LEFT_AT_BORDER, SPREAD, FADE = 0.35, 1.1, 0.25  # in widths of the border


def thin_to_border(boxes: Boxes, camera: Camera, *, width: float = WIDTH, seed: int = 0) -> Boxes:
    """Lower the opacity of boxes near the border of the picture: of some more, of others less.

    The opacity of a box is multiplied by (d / width + 0.35 - 1.1 r) / 0.25 clipped to 0 to 1, d being the
    distance of its centre from the nearest side of the picture, negative outside, over the length of the
    smaller side, and r a number from 0 to 1 that belongs to its row.

    Args:
        boxes: M boxes of one view.
        camera: the view; only its size is used.
        width: of the border, over the length of the smaller side, > 0. Boxes further inside stay as they are.
        seed: 0 to 2^32 - 1; with another one other boxes are left.

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
    """[M] numbers in 0 to 1 that belong to rows, as if at random.

    Not a multiple of the golden ratio, which gives neighbours on a Fibonacci lattice almost the same number.
    """
    return uniform(ids.astype(np.uint64) + np.uint64(seed) * np.uint64(2**32) + np.uint64(GOLDEN))
