"""How far a painting is from what it should look like, in torch: all of these have gradients.

Source: Kerbl et al. 2023, eq. 7 (L1 and D-SSIM); Wang et al. 2004, Image Quality Assessment (SSIM).
"""

from functools import cache

import torch
from torch import Tensor

DSSIM_SHARE = 0.2  # of the loss, the rest is L1, as scenes are trained
SIGMA, REACH = 1.5, 5  # of the window of SSIM, pixels
STRIDE = 2  # pixels between windows: with every one the loss takes four times longer and falls alike
_C1, _C2 = 0.01**2, 0.03**2


def photometric(painted: Tensor, wanted: Tensor) -> Tensor:
    """0.8 x mean |difference| + 0.2 x (1 - SSIM) / 2 of pictures [H, W, C], a number.

    The pictures have values of 0 to 1; whatever channels they have count alike.
    """
    absolute = (painted - wanted).abs().mean()
    return (1 - DSSIM_SHARE) * absolute + DSSIM_SHARE * 0.5 * (1 - ssim(painted, wanted))


def ssim(first: Tensor, second: Tensor) -> Tensor:
    """Mean structural similarity of pictures [H, W, C], a window at every second pixel; 1 if equal.

    A Gaussian window is a product of two bands, so that blurring is two matrix products: on a CPU these take
    a tenth of the time of convolutions.
    """
    height, width, _ = first.shape
    rows, columns = (_band(size, first.dtype) for size in (height, width))
    a, b = first.permute(2, 0, 1), second.permute(2, 0, 1)
    maps = rows @ torch.stack([a, b, a * a, b * b, a * b]) @ columns.T
    mean_a, mean_b, aa, bb, ab = maps
    variance_a, variance_b = aa - mean_a**2, bb - mean_b**2
    covariance = ab - mean_a * mean_b
    structure = (2 * covariance + _C2) / (variance_a + variance_b + _C2)
    luminance = (2 * mean_a * mean_b + _C1) / (mean_a**2 + mean_b**2 + _C1)
    return (structure * luminance).mean()


@cache
def _band(size: int, dtype: torch.dtype) -> Tensor:
    """[n, size] weights of the windows along an axis; cut off at the rim, each row sums to 1."""
    centers = torch.arange(0, size, STRIDE, dtype=torch.float64)
    away = torch.arange(size, dtype=torch.float64) - centers[:, None]
    weights = torch.exp(-0.5 * (away / SIGMA) ** 2) * (away.abs() <= REACH)
    return (weights / weights.sum(dim=1, keepdim=True)).to(dtype)


def roundness(scales: Tensor, most: float) -> Tensor:
    """Mean squared excess of log(longest / middle scale) over log(most), for scales [N, 3]."""
    ordered = scales.sort(dim=1).values
    aspect = torch.log(ordered[:, 2].clamp_min(1e-30)) - torch.log(ordered[:, 1].clamp_min(1e-30))
    return torch.relu(aspect - torch.log(torch.tensor(most, dtype=scales.dtype))).square().mean()


def total_variation(picture: Tensor) -> Tensor:
    """Mean absolute difference between neighbours of a picture [H, W, C], down and across."""
    return (picture[1:] - picture[:-1]).abs().mean() + (picture[:, 1:] - picture[:, :-1]).abs().mean()


def color_distance(rgb: Tensor, weights: Tensor, mean: Tensor, covariance: Tensor) -> Tensor:
    """Squared distance of mean and covariance of weighted colours from wanted ones, a number.

    Args:
        rgb: [H, W, 3] premultiplied by the weights.
        weights: [H, W] alpha; where it is zero there is no colour.
        mean: [3] wanted.
        covariance: [3, 3] wanted.
    """
    total = weights.sum() + 1e-9
    own = rgb.sum(dim=(0, 1)) / total
    away = (rgb / weights.clamp_min(1e-3)[..., None] - own) * weights.sqrt()[..., None]
    spread = torch.einsum("hwi,hwj->ij", away, away) / total
    return (own - mean).square().sum() + (spread - covariance).square().sum()
