"""Numbers become whole ones of a few bits, which is how most formats store them."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def rounded(values: NDArray[Any], largest: int) -> NDArray[np.int64]:
    """The nearest whole numbers of 0 to `largest`; what lies beyond is clipped, halves go up."""
    return np.asarray(np.floor(np.clip(values, 0, largest) + 0.5)).astype(np.int64)


def fractions_of(values: NDArray[Any], low: NDArray[Any], high: NDArray[Any]) -> NDArray[np.float64]:
    """Where values lie between `low` (0) and `high` (1), in float64; 0 where these are equal."""
    extent = high.astype(np.float64) - low
    above = values - low.astype(np.float64)
    return np.asarray(np.divide(above, extent, out=np.zeros(above.shape), where=extent > 0))
