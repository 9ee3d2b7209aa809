"""Derivatives of `project` and `rasterize` on NumPy arrays: gradients by the result in, gradients by the
input out.

`brushgs.autograd` wraps them for torch tensors; they do not need torch. `v_name` is the gradient of the loss
by `name`, with its shape and dtype. The compiled core projects and blends again: nothing is stored from the
forward pass but its arguments and results, and optionally a `Trace` of the pixels of each stroke.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from brushgs.brushes.brush_set import Brush, BrushSet
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.project import ProjectOptions
from brushgs.rendering.rasterize import RasterOptions, Trace, box_arrays
from brushgs.rendering.streaks import check_streaks, streak_arguments, streak_slopes
from brushgs.rendering.texture_levels import coverage_gradients, kernel_of, levels_for
from brushgs.rendering.underpaint import underpaint_arguments
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import LAYER_COLUMNS, Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import GAUSSIAN_COLUMNS, Gaussians

BOX_COLUMNS = ("centers", "half_extents", "angles", "depths", "colors", "opacities")


@dataclass(frozen=True, eq=False)
class BoxGradients:
    """Gradients by columns of boxes, in their dtype, None for zeros; and by the coverage (0 to 1) of each
    brush.
    """

    centers: Array | None = None  # [M, 2]
    half_extents: Array | None = None  # [M, 2]
    angles: Array | None = None  # [M]
    depths: Array | None = None  # [M]
    colors: Array | None = None  # [M, 3]
    opacities: Array | None = None  # [M]
    coverages: tuple[F64, ...] = ()  # [h, w] by row of the brush set; empty if not computed

    @property
    def coverage(self) -> F64 | None:
        """[h, w] gradient by the first brush's coverage; None if not computed."""
        return self.coverages[0] if self.coverages else None


@dataclass(frozen=True, eq=False)
class GaussianGradients:
    """Gradients by columns of Gaussians, in their dtype; None if not computed."""

    means: Array | None = None  # [N, 3]
    quats: Array | None = None  # [N, 4]
    scales: Array | None = None  # [N, 3]
    opacities: Array | None = None  # [N]
    sh: Array | None = None  # [N, k, 3]


def project_backward(
    gaussians: Gaussians,
    camera: Camera,
    boxes: Boxes,
    v_boxes: BoxGradients,
    options: ProjectOptions,
    *,
    columns: Collection[str] = GAUSSIAN_COLUMNS,
) -> GaussianGradients:
    """Gradients of `project` by the Gaussians.

    They are the exact derivative of the computed value, where it exists. Otherwise:

    - Culling and the order of boxes have no derivative: rows without a box get zeros.
    - Color channels clamped to 0 have no gradient.
    - Outside 1.3 times the field of view, the clamped Jacobian has no gradient by the position.
    - The angle of a round ellipse (direction below rounding, 1e-14) has no gradient. Just above, its gradient
      grows like 1 / anisotropy.
    - `Directions` are constants: the angle has no gradient.
    - The choice of the longest axis (`lock="anchor"`) is constant.

    Args:
        gaussians: as projected.
        camera: as projected.
        boxes: the result.
        v_boxes: the gradient by the boxes.
        options: as projected.
        columns: to compute gradients for.

    Returns:
        Gradients of these columns, including SH degrees that are all zero and skipped by `project`.
    """
    gradients: dict[str, Any] = {
        name: np.empty_like(getattr(gaussians, name)) if name in columns else None
        for name in GAUSSIAN_COLUMNS
    }
    _core.project_backward(
        **options.core_arguments(gaussians, camera),
        ids=boxes.ids,
        colors=boxes.colors,
        **{f"v_box_{name}": getattr(v_boxes, name) for name in BOX_COLUMNS},
        **{f"v_{name}": gradient for name, gradient in gradients.items()},
    )
    return GaussianGradients(**gradients)


class FrameGradients(NamedTuple):
    """Gradients by a frame [H, W], in the dtype of the boxes and C-contiguous; None for zeros."""

    rgb: Array  # [H, W, 3]
    alpha: Array | None = None
    layers: Mapping[str, Array | None] = MappingProxyType({})  # by name; a missing one is zeros


def rasterize_backward(
    boxes: Boxes,
    texture: Brush,
    frame: Frame,
    v_frame: FrameGradients,
    options: RasterOptions,
    *,
    with_coverage: bool = False,
    trace: Trace | None = None,
) -> BoxGradients:
    """Gradients of `rasterize` by the boxes.

    Args:
        boxes: M strokes without softness, as painted.
        texture: as painted with.
        frame: the result.
        v_frame: the gradient by it.
        options: as painted with, but neither glazed nor with a depth test. A box gets the sum for stroke and
            underpaint, its setback no gradient. The result does not depend on the number of threads.
        with_coverage: whether to compute the gradients by the coverage of each brush.
        trace: of the same forward pass; None recomputes it. The result does not depend on it.

    Raises:
        ValueError: if boxes of a stroke image have softness, a kernel's coverage is requested, or the trace
            is of other boxes.
    """
    brush_set = BrushSet.of(texture)
    _check_derivable(boxes, brush_set, options.streaks, with_coverage=with_coverage)
    streaks = options.streaks if brush_set.kind == "image" else 0.0
    levels = (
        levels_for("rasterize_backward", boxes, brush_set, options.filter) if trace is None else trace.levels
    )
    given = {name: v for name, v in v_frame.layers.items() if v is not None}
    gradients: dict[str, Any] = {
        name: np.empty_like(getattr(boxes, name))
        for name in BOX_COLUMNS
        if name not in LAYER_COLUMNS.values()
    }
    attributes = boxes.attributes()
    v_attributes = {name: np.empty_like(attributes[name]) for name in given}
    v_texels = [np.zeros(shape) for shape in levels.shapes] if with_coverage else []
    _core.rasterize_backward(
        kernel=kernel_of(brush_set, options.filter),
        levels=levels.packed,
        min_transmittance=float(options.min_transmittance),
        num_threads=num_threads_or_default(options.num_threads),
        boxes=box_arrays(
            boxes,
            [getattr(boxes, LAYER_COLUMNS[name]) for name in given],
            colors=boxes.colors,
            **underpaint_arguments("rasterize_backward", boxes, brush_set, options.underpaint),
            **streak_arguments(boxes, streaks, brush_set),
            streak_slopes=streak_slopes(boxes, streaks, brush_set.without_bristles(boxes.brushes)),
        ),
        trace=None if trace is None else trace.of_core,
        rgb=frame.rgb,
        alpha=frame.alpha,
        layers=[getattr(frame, name) for name in given],
        v_rgb=v_frame.rgb,
        v_alpha=v_frame.alpha,
        v_layers=list(given.values()),
        **{f"v_{name}": gradient for name, gradient in gradients.items()},
        v_attributes=list(v_attributes.values()),
        v_texels=v_texels,
    )
    for name, attribute in attributes.items():
        gradients[LAYER_COLUMNS[name]] = v_attributes.get(name, np.zeros_like(attribute))
    coverages = coverage_gradients(brush_set, levels, v_texels) if with_coverage else ()
    return BoxGradients(**gradients, coverages=coverages)


def _check_derivable(boxes: Boxes, brush_set: BrushSet, streaks: float, *, with_coverage: bool) -> None:
    if boxes.softness is not None and brush_set.kind == "image":
        raise ValueError('rasterize_backward: boxes must have no softness; project with order="depth"')
    if with_coverage and brush_set.kind != "image":
        raise ValueError(f"rasterize_backward: the built-in kernel {brush_set.kind!r} has no coverage")
    check_streaks("rasterize_backward", streaks)
