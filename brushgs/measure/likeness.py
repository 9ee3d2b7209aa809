"""Similarity of two pictures of one view: RMSE, PSNR, SSIM, FLIP, and missing paint.

Pictures are [H, W, 3], display-encoded, 0 to 1, on their background. Each function defines its number, so
that figures of this project can be compared with those of others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64, Array, check

SSIM_SIGMA = 1.5  # pixels, standard deviation of the Gaussian window of SSIM, as published
SSIM_SIDE = 11  # pixels, side of that window: smaller pictures have no SSIM
SSIM_STABILIZERS = 0.01**2, 0.03**2  # of values 0 to 1, as published


@dataclass(frozen=True)
class Likeness:
    """The similarity of two pictures on the same background.

    Attributes:
        rmse: root of the mean squared difference over pixels and channels, 0 to 1.
        largest: the largest difference of any channel of any pixel, 0 to 1.
        psnr: see `psnr`; None if the pictures are equal.
        ssim: see `ssim`; None if not requested, or if the picture is too small.
        flip: see `flip`; None if not requested.
    """

    rmse: float
    largest: float
    psnr: float | None
    ssim: float | None = None
    flip: float | None = None


def compare(picture: Array, truth: Array, *, wants_all: bool = False) -> Likeness:
    """Compare a picture with the truth; `wants_all` adds SSIM and FLIP, which take longer."""
    error, decibels = rmse(picture, truth), psnr(picture, truth)
    largest = float(np.abs(np.subtract(picture, truth, dtype=np.float64)).max())
    has_ssim = wants_all and min(picture.shape[:2]) >= SSIM_SIDE
    return Likeness(
        error,
        largest,
        decibels if np.isfinite(decibels) else None,
        ssim(picture, truth) if has_ssim else None,
        flip(picture, truth) if wants_all else None,
    )


def rmse(picture: Array, truth: Array) -> float:
    """Root of the mean squared difference of two equal-shaped arrays."""
    return float(np.sqrt(_mean_square("rmse", picture, truth)))


def psnr(picture: Array, truth: Array) -> float:
    """Peak signal to noise ratio in dB of two equal-shaped arrays of values 0 to 1; infinity if equal."""
    mean = _mean_square("psnr", picture, truth)
    return float(-10 * np.log10(mean)) if mean > 0 else float("inf")


def ssim(picture: Array, truth: Array) -> float:
    """Structural similarity: 1 for equal pictures, about 0 for unrelated ones; mean over the channels.

    Window (a Gaussian of 1.5 pixels) and constants are those of the paper; values 0 to 1.
    Source: Wang et al. 2004, Image Quality Assessment: From Error Visibility to Structural Similarity.

    Raises:
        ValueError: if a side is below 11 pixels, or a shape is not [H, W, 3].
    """
    height, width = _check_pictures("ssim", picture, truth)
    if min(height, width) < SSIM_SIDE:
        raise ValueError(f"ssim: both sides must be at least {SSIM_SIDE} pixels, got {width}x{height}")
    first, second = (np.moveaxis(p.astype(np.float64), -1, 0) for p in (picture, truth))
    return float(np.mean([_ssim(a, b) for a, b in zip(first, second, strict=True)]))


def _ssim(picture: F64, truth: F64) -> float:
    """The same for one channel [H, W], the mean over positions with the whole window in the picture."""
    from scipy.ndimage import gaussian_filter

    radius = SSIM_SIDE // 2

    def mean(values: F64) -> F64:
        return np.asarray(gaussian_filter(values, SSIM_SIGMA, radius=radius))

    mean_a, mean_b = mean(picture), mean(truth)
    variances = (mean(picture * picture) - mean_a * mean_a) + (mean(truth * truth) - mean_b * mean_b)
    covariance = mean(picture * truth) - mean_a * mean_b
    light, contrast = SSIM_STABILIZERS
    likeness = (2 * mean_a * mean_b + light) * (2 * covariance + contrast)
    likeness /= (mean_a**2 + mean_b**2 + light) * (variances + contrast)
    return float(likeness[radius:-radius, radius:-radius].mean())


def flip(picture: Array, truth: Array) -> float:
    """The visible difference when flipping between two pictures: 0 none, 1 black against white.

    The mean of the LDR-FLIP map, at a distance of 0.7 m from a display of 0.7 m and 3840 pixels width.
    Source: Andersson et al. 2020, FLIP: A Difference Evaluator for Alternating Images; in OpenImageIO.

    Raises:
        ValueError: if a shape is not [H, W, 3].
    """
    import OpenImageIO as oiio  # noqa: N813

    _check_pictures("flip", picture, truth)
    first, second = (
        oiio.ImageBuf(np.ascontiguousarray(np.clip(p, 0, 1), dtype=np.float32)) for p in (truth, picture)
    )
    difference = oiio.ImageBufAlgo.FLIP_diff(first, second, hdr=0)  # the default, 1, is for unbounded values
    return float(np.asarray(difference.get_pixels(oiio.FLOAT)).mean(dtype=np.float64))


def unpainted(alpha: Array, plain_alpha: Array) -> float:
    """Share of the plain picture's alpha that a painting leaves unpainted, 0 to 1; 0 if it has no alpha."""
    return _beyond(plain_alpha, alpha) / _total(plain_alpha)


def _beyond(more: Array, less: Array) -> float:
    check("likeness", alpha=(more, "H W"), plain_alpha=(less, "H W"))
    return float(np.maximum(more - less, 0).sum(dtype=np.float64))


def _total(alpha: Array) -> float:
    return float(alpha.sum(dtype=np.float64)) or 1.0


def _mean_square(where: str, picture: Array, truth: Array) -> float:
    if picture.shape != truth.shape:
        raise ValueError(f"{where}: shapes must agree, got {list(picture.shape)} and {list(truth.shape)}")
    difference: NDArray[np.float64] = np.subtract(picture, truth, dtype=np.float64)
    return float(np.mean(np.square(difference)))


def _check_pictures(where: str, picture: Array, truth: Array) -> tuple[int, int]:
    sizes = check(where, picture=(picture, "H W 3"), truth=(truth, "H W 3"))
    return sizes["H"], sizes["W"]
