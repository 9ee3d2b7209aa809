"""The second yardstick of the raster benchmark: strokes in NumPy, one at a time on its bounding box, float32.

As fast as plain NumPy seems to get without compiling: windows only, no copies of the picture, and strokes
on finished ground are skipped early.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.rendering.constants import MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE
from brushgs.values.boxes import Boxes

F32 = NDArray[np.float32]


def paint(
    boxes: Boxes, coverage: NDArray[np.uint8], *, width: int, height: int, count: bool = False
) -> tuple[F32, F32, int]:
    """Paint as `filter="bilinear"` does, without depth.

    Args:
        boxes: nearest first.
        coverage: [h, w] stroke image, both sides >= 2.
        width: pixels.
        height: pixels.
        count: count the fragments: pixel centers inside a box whose pixel is not finished. Takes time.

    Returns:
        Premultiplied rgb [H, W, 3], transmittance [H, W], fragments visited (0 without `count`).
    """
    rgb = np.zeros((height, width, 3), np.float32)
    transmittance, is_open = np.ones((height, width), np.float32), np.ones((height, width), bool)
    rows, columns = coverage.shape
    texels = coverage.ravel().astype(np.float32) / np.float32(255)
    x_all, y_all = (
        np.arange(width, dtype=np.float32) + 0.5,
        np.arange(height, dtype=np.float32)[:, None] + 0.5,
    )
    cos, sin = np.cos(boxes.angles), np.sin(boxes.angles)
    half_u, half_v = boxes.half_extents.T
    reach = np.stack(
        [np.abs(cos) * half_u + np.abs(sin) * half_v, np.abs(sin) * half_u + np.abs(cos) * half_v], axis=1
    )
    low = np.clip(np.ceil(boxes.centers - reach - 0.5), 0, (width, height)).astype(int)
    high = np.clip(np.floor(boxes.centers + reach - 0.5) + 1, 0, (width, height)).astype(int)
    per_u, per_v = (0.5 * (n - 1) / h for n, h in ((columns, half_u), (rows, half_v)))
    num_fragments = 0
    for i in np.flatnonzero((low < high).all(axis=1)):
        (left, top), (right, bottom) = low[i], high[i]
        window = np.s_[top:bottom, left:right]
        dx, dy = x_all[left:right] - boxes.centers[i, 0], y_all[top:bottom] - boxes.centers[i, 1]
        u = (cos[i] * dx + sin[i] * dy + half_u[i]) * per_u[i]
        v = (cos[i] * dy - sin[i] * dx + half_v[i]) * per_v[i]
        is_visited = (u > 0) & (u < columns - 1) & (v > 0) & (v < rows - 1) & is_open[window]
        y, x = np.nonzero(is_visited)
        if count:
            num_fragments += len(y)
        if len(y) == 0:
            continue
        u, v = u[y, x], v[y, x]
        column, row = np.minimum(u.astype(int), columns - 2), np.minimum(v.astype(int), rows - 2)
        fu, fv, texel = u - column, v - row, row * columns + column
        upper = texels[texel] + fu * (texels[texel + 1] - texels[texel])
        texel += columns
        lower = texels[texel] + fu * (texels[texel + 1] - texels[texel])
        alpha = np.minimum(MAX_ALPHA, boxes.opacities[i] * (upper + fv * (lower - upper)))
        y, x = y + top, x + left
        before = transmittance[y, x]
        weight = np.where(alpha >= MIN_ALPHA, alpha * before, 0).astype(np.float32)
        is_last = before - weight < MIN_TRANSMITTANCE
        weight[is_last] = 0
        is_open[y[is_last], x[is_last]] = False
        transmittance[y, x] = before - weight
        rgb[y, x] += weight[:, None] * boxes.colors[i]
    return rgb, transmittance, num_fragments
