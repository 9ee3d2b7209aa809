"""How much of a view each Gaussian makes up."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.backward import rasterize_backward
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.scene import Camera, Gaussians


def visible_areas(
    gaussians: Gaussians, camera: Camera, *, num_threads: int | None = None
) -> NDArray[np.float64]:
    """The part of the plain picture that each Gaussian makes up: the sum of its blending weights over pixels.

    It is the derivative of the sum of the picture by the Gaussian's colour, so it takes one pass forward and
    one backward.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        [N] pixels, >= 0; 0 for what is outside the picture or wholly hidden. Their sum is that of alpha.
    """
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel, depth=False, num_threads=num_threads)
    plain = replace(gaussians, sh=gaussians.sh[:, :1])  # how much is seen does not depend on colours
    boxes, _ = project_with(plain, camera, options)
    areas = np.zeros(len(gaussians))
    if len(boxes) == 0:
        return areas
    frame = rasterize_with(boxes, camera, kernel, options)
    v_rgb = np.zeros_like(frame.rgb)
    v_rgb[..., 0] = 1
    gradients = rasterize_backward(
        boxes, kernel, frame, v_rgb, filter=options.filter, num_threads=num_threads
    )
    assert gradients.colors is not None
    areas[boxes.ids] = gradients.colors[:, 0]
    return areas
