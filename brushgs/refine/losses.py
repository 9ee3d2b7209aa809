"""Losses of painted pictures and of strokes, in torch, all differentiable.

Source: Kerbl et al. 2023, eq. 7 (L1 and D-SSIM); Wang et al. 2004, Image Quality Assessment (SSIM).
"""

from functools import cache

import torch
from torch import Tensor

DSSIM_SHARE = 0.2  # of the loss, the rest is L1: the loss that scenes are trained with
SIGMA, REACH = 1.5, 5  # standard deviation and half size of the window of SSIM, pixels
STRIDE = 2  # pixels between windows: with 1 the loss takes four times as long and falls alike
_C1, _C2 = 0.01**2, 0.03**2


def photometric(painted: Tensor, target: Tensor) -> Tensor:
    """0.8 x mean |difference| + 0.2 x (1 - SSIM) / 2 of pictures [H, W, C], a number.

    Values lie in 0 to 1, and all channels count alike.
    """
    absolute = (painted - target).abs().mean()
    return (1 - DSSIM_SHARE) * absolute + DSSIM_SHARE * 0.5 * (1 - ssim(painted, target))


def ssim(first: Tensor, second: Tensor) -> Tensor:
    """Mean structural similarity of pictures [H, W, C], a window at every second pixel; 1 if equal.

    The Gaussian window is separable, so that filtering is two products with band matrices. Convolution with a
    window at every pixel, `kornia.metrics.ssim`, takes 1.9 to 2.8 times as long.
    """
    height, width, _ = first.shape
    rows, columns = (_window_weights(size, first.dtype) for size in (height, width))
    a, b = first.permute(2, 0, 1), second.permute(2, 0, 1)
    maps = rows @ torch.stack([a, b, a * a, b * b, a * b]) @ columns.T
    mean_a, mean_b, aa, bb, ab = maps
    variance_a, variance_b = aa - mean_a**2, bb - mean_b**2
    covariance = ab - mean_a * mean_b
    structure = (2 * covariance + _C2) / (variance_a + variance_b + _C2)
    luminance = (2 * mean_a * mean_b + _C1) / (mean_a**2 + mean_b**2 + _C1)
    return (structure * luminance).mean()


@cache
def _window_weights(size: int, dtype: torch.dtype) -> Tensor:
    """[n, size] weights of the windows along an axis, clipped at the borders; each row sums to 1."""
    centers = torch.arange(0, size, STRIDE, dtype=torch.float64)
    away = torch.arange(size, dtype=torch.float64) - centers[:, None]
    weights = torch.exp(-0.5 * (away / SIGMA) ** 2) * (away.abs() <= REACH)
    return (weights / weights.sum(dim=1, keepdim=True)).to(dtype)


def roundness(scales: Tensor, free_aspect: float) -> Tensor:
    """Mean squared excess of log(longest / middle scale) over log(free_aspect), for scales [N, 3]."""
    ordered = scales.sort(dim=1).values
    aspect = torch.log(ordered[:, 2].clamp_min(1e-30)) - torch.log(ordered[:, 1].clamp_min(1e-30))
    return torch.relu(aspect - torch.log(torch.tensor(free_aspect, dtype=scales.dtype))).square().mean()


def total_variation(picture: Tensor) -> Tensor:
    """Mean absolute difference between neighbours of a picture [H, W, C], down plus across.

    `kornia.losses.total_variation` takes 1.4 to 1.5 times as long.
    """
    return (picture[1:] - picture[:-1]).abs().mean() + (picture[:, 1:] - picture[:, :-1]).abs().mean()


def color_distance(rgb: Tensor, weights: Tensor, mean: Tensor, covariance: Tensor) -> Tensor:
    """Squared distance of mean and covariance of weighted colours from target values, a number.

    Args:
        rgb: [H, W, 3] premultiplied by the weights.
        weights: [H, W] alpha; where it is zero there is no colour.
        mean: [3] target.
        covariance: [3, 3] target.
    """
    total = weights.sum() + 1e-9
    own_mean = rgb.sum(dim=(0, 1)) / total
    away = (rgb / weights.clamp_min(1e-3)[..., None] - own_mean) * weights.sqrt()[..., None]
    own_covariance = torch.einsum("hwi,hwj->ij", away, away) / total
    return (own_mean - mean).square().sum() + (own_covariance - covariance).square().sum()
