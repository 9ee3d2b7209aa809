"""Visibility of lines in films: along each curve as a whole, not pixel by pixel.

The surface that a line lies on is made of strokes, whose depth in a picture varies by more than the width of
a line. So single pieces of a curve would come and go from frame to frame. Here a piece shows as much as its
neighborhood along the curve.
"""

from dataclasses import replace

import numpy as np

from brushgs.rendering.depth_test import DepthTest
from brushgs.values.along import Along
from brushgs.values.arrays import F64, Rows, smoothstep
from brushgs.values.boxes import Boxes

REACH = 3  # pieces to each side over which visibility is averaged, twice
PLACES = (-0.7, 0.0, 0.7)  # of a piece, in half lengths, where it is tested
HIDDEN, SHOWN = 0.25, 0.6  # visible share up to which a piece is hidden, and from which it is whole
DEEPER = 3.0  # factor on the tolerance of whole pieces: they are not cut by a stroke in front of them


def along_lines(boxes: Boxes, test: DepthTest, chains: Rows) -> tuple[Boxes, DepthTest]:
    """Fade pieces of lines by the visible share of their neighborhood, and test the rest with more tolerance.

    Args:
        boxes: M pieces.
        test: the limit of the picture, and the tolerances of the boxes.
        chains: [N] line of each id, ascending.
    """
    if not len(boxes):
        return boxes, test
    order = np.argsort(boxes.ids)
    along = Along.of(chains[boxes.ids[order]])
    shares = along.mean(along.mean(_shares(boxes, test)[order], REACH), REACH)
    whole = np.empty(len(boxes))
    whole[order] = smoothstep((shares - HIDDEN) / (SHOWN - HIDDEN))
    opacities = (boxes.opacities * whole).astype(boxes.opacities.dtype)
    tolerance = test.tolerance * (1 + (DEEPER - 1) * whole)
    return replace(boxes, opacities=opacities), replace(test, tolerance=tolerance)


def _shares(boxes: Boxes, test: DepthTest) -> F64:
    """[M] visible share of each box: where the farthest surface within a pixel hides it."""
    height, width = test.limit.shape
    angles, tolerance = boxes.angles.astype(np.float64), np.maximum(test.tolerance, 1e-12)
    axes = boxes.half_extents[:, :1] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    total = np.zeros(len(boxes))
    for place in PLACES:
        columns, rows = np.floor(boxes.centers + place * axes).astype(np.intp).T
        farthest = np.full(len(boxes), -np.inf)
        for down in (-1, 0, 1):
            for right in (-1, 0, 1):
                at = np.clip(rows + down, 0, height - 1), np.clip(columns + right, 0, width - 1)
                farthest = np.maximum(farthest, test.limit[at])
        total += smoothstep((farthest - boxes.depths + tolerance) / (0.5 * tolerance))
    return total / len(PLACES)
