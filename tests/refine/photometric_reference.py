"""The loss of a painted picture from its definition, by matrices in float64; its gradient is torch's own."""

import torch
from torch import Tensor


def similarity(first: Tensor, second: Tensor) -> Tensor:
    """[h, w, C] SSIM of pictures [H, W, C], of a window around every second pixel."""
    down, across = windows(first.shape[0]), windows(first.shape[1])

    def means(picture: Tensor) -> Tensor:
        return torch.einsum("ih,hwc,jw->ijc", down, picture, across)

    mean_a, mean_b = means(first), means(second)
    variance_a, variance_b = means(first**2) - mean_a**2, means(second**2) - mean_b**2
    covariance = means(first * second) - mean_a * mean_b
    luminance = (2 * mean_a * mean_b + 0.01**2) / (mean_a**2 + mean_b**2 + 0.01**2)
    return luminance * (2 * covariance + 0.03**2) / (variance_a + variance_b + 0.03**2)


def windows(size: int) -> Tensor:
    """[h, H] the weights of H pixels along an axis in h windows; of each they sum to 1."""
    away = torch.arange(size) - torch.arange(0, size, 2)[:, None]
    weights = torch.exp(-0.5 * (away.double() / 1.5) ** 2) * (away.abs() <= 5)
    return weights / weights.sum(dim=1, keepdim=True)


def photometric(painted: Tensor, target: Tensor) -> Tensor:
    """0.8 x mean |difference| + 0.2 x (1 - SSIM) / 2."""
    return 0.8 * (painted - target).abs().mean() + 0.1 * (1 - similarity(painted, target).mean())
