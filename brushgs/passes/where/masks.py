"""Painted masks of a scene select Gaussians: those in white pixels.

Each Gaussian takes the mean of the masks over its pixels, by blending weight. Trust depends on visibility;
hardly visible Gaussians take the value of their neighbors on the same surface, see `settle`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.color.picture_votes import votes
from brushgs.passes.where.settle import settle
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

# Exponent of the visible share of a Gaussian over all views. With exponent 1, the table under the cloth is
# taken for cloth: IoU of 0.80 instead of 0.94.
TRUST_POWER = 2.0


@dataclass(frozen=True, eq=False)
class MaskView:
    """One painted mask.

    Attributes:
        camera: of the picture.
        inside: [H, W] 0 (outside) to 1.
        known: [H, W] 0 to 1: weight of each pixel.
    """

    camera: Camera
    inside: Array
    known: Array


def mask_votes(gaussians: Gaussians, views: Sequence[MaskView], *, num_threads: int | None = None) -> F64:
    """[N] votes of the masks for each Gaussian, 0 to 1; 1/2 if no view shows any.

    Args:
        gaussians: N Gaussians.
        views: at least one.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    sums, weights, areas = (np.zeros(len(gaussians)) for _ in range(3))
    for view in views:  # one after another: masks of a whole capture would take much memory as float64
        found, shares = votes(
            gaussians,
            [view.camera],
            [view.inside[..., None]],
            pixel_weights=[view.known],
            num_threads=num_threads,
        )
        sums += found[:, 0]
        weights += shares
        areas += np.where(shares > 0, *_areas(gaussians, view))
    is_seen = weights > 0
    means = np.full(len(gaussians), 0.5)
    means[is_seen] = np.clip(sums[is_seen] / weights[is_seen], 0, 1)
    clear = np.zeros(len(gaussians))
    clear[is_seen] = weights[is_seen] / np.maximum(areas, weights)[is_seen]
    return settle(gaussians, means, clear**TRUST_POWER)


def _areas(gaussians: Gaussians, view: MaskView) -> tuple[F64, F64]:
    """[N] area of each Gaussian in a view without occlusion, pixels.

    First the full area; then the area times the weight at its center, for invisible Gaussians: they may be
    hidden, or the mask has no weight there.
    """
    camera = view.camera
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    boxes, _ = project_with(replace(gaussians, sh=gaussians.sh[:, :1]), camera, options)
    areas, extents = np.zeros(len(gaussians)), boxes.half_extents.astype(np.float64) / kernel.num_sigmas
    columns, rows = np.floor(boxes.centers.astype(np.float64)).astype(np.intp).T
    is_inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    known = np.zeros(len(boxes))
    known[is_inside] = view.known[rows[is_inside], columns[is_inside]]
    areas[boxes.ids] = 2 * np.pi * boxes.opacities * extents[:, 0] * extents[:, 1]
    says = np.zeros(len(gaussians))
    says[boxes.ids] = known
    return areas, areas * says
