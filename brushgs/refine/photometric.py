"""The loss of a painted picture to its target, by absolute difference and structural similarity.

Value and gradient are computed together by the compiled core. SSIM windows are centered on every second pixel
in both directions (one per pixel gives similar fits), clipped at the borders, with weights that sum to 1.

Source: Kerbl et al. 2023, eq. 7 (L1 and D-SSIM); Wang et al. 2004, Image Quality Assessment (SSIM).
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from brushgs.core.native import core as _core

DSSIM_SHARE = 0.2  # of the loss, the rest is L1, as in training
SIGMA, REACH = 1.5, 5  # standard deviation and half size of the window of SSIM, pixels
_WINDOW = np.exp(-0.5 * (np.arange(-REACH, REACH + 1) / SIGMA) ** 2)
_WINDOW /= _WINDOW.sum()
_STABILIZERS = 0.01**2, 0.03**2


def photometric(painted: Tensor, target: Tensor, num_threads: int = 1) -> Tensor:
    """0.8 x mean |difference| + 0.2 x (1 - SSIM) / 2 of pictures [H, W, C], C = 1 or 3: a number.

    Values lie in 0 to 1, and all channels count alike. Only `painted` gets a gradient. The result does not
    depend on `num_threads`.

    Raises:
        ValueError: if the shapes are not equal, or there are other channels.
    """
    loss: Tensor = _Photometric.apply(painted, target, DSSIM_SHARE, num_threads)
    return loss


def ssim(first: Tensor, second: Tensor) -> Tensor:
    """Mean structural similarity of pictures [H, W, C], see `photometric`; 1 if they are equal.

    Only `first` gets a gradient. Raises the same.
    """
    dissimilarity: Tensor = _Photometric.apply(first, second, 1.0, 1)
    return 1 - 2 * dissimilarity


class _Photometric(torch.autograd.Function):  # type: ignore[misc]
    @staticmethod
    def forward(ctx: Any, painted: Tensor, target: Tensor, share: float, num_threads: int) -> Tensor:
        if painted.shape != target.shape:
            raise ValueError(
                f"photometric: target must have shape {list(painted.shape)} like the painted picture, "
                f"got {list(target.shape)}"
            )
        gradient = torch.empty_like(painted, memory_format=torch.contiguous_format)
        loss = _core.photometric(
            painted=painted.detach().contiguous().numpy(),
            target=target.detach().contiguous().numpy(),
            window=_WINDOW,
            share=share,
            stabilizers=_STABILIZERS,
            num_threads=num_threads,
            gradient=gradient.numpy(),
        )
        ctx.save_for_backward(gradient)
        return painted.new_tensor(loss)

    @staticmethod
    @once_differentiable  # type: ignore[untyped-decorator]
    def backward(ctx: Any, v_loss: Tensor) -> tuple[Tensor | None, ...]:
        (gradient,) = ctx.saved_tensors
        return v_loss * gradient, None, None, None
