"""What each Gaussian, or stroke, makes up of a view: exact sums over the pixels that it paints.

The weight of a Gaussian at a pixel is its alpha times the light that gets through what lies in front of it:
the picture is the sum of weight x colour. So sums of anything by these weights are the derivative of a
picture by its colours, and of a layer by its attribute. They do not depend on colours, and need no picture.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.backward import rasterize_backward
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.scene import Boxes, Camera, Frame, Gaussians


def painted_sums(
    boxes: Boxes,
    kernel: StrokeTexture,
    values: Array,
    shares: Array,
    *,
    num_threads: int | None = None,
) -> tuple[Array, Array]:
    """Sum values of pixels over what each box paints.

    Args:
        boxes: M boxes.
        kernel: "gaussian", or "ellipse" for strokes.
        values: [H, W, 3] of each pixel.
        shares: [H, W] of each pixel.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        For each box the sums over pixels of weight x values [M, 3], and of weight x share [M], in pixels; in
        the dtype of the boxes.
    """
    dtype = boxes.centers.dtype
    v_rgb, v_depth = (np.ascontiguousarray(v, dtype=dtype) for v in (values, shares))
    # A layer is a sum by weights over alpha: with an alpha of 1, its derivative is the sum.
    nothing = Frame(np.zeros_like(v_rgb), np.ones_like(v_depth), np.zeros_like(v_depth))
    gradients = rasterize_backward(
        boxes, kernel, nothing, v_rgb, v_layers={"depth": v_depth}, num_threads=num_threads
    )
    assert gradients.colors is not None
    assert gradients.depths is not None
    return gradients.colors, gradients.depths


def visible_areas(
    gaussians: Gaussians, camera: Camera, *, num_threads: int | None = None
) -> NDArray[np.float64]:
    """The part of the plain picture that each Gaussian makes up: the sum of its blending weights over pixels.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        [N] pixels, >= 0; 0 for what is outside the picture or wholly hidden. Their sum is that of alpha.
    """
    kernel = StrokeTexture.open("gaussian")
    plain = replace(gaussians, sh=gaussians.sh[:, :1])  # colours do not matter
    boxes, _ = project_with(plain, camera, RenderOptions.of(kernel, num_threads=num_threads))
    size = camera.height, camera.width
    _, sums = painted_sums(boxes, kernel, np.zeros((*size, 3)), np.ones(size), num_threads=num_threads)
    areas = np.zeros(len(gaussians))
    areas[boxes.ids] = sums
    return areas
