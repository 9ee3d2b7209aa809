"""The definition of the picture: one stroke after another, float64, short, slow and obvious.

`brushgs.rasterize` must give the same picture, only faster; the tests and the benchmarks hold it to that.
"""

import numpy as np
from numpy.typing import NDArray

from brushgs.levels import axis_levels, level_coverage, level_index
from brushgs.raster.constants import GAUSSIAN_SIGMAS, MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE, Filter
from brushgs.scene import Boxes, Frame
from brushgs.textures import StrokeTexture

F64 = NDArray[np.float64]


def rasterize(boxes: Boxes, texture: StrokeTexture, *, height: int, width: int, filter: Filter = "mip") -> Frame:
    """Paint boxes, nearest first; arguments and result as `brushgs.rasterize`, always in float64.

    Source: Xiang et al. 2025, 3.4 (texture mapping); Kerbl et al. 2023 (blending and its thresholds).
    """
    rgb, depth = np.zeros((height, width, 3)), np.zeros((height, width))
    transmittance, is_open = np.ones((height, width)), np.ones((height, width), dtype=bool)
    columns = (boxes.centers, boxes.half_extents, boxes.angles, boxes.colors, boxes.opacities, boxes.depths)
    for center, half, angle, color, opacity, z in zip(*(c.astype(np.float64) for c in columns), strict=True):
        coverage, scale = _coverage_of_box(texture, half, filter)
        half = half * scale
        reach = np.abs([[np.cos(angle), np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ half
        low = np.clip(np.floor(center - reach), 0, (width, height)).astype(int)
        high = np.clip(np.ceil(center + reach), 0, (width, height)).astype(int)
        if (half <= 0).any() or (low >= high).any():
            continue
        window = np.s_[low[1] : high[1], low[0] : high[0]]
        y, x = np.mgrid[window] + 0.5
        s = (np.cos(angle) * (x - center[0]) + np.sin(angle) * (y - center[1])) / half[0]
        t = (np.cos(angle) * (y - center[1]) - np.sin(angle) * (x - center[0])) / half[1]
        is_inside = (np.abs(s) < 1) & (np.abs(t) < 1)
        alpha = np.where(is_inside, np.minimum(MAX_ALPHA, opacity * _sample(texture, coverage, s, t, filter)), 0)
        is_painted = is_open[window] & (alpha >= MIN_ALPHA)
        is_last = is_painted & (transmittance[window] * (1 - alpha) < MIN_TRANSMITTANCE)
        weight = np.where(is_painted & ~is_last, alpha * transmittance[window], 0)
        rgb[window] += weight[..., None] * color
        depth[window] += weight * z
        transmittance[window] -= weight
        is_open[window] &= ~is_last
    alpha = 1 - transmittance
    return Frame(rgb, alpha, np.divide(depth, alpha, out=np.zeros_like(depth), where=alpha > 0))


def _coverage_of_box(texture: StrokeTexture, half: F64, filter: Filter) -> tuple[NDArray[np.uint8], F64]:
    """The texels that serve a box of these half extents, and how much larger than it they reach, [2]."""
    if texture.kind != "image" or filter != "mip":
        return texture.coverage, np.ones(2)
    axes = [axis_levels(n) for n in reversed(texture.coverage.shape)]
    u, v = (
        level_index((n - 1) / (2 * h), len(levels)) if h > 0 else 0
        for n, h, levels in zip(reversed(texture.coverage.shape), half, axes, strict=True)
    )
    return level_coverage(texture.coverage, u, v), np.array([axes[0][u].scale, axes[1][v].scale])


def _sample(texture: StrokeTexture, coverage: NDArray[np.uint8], s: F64, t: F64, filter: Filter) -> F64:
    """Coverage 0 to 1 at (s, t) in -1 to 1 over the box."""
    if texture.kind == "gaussian":
        return np.asarray(np.exp(-0.5 * GAUSSIAN_SIGMAS**2 * (s * s + t * t)))
    if texture.kind == "ellipse":
        return np.where(s * s + t * t < 1, 1.0, 0.0)
    u, v = (np.clip((1 + a) / 2, 0, 1) * (n - 1) for a, n in ((s, coverage.shape[1]), (t, coverage.shape[0])))
    if filter == "nearest":
        return np.asarray(coverage[np.floor(v + 0.5).astype(int), np.floor(u + 0.5).astype(int)] / 255)
    row, column = np.floor(v).astype(int), np.floor(u).astype(int)
    next_row = np.minimum(row + 1, coverage.shape[0] - 1)
    next_column = np.minimum(column + 1, coverage.shape[1] - 1)
    fv, fu = v - row, u - column
    upper = (1 - fu) * coverage[row, column] + fu * coverage[row, next_column]
    lower = (1 - fu) * coverage[next_row, column] + fu * coverage[next_row, next_column]
    return np.asarray(((1 - fv) * upper + fv * lower) / 255)
