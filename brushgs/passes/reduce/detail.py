"""Variation of colour around each Gaussian: where it is large, a painting needs more strokes."""

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.reduce.features import contracted
from brushgs.passes.reduce.morton import morton_order
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

NEIGHBORS = 16  # Gaussians in a group; 8 and 64 cost up to 0.2 dB on the still life, and change others less


def color_detail(gaussians: Gaussians) -> NDArray[np.float64]:
    """Standard deviation of base colours among neighbours, [N], 0 to about 0.9.

    Neighbours are groups of 16 that follow each other on the Morton curve of the positions. In trained
    scenes nearly all values lie above 0.05; on surfaces of one colour they are below 0.01.

    Args:
        gaussians: N Gaussians.
    """
    num = len(gaussians)
    if num == 0:
        return np.zeros(0)
    order = morton_order(contracted(gaussians.means)[0])
    colors = base_colors(gaussians.sh)[order].astype(np.float64)
    firsts = np.arange(0, max(1, num - NEIGHBORS + 1), NEIGHBORS)  # the last group holds the rest too
    counts = np.diff(firsts, append=num)
    away = colors - np.repeat(np.add.reduceat(colors, firsts) / counts[:, None], counts, axis=0)
    squares = np.add.reduceat(np.einsum("nc,nc->n", away, away), firsts)
    detail = np.empty(num)
    detail[order] = np.repeat(np.sqrt(squares / counts), counts)
    return detail
