"""Strokes fitted to the plain picture of the scene they stand for, from cameras that the program places.

The scene itself is the teacher: its plain picture (the kernel it was trained for, all Gaussians) from every
view. No photographs are needed. Strokes are drawn as they will be in the painting, with the stroke image, so
that they learn to make up for what a lacy brush leaves open.
Source: Kerbl et al. 2023, section 5 (loss, optimiser); the teacher is ours.
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
from brushgs.refine.fit import Curve, Drawing, Fit, Plan
from brushgs.refine.losses import photometric, roundness
from brushgs.refine.variables import Variables
from brushgs.rendering.render import render
from brushgs.scene import Camera, Gaussians

GROUND = (1.0, 1.0, 1.0)  # error is judged on white, as everywhere
# The weight of the term that keeps strokes round where all parameters move, and the aspect it leaves free.
ROUNDNESS, FREE_ASPECT = 0.05, 5.0


@dataclass(frozen=True, eq=False)
class TargetView:
    """A view, and what is to be seen there.

    Attributes:
        camera: the view.
        wanted: [H, W, 4] premultiplied RGB and alpha of the plain picture.
    """

    camera: Camera
    wanted: Tensor

    @classmethod
    def of(cls, scene: Gaussians, camera: Camera) -> "TargetView":
        """What the plain picture of a scene shows in a view."""
        frame = render(scene, camera, StrokeTexture.open("gaussian"), depth=False)
        return cls(camera, torch.from_numpy(np.dstack([frame.rgb, frame.alpha])))

    def on(self, ground: Sequence[float] | Tensor) -> Tensor:
        """[H, W, 3] what is to be seen, on a ground of one RGB colour."""
        return ba.Frame(self.wanted[..., :3], self.wanted[..., 3]).over(ground)


def distil(
    variables: Variables,
    training_views: Sequence[TargetView],
    validation_views: Sequence[TargetView],
    drawing: Drawing,
    plan: Plan,
    advance: Callable[[float], None] = lambda score: None,
) -> tuple[Gaussians, Curve]:
    """Fit strokes to the plain picture.

    Args:
        variables: strokes to move, and which of their numbers.
        training_views: views to learn from.
        validation_views: other views, to judge by.
        drawing: how strokes are drawn.
        plan: how long.
        advance: called after every step with the latest mean PSNR of the validation_views.

    Equal arguments give equal strokes, bit for bit, for any number of threads.

    Returns:
        The strokes with the highest PSNR of the validation_views, and the curve of PSNR in dB.
    """

    def objective(frame: ba.Frame, view: int, strokes: ba.Gaussians) -> Tensor:
        painted = torch.cat([frame.rgb, frame.alpha[..., None]], dim=2)
        loss = photometric(painted, training_views[view].wanted)
        if "opacities" in variables.moving:
            loss = loss + ROUNDNESS * roundness(strokes.scales, FREE_ASPECT)
        return loss

    cameras = [view.camera for view in training_views]
    fit = Fit(variables, cameras, drawing, objective, lambda s: mean_psnr(s, validation_views, drawing), plan)
    with _one_thread():
        return fit.run(advance), fit.curve


@contextmanager
def _one_thread() -> Iterator[None]:
    """PyTorch on one thread, as its sums depend on the number; drawing takes the time, and goes on in all."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def mean_psnr(strokes: Gaussians, validation_views: Sequence[TargetView], drawing: Drawing) -> float:
    """PSNR in dB to the plain picture on white, mean over views."""
    found = []
    for judge in validation_views:
        frame = drawing.frame(strokes, judge.camera)
        found.append(psnr(frame.over(GROUND), judge.on(GROUND).numpy()))
    return float(np.mean(found))
