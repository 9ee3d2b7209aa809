"""Blending thresholds of the core, as used in training (Kerbl et al. 2023)."""

from brushgs.core.native import core as _core

MAX_ALPHA: float = _core.MAX_ALPHA  # 0.99: no stroke is quite opaque
MIN_ALPHA: float = _core.MIN_ALPHA  # 1/255: fainter fragments are skipped
MIN_TRANSMITTANCE: float = _core.MIN_TRANSMITTANCE  # just below 1e-4: less light finishes a pixel
LEAST_LIGHT: float = _core.LEAST_LIGHT  # 1e-31: in soft order, behind all fragments of a pixel
GAUSSIAN_SIGMAS: float = _core.GAUSSIAN_SIGMAS  # 3: half extent of the built-in Gaussian in deviations
