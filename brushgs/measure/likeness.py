"""How near a picture comes to another of the same view: RMSE, PSNR, SSIM, FLIP, and paint that is missing.

Pictures are [H, W, 3], display-encoded, 0 to 1, on their background; nothing here paints. What each number
means stands in its function, so that figures of this project can be set beside those of others.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array, check

SSIM_SIGMA = 1.5  # pixels, of the Gaussian window in which SSIM is taken, as published
SSIM_REACH = 11  # pixels that the window spans: smaller pictures have no SSIM


@dataclass(frozen=True)
class Likeness:
    """A picture against another, on one ground.

    Attributes:
        rmse: root of the mean squared difference over pixels and channels, 0 to 1.
        largest: difference of any channel of any pixel, 0 to 1.
        psnr: see `psnr`; None where the pictures are equal.
        ssim: see `ssim`; None if not asked for, or where the picture is too small for one.
        flip: see `flip`; None if not asked for.
    """

    rmse: float
    largest: float
    psnr: float | None
    ssim: float | None = None
    flip: float | None = None


def compare(picture: Array, truth: Array, *, wants_all: bool = False) -> Likeness:
    """Measure how near a picture comes to the truth; with SSIM and FLIP, which take longer, on request."""
    error, decibels = rmse(picture, truth), psnr(picture, truth)
    largest = float(np.abs(np.subtract(picture, truth, dtype=np.float64)).max())
    has_ssim = wants_all and min(picture.shape[:2]) >= SSIM_REACH
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

    With the window of the paper, a Gaussian of 1.5 pixels, and its constants; values 0 to 1.
    Source: Wang et al. 2004, Image Quality Assessment: From Error Visibility to Structural Similarity.

    Raises:
        ValueError: if a side is under 11 pixels, or the shapes are not [H, W, 3] both.
    """
    from skimage.metrics import structural_similarity

    height, width = _check_pictures("ssim", picture, truth)
    if min(height, width) < SSIM_REACH:
        raise ValueError(f"ssim: both sides must be at least {SSIM_REACH} pixels, got {width}x{height}")
    return float(
        structural_similarity(
            np.asarray(picture, np.float64),
            np.asarray(truth, np.float64),
            channel_axis=-1,
            data_range=1.0,
            gaussian_weights=True,
            sigma=SSIM_SIGMA,
            use_sample_covariance=False,
        )
    )


def flip(picture: Array, truth: Array) -> float:
    """What an observer sees who flips between two pictures on a display: 0 nothing, 1 black against white.

    The mean of the LDR-FLIP map, as seen from 0.7 m on a display 0.7 m and 3840 pixels wide.
    Source: Andersson et al. 2020, FLIP: A Difference Evaluator for Alternating Images; in OpenImageIO.

    Raises:
        ValueError: if the shapes are not [H, W, 3] both.
    """
    import OpenImageIO as oiio  # noqa: N813

    _check_pictures("flip", picture, truth)
    first, second = (
        oiio.ImageBuf(np.ascontiguousarray(np.clip(p, 0, 1), dtype=np.float32)) for p in (truth, picture)
    )
    difference = oiio.ImageBufAlgo.FLIP_diff(first, second, hdr=0)  # its default is for light without bounds
    return float(np.asarray(difference.get_pixels(oiio.FLOAT)).mean(dtype=np.float64))


def unpainted(alpha: Array, plain_alpha: Array) -> float:
    """Share of the plain picture's alpha that a painting leaves unpainted, 0 to 1; 0 where there is none."""
    return _beyond(plain_alpha, alpha) / _total(plain_alpha)


def spilt(alpha: Array, plain_alpha: Array) -> float:
    """Alpha that a painting has beyond the plain picture's, as a share of that, >= 0."""
    return _beyond(alpha, plain_alpha) / _total(plain_alpha)


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
