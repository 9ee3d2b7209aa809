"""The loss of a painted picture to its target, by absolute difference and structural similarity.

The gradient is computed along with the value, in closed form, band of rows by band: bands can run in
threads, and neither number nor gradient depends on how many there are. A window of SSIM is clipped at the
borders of the picture, and its weights sum to 1.

Source: Kerbl et al. 2023, eq. 7 (L1 and D-SSIM); Wang et al. 2004, Image Quality Assessment (SSIM).
"""

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cache
from typing import Any

import torch
from torch import Tensor
from torch.autograd.function import once_differentiable
from torch.nn.functional import conv2d, conv_transpose2d, pad

DSSIM_SHARE = 0.2  # of the loss, the rest is L1: the loss that scenes are trained with
SIGMA, REACH = 1.5, 5  # standard deviation and half size of the window of SSIM, pixels
STRIDE = 2  # pixels between windows: with 1 the loss takes four times as long and falls alike
BAND = 72  # windows down a band: two bands in a picture of 288 rows; four of 36 take a fifth more in all
_C1, _C2 = 0.01**2, 0.03**2


def photometric(painted: Tensor, target: Tensor, executor: Executor | None = None) -> Tensor:
    """0.8 x mean |difference| + 0.2 x (1 - SSIM) / 2 of pictures [H, W, C], a number.

    Values lie in 0 to 1, and all channels count alike. Only `painted` gets a gradient; `executor` has the
    threads that bands run in, None runs them here.
    """
    loss: Tensor = _Photometric.apply(painted, target, DSSIM_SHARE, executor)
    return loss


def ssim(first: Tensor, second: Tensor) -> Tensor:
    """Mean structural similarity of pictures [H, W, C], a window at every second pixel; 1 if equal.

    Only `first` gets a gradient. Products with band matrices and torch's own gradient take three times as
    long.
    """
    dissimilarity: Tensor = _Photometric.apply(first, second, 1.0, None)
    return 1 - 2 * dissimilarity


