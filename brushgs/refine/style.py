"""Refine strokes toward a style image: match its features, keep the scene's content, and stay smooth.

Source: Zhang et al. 2022, ARF (NNFM, content and total variation; colors are transferred first).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.errors import SceneError
from brushgs.formats.files import is_dir
from brushgs.options.choices import StyleLoss
from brushgs.passes.color.recolor import Palette
from brushgs.refine.distil import FREE_ASPECT, ROUNDNESS, color_distance, roundness, total_variation
from brushgs.refine.fit import Drawing, Fit, FitSchedule, LossCurve, no_progress
from brushgs.refine.nnfm import Features, GramStyle, NearestStyle, Style, style_gradient
from brushgs.refine.targets import TargetView
from brushgs.refine.variables import Rates, Variables
from brushgs.refine.vgg import BLOCK_3, Vgg, find_weights
from brushgs.refine.weights import VGG_16, VGG_19, find_vgg
from brushgs.values.arrays import Array
from brushgs.values.colors import flatten, split_alpha
from brushgs.values.gaussians import Gaussians

# Strokes turn and stretch further than in a fit to their scene, as marks of a painting have other directions.
RATES = Rates(means=0.04, scales=0.03, quats=0.04, sh_base=0.03)
# Strokes laid as marks should hardly turn: each view pulls toward its own nearest patches, and at `RATES`
# parallel neighbors scatter (median turn of 25 degrees after 40 steps, here 11).
LAID_RATES = Rates(means=0.01, scales=0.01, quats=0.01, opacities=0.01, sh_base=0.02)

# Over all steps: an evaluation of six views takes as long as six steps or more.
EVALUATIONS = 8


@dataclass(frozen=True)
class Weights:
    """Weights of the losses relative to the style loss, whose weight is 1.

    Attributes:
        content: of the mean cosine distance to the features of the recolored plain picture.
        outline: of the mean squared difference of alpha to the plain picture: outside the subject no features
            hold strokes in place.
        variation: of the total variation.
        color: of the squared distance of mean and covariance of the colors from the style image's.
    """

    content: float = 0.6
    outline: float = 0.5
    variation: float = 0.02
    color: float = 4.0


def weights_file(weights: Path | None) -> Path | None:
    """The file of VGG-16 or VGG-19: given itself, or its folder; None for one in torch's hub cache, if any.

    Raises:
        SceneError: if a folder has neither.
    """
    if weights is None or not is_dir(weights):
        return weights or find_weights()
    found = find_vgg(weights)
    if found is None:
        rule = VGG_19.missing_from(weights).removeprefix(f"{weights} ")
        raise SceneError(weights, f"{rule}; or {VGG_16.names[0]} of {VGG_16.what}")
    return found


def style_of(
    painting: Array,
    weights: Path | None = None,
    seed: int = 0,
    *,
    kind: StyleLoss = "nnfm",
    layers: Sequence[str] = (),
) -> Style:
    """The features of a style image, by VGG if there are weights, else by the filter bank.

    Args:
        painting: [H, W, C] the style image as `read_image` returns it; transparent parts have no style.
        weights: file of `weights_file`; None for the filter bank.
        seed: see `NearestStyle`.
        kind: of the loss.
        layers: see `Vgg`; none for the third block.

    Raises:
        SceneError: if the weights cannot be used.
        ValueError: if layers are named that the network does not have, or without one.
    """
    if layers and weights is None:
        raise ValueError(
            "style-layers needs the weights of a VGG; give --weights, a folder with "
            f"{VGG_19.names[0]} or {VGG_16.names[0]}"
        )
    rgb, alpha = split_alpha(painting)
    coverage = None
    if alpha is not None:  # transparent parts take the mean color of the others
        mean = (rgb * alpha[..., None]).sum(axis=(0, 1)) / max(float(alpha.sum()), 1e-9)
        rgb = flatten(painting, mean.astype(rgb.dtype))
        coverage = torch.from_numpy(np.ascontiguousarray(alpha))
    pixels = torch.from_numpy(np.ascontiguousarray(rgb)).permute(2, 0, 1).contiguous()
    features: Features
    if weights is None:
        from brushgs.refine.filter_bank import FilterBank  # imports kornia, not needed for VGG

        features = FilterBank(pixels)
    else:
        features = Vgg(weights, layers or BLOCK_3, is_split=kind == "gram")
    if kind == "gram":
        return GramStyle(features, pixels, coverage)
    return NearestStyle(features, pixels, coverage, seed=seed)


def stylise(
    variables: Variables,
    views: tuple[Sequence[TargetView], Sequence[TargetView]],
    style: Style,
    painting: Array,
    drawing: Drawing,
    schedule: FitSchedule,
    weights: Weights = Weights(),
    on_step: Callable[[float], None] = no_progress,
) -> tuple[Gaussians, LossCurve]:
    """Refine strokes toward a style image.

    Args:
        variables: recolored strokes to optimize, and which of their parameters.
        views: those of the loss, with target pictures in the colors of the style image as content; and others
            for the score.
        style: features of the style image.
        painting: [H, W, C] the style image itself, for its colors.
        drawing: how strokes are drawn.
        schedule: how long.
        weights: of the losses.
        on_step: called after every step with the latest score.

    Returns:
        The strokes with the highest score, which is -10 log10 of the loss in the validation views, and the
        curve.
    """
    palette = Palette.of_image(painting, space="srgb")
    mean, covariance = (torch.from_numpy(v).float() for v in (palette.mean, palette.covariance))

    def loss_of(rgb: Tensor, alpha: Tensor, view: TargetView) -> Tensor:
        picture = ba.Frame(rgb, alpha).over(mean)  # the style image's mean color is the least conspicuous
        style_loss, content_loss, gradient = style_gradient(
            picture.permute(2, 0, 1).detach(),
            style,
            view.over(mean).permute(2, 0, 1),
            weights.content,
            view.alpha,
        )
        linear = (picture.permute(2, 0, 1) * gradient).sum()  # has the right gradient, not the value
        loss = style_loss + weights.content * content_loss + (linear - linear.detach())
        loss = loss + weights.variation * total_variation(picture)
        loss = loss + weights.outline * (alpha - view.alpha).square().mean()
        return loss + weights.color * color_distance(rgb, alpha, mean, covariance)

    def objective(frame: ba.Frame, view: TargetView, strokes: ba.Gaussians) -> Tensor:
        loss = loss_of(frame.rgb, frame.alpha, view)
        if "opacities" in variables.moving:
            loss = loss + ROUNDNESS * roundness(strokes.scales, FREE_ASPECT)
        return loss

    def score(strokes: Gaussians) -> float:
        losses = []
        for view in views[1]:
            frame = drawing.frame(strokes, view.camera, view.moment)
            with torch.no_grad():
                loss = loss_of(torch.from_numpy(frame.rgb), torch.from_numpy(frame.alpha), view)
            losses.append(float(loss))
        return float(-10 * np.log10(np.mean(losses)))

    fit = Fit(variables, views[0], drawing, objective, score, schedule)
    return fit.run(on_step), fit.curve
