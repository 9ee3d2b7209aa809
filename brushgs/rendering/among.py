"""Plain Gaussians among the strokes of a coat: the unpainted rest, if only a part of a scene is painted.

They are projected as for the plain picture (own directions, by depth), drawn with the soft brush, and sorted
together with the strokes.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.soft import soft_brush
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.project import ProjectCounts
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

NO_REACH = 1e-6  # reach of underpaint in half extents, too small to cover a pixel center


def with_soft_brush(
    texture: StrokeTexture | BrushSet, options: RenderOptions
) -> tuple[BrushSet, RenderOptions]:
    """Brushes and options with the soft brush as the last row; the 3DGS kernel needs none.

    Raises:
        ValueError: if strokes are painted with another kernel.
    """
    brushes = BrushSet.of(texture)
    if brushes.kind == "gaussian":
        return brushes, options
    if brushes.kind != "image":
        raise ValueError(
            f"--stroke {brushes.name} cannot paint a part of a scene (--where), since a kernel is not mixed "
            "with another; name a brush, or gaussian"
        )
    soft = soft_brush()
    sigmas = (*_of_each(options.num_sigmas, len(brushes)), soft.num_sigmas)
    underpaint = options.underpaint
    if underpaint is not None:
        underpaint = replace(underpaint, reach=(*_of_each(underpaint.reach, len(brushes)), NO_REACH))
    together = BrushSet((*brushes.textures, soft), brushes.name)
    return together, replace(options, num_sigmas=sigmas, underpaint=underpaint)


def boxes_among(
    boxes: Boxes, plain: Gaussians, camera: Camera, options: RenderOptions, *, first: int, brush: int
) -> tuple[Boxes, ProjectCounts]:
    """Merge boxes of strokes and of plain Gaussians, nearest first; and cull counts of the latter.

    Args:
        boxes: of strokes.
        plain: the Gaussians.
        camera: the view.
        options: of the strokes.
        first: id of the first Gaussian, which is the number of strokes.
        brush: the row of the soft brush.
    """
    kernel = StrokeTexture.open("gaussian")
    as_they_are = RenderOptions.of(kernel, low_pass=options.low_pass, num_threads=options.num_threads)
    others, counts = project_with(replace(plain, brushes=None), camera, as_they_are)
    columns: dict[str, Any] = {
        name: _joined(getattr(boxes, name), getattr(others, name))
        for name in ("centers", "half_extents", "angles", "depths", "colors", "opacities")
    }
    for name in ("softness", "setbacks", "reliefs"):  # plain Gaussians have none
        of_strokes = getattr(boxes, name)
        if of_strokes is not None:
            rest = np.zeros((len(others), *of_strokes.shape[1:]), of_strokes.dtype)
            columns[name] = _joined(of_strokes, rest)
    own = np.zeros(len(boxes), np.uint8) if boxes.brushes is None else boxes.brushes
    columns["brushes"] = _joined(own, np.full(len(others), brush, np.uint8))
    columns["ids"] = _joined(boxes.ids, (others.ids + first).astype(np.int32))
    order = np.argsort(columns["depths"], kind="stable")
    return Boxes(**{name: column[order] for name, column in columns.items()}), counts


def _joined(first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([first, second.astype(first.dtype, copy=False)])


def _of_each(value: float | tuple[float, ...], count: int) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,) * count
