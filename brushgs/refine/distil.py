"""Fit strokes to plain pictures of their scene, in generated views.

The target of each view is the plain picture: all Gaussians with the 3DGS kernel, at the moment of the view.
No photographs are needed. Strokes are drawn with their brush, as in the painting, so that they compensate for
gaps of a lacy brush.
Source: Kerbl et al. 2023, section 5 (loss, optimizer); the self-made targets are ours.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

import brushgs.autograd as ba
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.measure.likeness import psnr
from brushgs.refine.fit import Drawing, Fit, FitSchedule, LossCurve, no_progress
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Variables
from brushgs.values.gaussians import Gaussians

BACKGROUND = (1.0, 1.0, 1.0)  # errors are measured on white, as everywhere in brushgs
# Weight of the roundness term if all parameters move, and the aspect up to which it is 0.
ROUNDNESS, FREE_ASPECT = 0.05, 5.0


def distil(
    variables: Variables,
    training_views: Sequence[TargetView],
    validation_views: Sequence[TargetView],
    drawing: Drawing,
    schedule: FitSchedule,
    on_step: Callable[[float], None] = no_progress,
) -> tuple[Gaussians, LossCurve]:
    """Fit strokes to the plain picture of their scene.

    Equal arguments give equal strokes, bit for bit, for any number of threads.

    Args:
        variables: strokes to optimize, and which of their parameters.
        training_views: views of the loss.
        validation_views: other views, for the score.
        drawing: how strokes are drawn.
        schedule: how long.
        on_step: called after every step with the latest score.

    Returns:
        The strokes with the highest score, the mean PSNR in the validation views in dB, and the curve.
    """
    num_threads = num_threads_or_default(drawing.options.num_threads)

    def objective(frame: ba.Frame, view: TargetView, strokes: ba.Gaussians) -> Tensor:
        of_color = photometric(frame.rgb, view.rgb, num_threads)
        of_alpha = photometric(frame.alpha[..., None], view.alpha[..., None], num_threads)
        loss = (3 * of_color + of_alpha) / 4  # equal weight for all four channels
        if "opacities" in variables.moving:
            loss = loss + ROUNDNESS * roundness(strokes.scales, FREE_ASPECT)
        return loss

    def score(strokes: Gaussians) -> float:
        return mean_psnr(strokes, validation_views, drawing)

    fit = Fit(variables, training_views, drawing, objective, score, schedule)
    return fit.run(on_step), fit.curve


def mean_psnr(strokes: Gaussians, views: Sequence[TargetView], drawing: Drawing) -> float:
    """PSNR of painted strokes to the target pictures on white, mean over views, in dB."""
    values = []
    for view in views:
        frame = drawing.frame(strokes, view.camera, view.moment)
        values.append(psnr(frame.over(BACKGROUND), view.over(BACKGROUND).numpy()))
    return float(np.mean(values))


# The loss of a painted picture to its target, by absolute difference and structural similarity.
#
# Value and gradient are computed together by the compiled core. SSIM windows are centered on every second
# pixel in both directions (one per pixel gives similar fits), clipped at the borders, with weights that sum
# to 1.
#
# Source: Kerbl et al. 2023, eq. 7 (L1 and D-SSIM); Wang et al. 2004, Image Quality Assessment (SSIM).


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


# Differentiable losses of strokes, and of painted pictures without a target, in torch.


def roundness(scales: Tensor, free_aspect: float) -> Tensor:
    """Mean squared excess of log(longest / middle scale) over log(free_aspect), for scales [N, 3]."""
    ordered = scales.sort(dim=1).values
    aspect = torch.log(ordered[:, 2].clamp_min(1e-30)) - torch.log(ordered[:, 1].clamp_min(1e-30))
    return torch.relu(aspect - torch.log(torch.tensor(free_aspect, dtype=scales.dtype))).square().mean()


def total_variation(picture: Tensor) -> Tensor:
    """Mean absolute difference between neighbors of a picture [H, W, C], down plus across.

    `kornia.losses.total_variation` takes 1.4 to 1.5 times as long.
    """
    return (picture[1:] - picture[:-1]).abs().mean() + (picture[:, 1:] - picture[:, :-1]).abs().mean()


def color_distance(rgb: Tensor, weights: Tensor, mean: Tensor, covariance: Tensor) -> Tensor:
    """Squared distance of mean and covariance of weighted colors from target values, a number.

    Args:
        rgb: [H, W, 3] premultiplied by the weights.
        weights: [H, W] alpha; where it is zero there is no color.
        mean: [3] target.
        covariance: [3, 3] target.
    """
    total = weights.sum() + 1e-9
    own_mean = rgb.sum(dim=(0, 1)) / total
    away = (rgb / weights.clamp_min(1e-3)[..., None] - own_mean) * weights.sqrt()[..., None]
    own_covariance = torch.einsum("hwi,hwj->ij", away, away) / total
    return (own_mean - mean).square().sum() + (own_covariance - covariance).square().sum()
