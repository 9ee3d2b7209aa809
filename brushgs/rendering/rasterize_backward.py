"""The derivative of `rasterize` on NumPy arrays: gradients of a loss by the picture in, by the boxes out.

What `brushgs.autograd` puts behind torch tensors; it needs no torch itself. `v_name` is the gradient of the
loss by `name` and has its shape. The arithmetic is in the compiled core, which blends once more: nothing is
kept from the way forward but its arguments and results.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs import _core
from brushgs.arrays import Array
from brushgs.brushes.levels import level_gradient
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Filter
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.gradients import BOX_COLUMNS, BoxGradients
from brushgs.rendering.rasterize import _kernel_of, _levels_for
from brushgs.scene import Boxes, Frame
from brushgs.threads import num_threads_or_default


def rasterize_backward(
    boxes: Boxes,
    texture: StrokeTexture,
    frame: Frame,
    v_rgb: Array,
    v_alpha: Array | None = None,
    v_depth: Array | None = None,
    *,
    filter: Filter = "mip",
    min_transmittance: float = MIN_TRANSMITTANCE,
    with_coverage: bool = False,
    num_threads: int | None = None,
) -> BoxGradients:
    """Gradients by the boxes of what `rasterize` painted.

    Args:
        boxes: M strokes without softness, as they were painted.
        texture: what they were painted with.
        frame: what was painted; with a depth where `v_depth` is given.
        v_rgb: [H, W, 3] in the dtype of the boxes, C-contiguous like the others.
        v_alpha: [H, W] or None for zeros.
        v_depth: [H, W] or None for zeros.
        filter: as it was painted with.
        min_transmittance: below which a pixel was finished.
        with_coverage: whether the gradient by the texture's coverage is wanted.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if boxes of a stroke image have softness, or a kernel's coverage is asked for.
    """
    if boxes.softness is not None and texture.kind == "image":
        raise ValueError('rasterize_backward: boxes must have no softness; project with order="depth"')
    if with_coverage and texture.kind != "image":
        raise ValueError(f"rasterize_backward: the built-in kernel {texture.kind!r} has no coverage")
    levels = _levels_for(boxes, texture, filter)
    gradients: dict[str, Any] = {name: np.empty_like(getattr(boxes, name)) for name in BOX_COLUMNS}
    v_texels: list[NDArray[np.float64]] = (
        [np.zeros((rows, width)) for width, rows in levels.sizes] if with_coverage else []
    )
    _core.rasterize_backward(
        _kernel_of(texture, filter),
        num_threads_or_default(num_threads),
        min_transmittance,
        boxes.centers,
        boxes.half_extents,
        boxes.angles,
        boxes.depths,
        boxes.colors,
        boxes.opacities,
        levels.pairs,
        levels.sizes,
        levels.reaches,
        levels.of_box,
        frame.rgb,
        frame.alpha,
        None if v_depth is None else frame.depth,
        v_rgb,
        v_alpha,
        v_depth,
        v_centers=gradients["centers"],
        v_half_extents=gradients["half_extents"],
        v_angles=gradients["angles"],
        v_depths=gradients["depths"],
        v_colors=gradients["colors"],
        v_opacities=gradients["opacities"],
        v_texels=v_texels,
    )
    coverage = _by_coverage(texture, levels.codes, v_texels) if with_coverage else None
    return BoxGradients(**gradients, coverage=coverage)


def _by_coverage(
    texture: StrokeTexture, codes: list[tuple[int, int]], v_texels: list[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """[h, w] gradient by the coverage, from that by the texels of the levels in use as the core has them."""
    total = np.zeros(texture.coverage.shape)
    for code, values in zip(codes, v_texels, strict=True):
        for axis in (0, 1):  # an axis of one texel was given a second one like it
            if texture.coverage.shape[axis] == 1:
                values = values.sum(axis, keepdims=True)
        total += level_gradient(texture.coverage, *code, values)
    return total
