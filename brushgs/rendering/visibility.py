"""Visible share of each Gaussian or stroke in a view: exact sums over its pixels.

The weight of a Gaussian at a pixel is its alpha times the transmittance in front of it; the picture is the
sum of weight x color. Sums by these weights do not depend on colors.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.rasterize import box_arrays
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

_KERNELS = {"gaussian": _core.Kernel.gaussian, "ellipse": _core.Kernel.ellipse}


def painted_sums(
    boxes: Boxes,
    kernel: StrokeTexture,
    values: Array,
    shares: Array,
    *,
    num_threads: int | None = None,
) -> tuple[Array, Array]:
    """Weighted sums of pixel values over the pixels of each box.

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
    sums = np.empty_like(boxes.colors)
    return sums, _sums(boxes, kernel, values, shares, sums, num_threads)


def painted_shares(
    boxes: Boxes, kernel: StrokeTexture, shares: Array, *, num_threads: int | None = None
) -> Array:
    """[M] sums of `painted_sums` over shares only."""
    return _sums(boxes, kernel, None, shares, None, num_threads)


def _sums(
    boxes: Boxes,
    kernel: StrokeTexture,
    values: Array | None,
    shares: Array,
    value_sums: Array | None,
    num_threads: int | None,
) -> Array:
    """The sums [M] over shares; those over values are written to `value_sums`."""
    dtype, share_sums = boxes.centers.dtype, np.empty_like(boxes.depths)
    _core.sum_painted(
        kernel=_KERNELS[kernel.kind],
        min_transmittance=MIN_TRANSMITTANCE,
        num_threads=num_threads_or_default(num_threads),
        boxes=box_arrays(boxes, [], colors=boxes.colors),
        values=None if values is None else np.ascontiguousarray(values, dtype),
        shares=np.ascontiguousarray(shares, dtype),
        value_sums=value_sums,
        share_sums=share_sums,
    )
    return share_sums


def visible_areas(
    gaussians: Gaussians, camera: Camera, *, num_threads: int | None = None
) -> NDArray[np.float64]:
    """Visible area of each Gaussian in the plain picture: the sum of its blending weights over pixels.

    Args:
        gaussians: N Gaussians.
        camera: the view.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        [N] pixels, >= 0; 0 outside the picture or if hidden. They sum to the sum of alpha.
    """
    kernel = StrokeTexture.open("gaussian")
    plain = replace(gaussians, sh=gaussians.sh[:, :1])  # colors do not matter
    boxes, _ = project_with(plain, camera, RenderOptions.of(kernel, num_threads=num_threads))
    size = camera.height, camera.width
    areas = np.zeros(len(gaussians))
    areas[boxes.ids] = painted_shares(boxes, kernel, np.ones(size), num_threads=num_threads)
    return areas
