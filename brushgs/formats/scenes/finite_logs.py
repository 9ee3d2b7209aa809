"""Logs and logits for files: finite values in place of infinite ones, that decode to exactly 0 and 1."""

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Array

# exp(-104) is 0 in float32 and 1 / (1 + exp(-+104)) is 1 or 0: finite values in place of infinite logs.
_INFINITE_LOG = 104.0
_LARGEST_LOG = 88.722  # just below the log of the largest float32, so that exp of it is finite


def logs_of(values: Array) -> NDArray[np.float64]:
    """Natural logarithms of values >= 0."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(values, dtype=np.float64), -_INFINITE_LOG, _LARGEST_LOG))


def logits_of(values: Array) -> NDArray[np.float64]:
    """log(p / (1 - p)) of values of 0 to 1."""
    wide = values.astype(np.float64)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(np.log(wide) - np.log1p(-wide), -_INFINITE_LOG, _INFINITE_LOG))


def finite_scales(scales: Array) -> NDArray[np.float32]:
    """Scales as float32 whose logarithms are finite, or zero: for formats that store them as they are."""
    return np.minimum(scales, np.exp(_LARGEST_LOG)).astype(np.float32)


def unit_quats(quats: Array) -> NDArray[np.float64]:
    """Quaternions of length 1, also of lengths whose squares vanish or overflow."""
    wide = quats.astype(np.float64)
    wide /= np.abs(wide).max(axis=1, keepdims=True)
    return np.asarray(wide / np.linalg.norm(wide, axis=1, keepdims=True))
