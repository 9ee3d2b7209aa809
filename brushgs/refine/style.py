"""Strokes refined toward a style image: features near to its own, the subject kept, the picture calm.

Source: Zhang et al. 2022, ARF (NNFM, content and total variation; colours are transferred first).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.arrays import Array
from brushgs.passes.recolor import Palette
from brushgs.refine.distil import FREE_ASPECT, ROUNDNESS, TargetView
from brushgs.refine.fit import Curve, Drawing, Fit, Plan
from brushgs.refine.losses import color_distance, roundness, total_variation
from brushgs.refine.nnfm import Style, style_gradient
from brushgs.refine.variables import Rates, Variables
from brushgs.scene import Gaussians

# Strokes turn and stretch further here than in a fit to their own scene: a painting runs another way.
RATES = Rates(means=0.04, scales=0.03, quats=0.04, base=0.03)


@dataclass(frozen=True)
class Weights:
    """What each loss counts.

    Attributes:
        content: of the mean cosine distance to the features of the recoloured plain picture.
        outline: of the mean squared difference of alpha to the plain picture's: turned strokes that reach out
            of the subject meet no feature there that would hold them back.
        variation: of the total variation.
        color: of the squared distance of mean and covariance of the colours to the painting's.
    """

    content: float = 0.6
    outline: float = 0.5
    variation: float = 0.02
    color: float = 4.0


def stylise(
    variables: Variables,
    training_views: Sequence[TargetView],
    validation_views: Sequence[TargetView],
    style: Style,
    painting: Array,
    drawing: Drawing,
    plan: Plan,
    weights: Weights = Weights(),
    advance: Callable[[float], None] = lambda score: None,
) -> tuple[Gaussians, Curve]:
    """Refine strokes toward a painting.

    Args:
        variables: strokes to move, recoloured already, and which of their numbers.
        training_views: views, with what the plain picture in the painting's colours shows there: the content.
        validation_views: other views, to judge by.
        style: features of the painting.
        painting: [H, W, C] the painting itself, for its colours.
        drawing: how strokes are drawn.
        plan: how long.
        weights: of the losses.
        advance: called after every step with the latest score.

    Returns:
        The strokes with the lowest loss in the validation views, and the curve: its scores are -10 log10 of
        that loss.
    """
    palette = Palette.of_image(painting, space="srgb")
    mean, covariance = (torch.from_numpy(v).float() for v in (palette.mean, palette.covariance))

    def loss_of(rgb: Tensor, alpha: Tensor, view: TargetView) -> Tensor:
        picture = ba.Frame(rgb, alpha).over(mean)  # a ground that is no colour of its own
        near, kept, gradient = style_gradient(
            picture.permute(2, 0, 1).detach(),
            style,
            view.on(mean).permute(2, 0, 1),
            weights.content,
            view.wanted[..., 3],
        )
        pull = (picture.permute(2, 0, 1) * gradient).sum()
        loss = near + weights.content * kept + (pull - pull.detach())  # the value, with the derivative
        loss = loss + weights.variation * total_variation(picture)
        loss = loss + weights.outline * (alpha - view.wanted[..., 3]).square().mean()
        return loss + weights.color * color_distance(rgb, alpha, mean, covariance)

    def objective(frame: ba.Frame, view: int, strokes: ba.Gaussians) -> Tensor:
        loss = loss_of(frame.rgb, frame.alpha, training_views[view])
        if "opacities" in variables.moving:
            loss = loss + ROUNDNESS * roundness(strokes.scales, FREE_ASPECT)
        return loss

    def score(strokes: Gaussians) -> float:
        found = []
        for judge in validation_views:
            frame = drawing.frame(strokes, judge.camera)
            with torch.no_grad():
                loss = loss_of(torch.from_numpy(frame.rgb), torch.from_numpy(frame.alpha), judge)
            found.append(float(loss))
        return float(-10 * np.log10(np.mean(found)))

    fit = Fit(variables, [view.camera for view in training_views], drawing, objective, score, plan)
    return fit.run(advance), fit.curve
