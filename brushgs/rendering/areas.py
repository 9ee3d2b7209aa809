"""Area of each box within the picture: the weight of a stroke in measurements and for the stroke count."""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64
from brushgs.values.boxes import Boxes

TINY = np.finfo(np.float64).tiny  # replaces lengths of zero


def seen_areas(boxes: Boxes, width: int, height: int) -> NDArray[np.float64]:
    """[M] area of each box within the picture, pixels: its area x the share of its bounding rectangle inside,
    at most the area of the picture.
    """
    extents = np.maximum(boxes.half_extents.astype(np.float64), TINY)
    low, high = upright_rectangles(boxes.centers.astype(np.float64), extents, boxes.angles.astype(np.float64))
    return areas_inside(extents, low, high, width, height)


def upright_rectangles(centers: F64, extents: F64, angles: F64) -> tuple[F64, F64]:
    """Low and high corners [M, 2] of the axis-aligned bounding rectangles of boxes."""
    c, s = np.abs(np.cos(angles)), np.abs(np.sin(angles))
    upright = np.stack([c * extents[:, 0] + s * extents[:, 1], s * extents[:, 0] + c * extents[:, 1]], 1)
    return centers - upright, centers + upright


def areas_inside(extents: F64, low: F64, high: F64, width: int, height: int) -> F64:
    """`seen_areas` from half extents [M, 2] and bounding rectangles `low`, `high` [M, 2]."""
    size = np.array([width, height], np.float64)
    seen = np.clip(np.minimum(high, size) - np.maximum(low, 0), 0, None)
    areas = 4 * extents.prod(axis=1) * (seen / (high - low)).prod(axis=1)
    return np.asarray(np.minimum(areas, width * height))
