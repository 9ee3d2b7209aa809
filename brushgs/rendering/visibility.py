"""What each Gaussian, or stroke, makes up of a view: exact sums over the pixels that it paints.

The weight of a Gaussian at a pixel is its alpha times the light that gets through what lies in front of it:
the picture is the sum of weight x colour. Sums of anything by these weights are the derivative of a picture
by colours and depths, so they take one pass forward and one backward.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.backward import rasterize_backward
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.scene import Boxes, Camera, Frame, Gaussians


@dataclass(frozen=True, eq=False)
class PaintedSums:
    """Of each of M boxes, sums over pixels of weight x value.

    Attributes:
        boxes: M boxes; `boxes.ids` are the rows of the Gaussians.
        values: [M, 3] sums of weight x the three values of a pixel.
        shares: [M] sums of weight x the share of a pixel, in pixels.
    """

    boxes: Boxes
    values: Array
    shares: Array


def painted_sums(
    gaussians: Gaussians,
    camera: Camera,
    kernel: StrokeTexture,
    values: Callable[[Frame], tuple[Array, Array]],
    *,
    num_threads: int | None = None,
) -> PaintedSums:
    """Sum values of pixels over what each Gaussian paints.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        kernel: "gaussian", or "ellipse" for strokes.
        values: from the picture of these Gaussians to three values [H, W, 3] and one share [H, W] per pixel.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    options = RenderOptions.of(kernel, num_threads=num_threads)
    boxes, _ = project_with(gaussians, camera, options)
    frame = rasterize_with(boxes, camera, kernel, options)
    v_rgb, share = (np.ascontiguousarray(v, dtype=frame.rgb.dtype) for v in values(frame))
    # Depth is the mean of the boxes' depths by weight, over alpha: times alpha its derivative is the weight.
    gradients = rasterize_backward(
        boxes,
        kernel,
        frame,
        v_rgb,
        v_layers={"depth": share * frame.alpha},
        filter=options.filter,
        num_threads=num_threads,
    )
    assert gradients.colors is not None
    assert gradients.depths is not None
    return PaintedSums(boxes, gradients.colors, gradients.depths)


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
    plain = replace(gaussians, sh=gaussians.sh[:, :1])  # how much is seen does not depend on colours
    sums = painted_sums(
        plain,
        camera,
        kernel,
        lambda frame: (np.zeros_like(frame.rgb), np.ones_like(frame.alpha)),
        num_threads=num_threads,
    )
    areas = np.zeros(len(gaussians))
    areas[sums.boxes.ids] = sums.shares
    return areas
