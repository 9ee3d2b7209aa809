"""Which strokes lie in a region of the scene."""

import numpy as np
from numpy.typing import NDArray

from brushgs.options.region import Region
from brushgs.scene import Gaussians
from brushgs.sh import base_colors


def select_strokes(region: Region | None, gaussians: Gaussians) -> NDArray[np.bool_]:
    """[N] mask of the Gaussians in a region, by their means or by their base colour; all where it is None.

    Raises:
        ValueError: if there is none.
    """
    if region is None:
        return np.ones(len(gaussians), dtype=bool)
    numbers = np.array(region.numbers)
    if region.kind == "box":
        low, high = np.minimum(numbers[:3], numbers[3:]), np.maximum(numbers[:3], numbers[3:])
        inside = ((gaussians.means >= low) & (gaussians.means <= high)).all(axis=1)
    else:
        points = gaussians.means if region.kind == "sphere" else base_colors(gaussians.sh)
        inside = np.linalg.norm(points.astype(np.float64) - numbers[:3], axis=1) <= numbers[3]
    if not inside.any():
        raise ValueError("where: no stroke lies in it; `brushgs info` prints where the scene is")
    return np.asarray(inside)
