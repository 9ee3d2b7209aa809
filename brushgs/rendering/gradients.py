"""Gradients of a loss by the columns of `Boxes` and `Gaussians`, on NumPy arrays.

A column that is None is zero for boxes, which come in, and not asked for with Gaussians, which go out.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array

GAUSSIAN_COLUMNS = ("means", "quats", "scales", "opacities", "sh")
BOX_COLUMNS = ("centers", "half_extents", "angles", "depths", "colors", "opacities")


@dataclass(frozen=True, eq=False)
class BoxGradients:
    """By the boxes, in their dtype, and by the coverage of the texture, 0 to 1, in float64."""

    centers: Array | None = None  # [M, 2]
    half_extents: Array | None = None  # [M, 2]
    angles: Array | None = None  # [M]
    depths: Array | None = None  # [M]
    colors: Array | None = None  # [M, 3]
    opacities: Array | None = None  # [M]
    coverage: NDArray[np.float64] | None = None  # [h, w]


@dataclass(frozen=True, eq=False)
class GaussianGradients:
    """By the Gaussians, in their dtype."""

    means: Array | None = None  # [N, 3]
    quats: Array | None = None  # [N, 4]
    scales: Array | None = None  # [N, 3]
    opacities: Array | None = None  # [N]
    sh: Array | None = None  # [N, k, 3]
