"""Fit strokes to plain pictures of their scene, in generated views.

The target of each view is the plain picture: all Gaussians with the 3DGS kernel, at the moment of the view.
No photographs are needed. Strokes are drawn with their brush, as in the painting, so that they compensate for
gaps of a lacy brush.
Source: Kerbl et al. 2023, section 5 (loss, optimizer); the self-made targets are ours.
"""

from collections.abc import Callable, Sequence

import numpy as np
from torch import Tensor

import brushgs.autograd as ba
from brushgs.core.threads import num_threads_or_default
from brushgs.measure.likeness import psnr
from brushgs.refine.fit import Drawing, Fit, FitSchedule, LossCurve, no_progress
from brushgs.refine.losses import roundness
from brushgs.refine.photometric import photometric
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
