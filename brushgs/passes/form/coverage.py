"""Strokes and their nearest neighbors, as the compiled core takes them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.finest import finest_of
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

NUM_NEIGHBORS = 16  # per stroke


def shape_arguments(gaussians: Gaussians) -> dict[str, Any]:
    """The columns that say where the paint is, and the number of threads, for functions of the core."""
    columns = ("means", "quats", "scales", "opacities")
    arrays = {name: np.ascontiguousarray(getattr(gaussians, name)) for name in columns}
    return {**arrays, "num_threads": num_threads_or_default(None)}


def stroke_arguments(strokes: Gaussians) -> dict[str, Any]:
    """The same with the finest line in pictures: `StrokeQuery` of the core."""
    return {**shape_arguments(strokes), "finest": finest_of(strokes)}


def nearest_others(means: F64, count: int) -> NDArray[np.int32]:
    """Rows [k, n] of the nearest neighbors of each of k points, n = `count`, or k - 1 if that is less."""
    neighbors = np.empty((len(means), max(0, min(count, len(means) - 1))), dtype=np.int32)
    if neighbors.size:
        _core.neighbors(means, neighbors, num_threads_or_default(None))
    return neighbors
