"""Points in space -> their order along the Morton curve: neighbours on the curve are near in space."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.native import core as _core
from brushgs.threads import num_threads_or_default

BITS = 21  # per axis: three fill 63 bits


def morton_order(points: NDArray[np.floating[Any]]) -> NDArray[np.intp]:
    """Rows of points [N, 3] sorted by Morton code, ties by row.

    All axes are quantised to the same 2^21 steps over the largest extent.
    """
    low = points.min(axis=0).astype(np.float64)
    extent = float((points.max(axis=0) - low).max())
    step = (2**BITS - 1) / extent if extent > 0 else 0.0
    contiguous = np.ascontiguousarray(points)
    return np.asarray(_core.morton_order(contiguous, low, step, num_threads_or_default(None)))