class _Photometric(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(ctx: Any, painted: Tensor, target: Tensor, share: float, executor: Executor | None) -> Tensor:
        painted, target = painted.detach().contiguous(), target.contiguous()
        num_windows = -(-painted.shape[0] // STRIDE)
        starts = range(0, num_windows, BAND)

        def band(start: int) -> _Band:
            return _band(painted, target, range(start, min(start + BAND, num_windows)), share)

        bands: Iterable[_Band] = map(band, starts) if executor is None else executor.map(band, starts)
        gradient, loss = torch.zeros_like(painted), 0.0
        for part in bands:  # in order: sums of floats depend on it
            gradient[part.rows] += part.gradient
            loss += part.loss
        ctx.save_for_backward(gradient)
        return painted.new_tensor(loss)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, v_loss: Tensor) -> tuple[Tensor | None, ...]:
        (gradient,) = ctx.saved_tensors
        return v_loss * gradient, None, None, None


@dataclass(frozen=True, eq=False)
class _Band:
    """What a band of windows adds to the loss.

    Attributes:
        loss: its part.
        rows: of the picture that its windows see.
        gradient: [n, W, C] by these rows.
    """

    loss: float
    rows: slice
    gradient: Tensor


def _band(painted: Tensor, target: Tensor, windows: range, share: float) -> _Band:
    height, width, channels = painted.shape
    top, bottom = STRIDE * windows[0] - REACH, STRIDE * windows[-1] + REACH + 1
    rows = slice(max(top, 0), min(bottom, height))
    above, below = rows.start - top, bottom - rows.stop
    weights = _factors(height, width, channels, painted.dtype)
    num, factor = weights.numel(), weights[windows.start : windows.stop]

    def means(picture: Tensor) -> Tensor:
        """[n, w, C] weighted means in the windows."""
        return _in_windows(picture, above, below).mul_(factor)

    # In place and fused where it can be: new planes cost as much as what is computed in them.
    a, b = painted[rows], target[rows]
    mean_a, mean_b = means(a), means(b)
    product, squares = mean_a * mean_b, (mean_a * mean_a).addcmul_(mean_b, mean_b)
    by_variances = means((a * a).addcmul_(b, b)).sub_(squares).add_(_C2).reciprocal_()
    by_squares = squares.add_(_C1).reciprocal_()
    structure = means(a * b).sub_(product).mul_(2).add_(_C2).mul_(by_variances)
    luminance = product.mul_(2).add_(_C1).mul_(by_squares)
    similarity = structure * luminance

    # Derivatives by the means of a b, of a^2 + b^2, and of a, whose part through the variances comes last.
    by_ab = (luminance * by_variances).mul_(2)
    by_aabb = by_variances.mul_(similarity).neg_()
    by_a = torch.addcmul(mean_b, mean_a, luminance, value=-1).mul_(structure).mul_(by_squares).mul_(2)
    by_a.addcmul_(mean_a, by_aabb, value=-2).addcmul_(mean_b, by_ab, value=-1)
    by_similarity = factor * (-0.5 * share / num)

    def by_pixels(by_means: Tensor) -> Tensor:
        """Derivatives by the pixels of a picture, of those by its weighted means."""
        return _from_windows(by_means.mul_(by_similarity), above, below, width)

    gradient = by_pixels(by_a).addcmul_(a, by_pixels(by_aabb), value=2).addcmul_(b, by_pixels(by_ab))
    own = slice(STRIDE * windows.start - rows.start, min(STRIDE * windows.stop, height) - rows.start)
    away = a[own] - b[own]
    loss = (1 - share) * float(torch.linalg.vector_norm(away, 1)) / painted.numel()
    loss += 0.5 * share * (similarity.numel() - float(similarity.sum())) / num
    gradient[own].add_(away.sign_(), alpha=(1 - share) / painted.numel())
    return _Band(loss, rows, gradient)


def _in_windows(picture: Tensor, above: int, below: int) -> Tensor:
    """[n, w, C] weighted sums in the windows of a picture [H, W, C] with so many rows of zeros around it."""
    down, across = _kernels(picture.shape[2], picture.dtype)
    channels = picture.shape[2]
    sums = conv2d(_channels_last(picture), across, stride=(1, STRIDE), padding=(0, REACH), groups=channels)
    sums = conv2d(pad(sums, (0, 0, above, below)), down, stride=(STRIDE, 1), groups=channels)
    return sums[0].permute(1, 2, 0)


def _from_windows(sums: Tensor, above: int, below: int, width: int) -> Tensor:
    """The transpose of `_in_windows`: [H, W, C]."""
    down, across = _kernels(sums.shape[2], sums.dtype)
    channels, rest = sums.shape[2], (width - 1) % STRIDE  # pixels after the centre of the last window
    spread = conv_transpose2d(_channels_last(sums), down, stride=(STRIDE, 1), groups=channels)
    spread = spread[:, :, above : spread.shape[2] - below]
    picture = conv_transpose2d(
        spread,
        across,
        stride=(1, STRIDE),
        padding=(0, REACH),
        output_padding=(0, rest),
        groups=channels,
    )
    return picture[0].permute(1, 2, 0)


def _channels_last(picture: Tensor) -> Tensor:
    """[1, C, H, W] of [H, W, C], in the same memory: the layout that depthwise convolution is fastest in."""
    return picture[None].permute(0, 3, 1, 2)


@cache
def _window(dtype: torch.dtype) -> Tensor:
    """[2 REACH + 1] weights of a window along an axis; they sum to 1."""
    away = torch.arange(-REACH, REACH + 1, dtype=torch.float64)
    weights = torch.exp(-0.5 * (away / SIGMA) ** 2)
    return (weights / weights.sum()).to(dtype)


@cache
def _kernels(channels: int, dtype: torch.dtype) -> tuple[Tensor, Tensor]:
    """The window down and across, as depthwise convolutions take it, for each channel."""
    window = _window(dtype).repeat(channels, 1, 1, 1)
    return window.transpose(2, 3).contiguous(), window


@cache
def _factors(height: int, width: int, channels: int, dtype: torch.dtype) -> Tensor:
    """[h, w, C] what makes weighted sums means: 1 over the weights of each window that lie in the picture.

    Written out for each channel: products with one number for four channels take five times as long.
    """

    def weights(size: int) -> Tensor:
        places = torch.arange(0, size, STRIDE)[:, None] + torch.arange(-REACH, REACH + 1)
        return (_window(torch.float64) * ((places >= 0) & (places < size))).sum(dim=1)

    factors = 1 / (weights(height)[:, None, None] * weights(width)[:, None])
    return factors.to(dtype).repeat(1, 1, channels)
