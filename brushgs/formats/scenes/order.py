"""The order of rows in files that are packed: neighbours in space beside each other."""

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.scenes.rounding import fractions_of, rounded
from brushgs.values.gaussians import Gaussians

_BITS = 21  # of each axis: three of them fill 63 bits


def spatial_order(gaussians: Gaussians) -> NDArray[np.int64]:
    """[N] rows along a Morton curve; where strokes have brushes, those of each brush by themselves.

    Far centres make no room for the others: places count in the logarithm of the distance from the middle.
    """
    means = gaussians.means.astype(np.float64)
    middle, spread = np.median(means, axis=0), np.ptp(np.percentile(means, (5, 95), axis=0), axis=0).max()
    logs = np.arcsinh((means - middle) / (spread or 1.0))
    places = rounded(fractions_of(logs, logs.min(axis=0), logs.max(axis=0)) * (2**_BITS - 1), 2**_BITS - 1)
    x, y, z = (_spread_bits(places[:, axis].astype(np.uint64)) for axis in range(3))
    codes = x | y << np.uint64(1) | z << np.uint64(2)
    return np.lexsort((codes,) if gaussians.brushes is None else (codes, gaussians.brushes))


def brush_order(gaussians: Gaussians) -> NDArray[np.int64] | None:
    """[N] rows in the order of their brushes, else as they are; None if that is their order."""
    return None if gaussians.brushes is None else np.argsort(gaussians.brushes, kind="stable")


def _spread_bits(values: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Two zero bits before each of 21 bits."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        values = (values | values << np.uint64(shift)) & np.uint64(mask)
    return values
