"""Votes of pictures from known cameras: the value of each pixel goes to its Gaussians, by blending weight.

So a mask painted over pictures marks Gaussians, and Gaussians take the colors of edited pictures. The mean
is linear: an affine map of the pictures gives the same map of the votes.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.visibility import painted_sums
from brushgs.values.arrays import F64, Array, check
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

CHANNELS_AT_ONCE = 3  # summed up in one pass over a picture


def votes(
    gaussians: Gaussians,
    cameras: Sequence[Camera],
    pictures: Sequence[Array],
    *,
    pixel_weights: Sequence[Array | None] | None = None,
    num_threads: int | None = None,
) -> tuple[F64, F64]:
    """Sum the pixel values of each Gaussian, over all views.

    Args:
        gaussians: N Gaussians.
        cameras: V >= 1 views.
        pictures: V of [h, w, C], each in the size of its camera; C >= 1 is the same for all.
        pixel_weights: V of [h, w] >= 0, weight of each pixel, such as the alpha of its picture; None, or None
            for a view, for 1 everywhere.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        [N, C] the sums of blending weight x pixel weight x value, and [N] those of blending weight x pixel
        weight, in pixels: their quotient is the weighted mean. Both are 0 for invisible Gaussians.

    Raises:
        ValueError: if there is no view, numbers differ, or a picture has another size than its camera.
    """
    if not cameras:
        raise ValueError("votes: there must be at least one view, got none")
    if len(pictures) != len(cameras):
        raise ValueError(f"votes: there must be one picture a camera, got {len(pictures)} for {len(cameras)}")
    says = [None] * len(cameras) if pixel_weights is None else pixel_weights
    num_channels = pictures[0].shape[-1]
    sums, weights = np.zeros((len(gaussians), num_channels)), np.zeros(len(gaussians))
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel, num_threads=num_threads)
    plain = replace(gaussians, sh=gaussians.sh[:, :1])  # visibility does not depend on colors
    for camera, picture, say in zip(cameras, pictures, says, strict=True):
        size = f"{camera.height} {camera.width}"
        shares = np.ones(picture.shape[:2]) if say is None else say
        check("votes", pictures=(picture, f"{size} {num_channels}"), pixel_weights=(shares, size))
        boxes, _ = project_with(plain, camera, options)
        for first in range(0, num_channels, CHANNELS_AT_ONCE):
            some = picture[..., first : first + CHANNELS_AT_ONCE] * shares[..., None]
            count = some.shape[-1]
            some = np.pad(some, ((0, 0), (0, 0), (0, CHANNELS_AT_ONCE - count)))
            totals, areas = painted_sums(boxes, kernel, some, shares, num_threads=num_threads)
            sums[boxes.ids, first : first + count] += totals[:, :count]
        weights[boxes.ids] += areas
    return sums, weights
