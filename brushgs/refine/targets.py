"""Views with target pictures: the plain picture of the scene, still or at a moment of a clip.

All are drawn once, before the fit; those of a clip moment by moment, so that only one moment is in memory.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import torch
from torch import Tensor

import brushgs.autograd as ba
from brushgs.brushes.texture import StrokeTexture
from brushgs.core.threads import side_by_side
from brushgs.passes.color.recolor import Palette, recolor
from brushgs.passes.reduce.contribution import paint_of
from brushgs.pipeline.moving import Moving
from brushgs.refine.views import TimedView
from brushgs.rendering.render import render
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class TargetView:
    """A view and its target picture.

    Attributes:
        camera: the view.
        rgb: [H, W, 3] premultiplied, of the plain picture.
        alpha: [H, W] of it.
        moment: index into the moments of a clip; None for a still scene.
    """

    camera: Camera
    rgb: Tensor
    alpha: Tensor
    moment: int | None = None

    @classmethod
    def of(cls, scene: Gaussians, camera: Camera, moment: int | None = None) -> "TargetView":
        """The plain picture of a scene in a view."""
        frame = render(scene, camera, StrokeTexture.open("gaussian"), depth=False)
        return cls(camera, torch.from_numpy(frame.rgb), torch.from_numpy(frame.alpha), moment)

    def over(self, background: Sequence[float] | Tensor) -> Tensor:
        """[H, W, 3] the target picture over one RGB color."""
        return ba.Frame(self.rgb, self.alpha).over(background)


def draw_targets(
    views: Sequence[TimedView],
    shown_at: Callable[[int | None], Gaussians],
    num_threads: int | None = None,
) -> list[TargetView]:
    """The plain pictures of views, several in parallel, to keep cores busy.

    Args:
        views: n views.
        shown_at: the scene at the moment of a view; called once for each.
        num_threads: None takes the processors available to this process. The pictures do not depend on it.

    Returns:
        n targets, in the same order.
    """
    targets = dict[int, TargetView]()
    for moment in dict.fromkeys(view.moment for view in views):
        scene = shown_at(moment)
        rows = [index for index, view in enumerate(views) if view.moment == moment]
        draw = partial(TargetView.of, scene, moment=moment)
        targets |= zip(
            rows, side_by_side(draw, (views[row].camera for row in rows), num_threads), strict=True
        )
    return [targets[index] for index in range(len(views))]


def scene_over_time(
    moving: Moving, members: Gaussians, palette: Palette | None = None, strength: float = 1.0
) -> Callable[[int], Gaussians]:
    """The scene behind the strokes of a clip, at each of its moments.

    Args:
        moving: the moving scene, and its moments.
        members: the Gaussians that strokes were made of. If rows correspond, only these are drawn.
        palette: new colors, mapped as for `members` at all times; None keeps its own.
        strength: of the palette, see `recolor`.
    """
    weights = paint_of(members)

    def at(moment: int) -> Gaussians:
        scene = moving.scene.at(float(moving.motion.times[moment]))
        if moving.scene.has_rows:
            assert members.ids is not None, "they are rows of the scene"
            scene = scene.take(members.ids.astype(np.intp))
        if palette is None or not weights.any():
            return scene
        both = Gaussians.joined([replace(scene, brushes=None, ids=None), members])
        alone = np.concatenate([np.zeros(len(scene), weights.dtype), weights])
        return recolor(both, palette, strength, weights=alone).take(slice(0, len(scene)))

    return at
