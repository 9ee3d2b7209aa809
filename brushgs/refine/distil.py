"""Strokes fitted to the plain picture of their scene, in views that the program places itself.

The target of every view is the scene drawn plainly: all Gaussians, with the kernel it was trained for. No
photographs are needed. Strokes are drawn with the stroke image, as in the painting, so that they make up for
what a lacy brush leaves open.
Source: Kerbl et al. 2023, section 5 (loss, optimiser); the self-made targets are ours.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.likeness import psnr
from brushgs.refine.fit import Drawing, Fit, FitSchedule, LossCurve, no_progress
from brushgs.refine.losses import photometric, roundness
from brushgs.refine.variables import Variables
from brushgs.rendering.render import render
from brushgs.scene import Camera, Gaussians

BACKGROUND = (1.0, 1.0, 1.0)  # errors are measured on white, as everywhere
# Weight of the term that keeps strokes round where all parameters move, and the aspect up to which it is 0.
ROUNDNESS, FREE_ASPECT = 0.05, 5.0


@dataclass(frozen=True, eq=False)
class TargetView:
    """A view and its target picture.

    Attributes:
        camera: the view.
        rgba: [H, W, 4] premultiplied RGB and alpha of the plain picture.
    """

    camera: Camera
    rgba: Tensor

    @classmethod
    def of(cls, scene: Gaussians, camera: Camera) -> "TargetView":
        """The plain picture of a scene in a view."""
        frame = render(scene, camera, StrokeTexture.open("gaussian"), depth=False)
        return cls(camera, torch.from_numpy(np.dstack([frame.rgb, frame.alpha])))

    @property
    def alpha(self) -> Tensor:
        """[H, W] of the target picture."""
        return self.rgba[..., 3]

    def over(self, background: Sequence[float] | Tensor) -> Tensor:
        """[H, W, 3] the target picture over one RGB colour."""
        return ba.Frame(self.rgba[..., :3], self.alpha).over(background)


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
        variables: strokes to optimise, and which of their parameters.
        training_views: views of the loss.
        validation_views: other views, for the score.
        drawing: how strokes are drawn.
        schedule: how long.
        on_step: called after every step with the latest score.

    Returns:
        The strokes with the highest score, the mean PSNR in the validation views in dB, and the curve.
    """

    def objective(frame: ba.Frame, view: int, strokes: ba.Gaussians) -> Tensor:
        painted = torch.cat([frame.rgb, frame.alpha[..., None]], dim=2)
        loss = photometric(painted, training_views[view].rgba)
        if "opacities" in variables.moving:
            loss = loss + ROUNDNESS * roundness(strokes.scales, FREE_ASPECT)
        return loss

    cameras = [view.camera for view in training_views]

    def score(strokes: Gaussians) -> float:
        return mean_psnr(strokes, validation_views, drawing)

    fit = Fit(variables, cameras, drawing, objective, score, schedule)
    with _one_thread():
        return fit.run(on_step), fit.curve


@contextmanager
def _one_thread() -> Iterator[None]:
    """PyTorch on one thread: its sums depend on their number. Rasterising, which takes longest, keeps all."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def mean_psnr(strokes: Gaussians, views: Sequence[TargetView], drawing: Drawing) -> float:
    """PSNR of painted strokes to the target pictures on white, mean over views, in dB."""
    values = []
    for view in views:
        frame = drawing.frame(strokes, view.camera)
        values.append(psnr(frame.over(BACKGROUND), view.over(BACKGROUND).numpy()))
    return float(np.mean(values))
