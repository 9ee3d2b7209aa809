"""The thresholds of blending, as the scenes were trained with them (Kerbl et al. 2023), and the filters.

The core holds the same numbers in core/include/brushgs/raster.hpp; a test keeps them equal.
"""

from typing import Literal

MAX_ALPHA = 0.99  # no stroke is quite opaque
MIN_ALPHA = 1 / 255  # fainter fragments are skipped
# A pixel is finished before its transmittance falls under 1e-4. Two strokes of full paint leave exactly that
# (0.01 x 0.01), so the bound stands a hair below: rounding must not decide about them.
MIN_TRANSMITTANCE = 1e-4 * (1 - 1e-5)
GAUSSIAN_SIGMAS = 3.0  # the built-in Gaussian fills its box at this many standard deviations

Filter = Literal["bilinear", "mip", "nearest"]
FILTERS: tuple[Filter, ...] = ("bilinear", "mip", "nearest")
