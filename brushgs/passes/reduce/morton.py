"""Points in space -> their order along the Morton curve: neighbors on the curve are near in space."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default

# Shifts and masks that move the 21 bits of a number to every third position.
_INTERLEAVE = (
    (32, 0x1F00000000FFFF),
    (16, 0x1F0000FF0000FF),
    (8, 0x100F00F00F00F00F),
    (4, 0x10C30C30C30C30C3),
    (2, 0x1249249249249249),
)


def morton_order(points: NDArray[np.floating[Any]]) -> NDArray[np.intp]:
    """Rows of points [N, 3] sorted by Morton code, ties by row.

    All axes are quantized to the same 2^21 steps over the largest extent: three of 21 bits fill 63.
    """
    return np.asarray(_core.morton_order(np.ascontiguousarray(points), num_threads_or_default(None)))


def interleave(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """The lowest 21 bits of each number [N], moved to every third position."""
    for shift, mask in _INTERLEAVE:
        values = (values | (values << np.uint64(shift))) & np.uint64(mask)
    return values
