"""A stroke's coverage, filtered in advance for small boxes: what `filter="mip"` samples.

A stroke image of 256 texels on a box 20 pixels long, sampled once a pixel, meets every twelfth texel and
shimmers. The footprint of a pixel is the same all over a stroke, so each axis of the image is filtered on
its own (a ripmap) and the sampler stays what it is: bilinear, one lookup. This file knows which level
serves which size and what its texels are; the rasteriser chooses the level of each stroke.

How to draw a box of half extents (h_u, h_v) pixels with the mip filter:

1. per axis, with n texels: `k = level_index(h, n)`;
2. `texels = level_coverage(coverage, k_u, k_v)`, uint8 [v.num_texels, u.num_texels];
3. sample it like a source image (t = 0 and 1 on the centres of the outermost texels, bilinear, 0 outside)
   in a box whose half extents are `h_u * u.scale` and `h_v * v.scale`, the centre and angle unchanged.

The enlarged box (by half a pixel on either side, roughly) holds the soft edge: a pixel that lies half
outside of the original box must be half painted. Level 0 of an axis is the source with scale 1.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.native import core as _core

# Below 0.85 texels a pixel (a magnified stroke) bilinear interpolation itself is as smooth as the filter.
FIRST_FOOTPRINT = 0.85
LEVELS_PER_OCTAVE = 2
# Texels a pixel that a level keeps at least; at most sqrt(2) times as many. Measured on bristles and
# swirls of 3-100 px: error against 8 x 8 samples, relative to bilinear, 0.39-0.57 at 1, 0.19-0.40 at 1.4,
# 0.12-0.25 at 1.7, 0.12-0.24 at 2.
TEXELS_PER_PIXEL = 1.7
# Half the width of the pixel's filter, as far as the soft edge is worth painting (0.7 adds nothing).
MARGIN_PIXELS = 0.45
# A box shorter than this, in pixels, is drawn with the level of this length: the projection's low-pass
# keeps every box of the default settings above 2.2 px.
SHORTEST_BOX = 0.25
_QUADRATURE = 4  # midpoints on each side of a texel's hat
_FAINT_PAINT = 2.0  # of 255: the height of less is mostly noise, and fades to none
_TOO_SMALL = 1e-6  # a weight; 255 texels of it stay far below half a step of 8 bits


@dataclass(frozen=True)
class AxisLevel:
    """One axis of one level.

    Attributes:
        num_texels: texels along the axis, margins included.
        scale: length of the box that these texels span, relative to the stroke's box, >= 1.
        footprint: source texels in the pixel that the level was filtered for; 0 for the source itself.
        largest_box: half extent, in pixels, of the largest box that the level serves.
    """

    num_texels: int
    scale: float
    footprint: float
    largest_box: float


@lru_cache(maxsize=64)
def axis_levels(num_texels: int) -> tuple[AxisLevel, ...]:
    """The levels of an axis of `num_texels` source texels, finest first, half an octave apart.

    Raises:
        ValueError: if `num_texels` is below 1.
    """
    if num_texels < 1:
        raise ValueError(f"axis_levels: num_texels must be at least 1, got {num_texels}")
    levels = [AxisLevel(num_texels, 1.0, 0.0, np.inf)]
    smallest = FIRST_FOOTPRINT  # the footprint from which on the level is used
    while num_texels > 1 and smallest <= (num_texels - 1) / SHORTEST_BOX:
        footprint = smallest * 2 ** (0.5 / LEVELS_PER_OCTAVE)
        steps = min(num_texels - 1, int(np.ceil(TEXELS_PER_PIXEL * (num_texels - 1) / smallest)))
        margin = int(np.ceil(MARGIN_PIXELS * footprint * steps / (num_texels - 1)))
        largest_box = (num_texels - 1) / (2 * smallest)
        levels.append(AxisLevel(steps + 1 + 2 * margin, 1 + 2 * margin / steps, footprint, largest_box))
        smallest *= 2 ** (1 / LEVELS_PER_OCTAVE)
    return tuple(levels)


@lru_cache(maxsize=64)
def level_bounds(num_texels: int) -> NDArray[np.float64]:
    """The largest half extents, in pixels, that levels 1, 2, ... serve, descending; read-only."""
    bounds = np.array([level.largest_box for level in axis_levels(num_texels)[1:]])
    bounds.flags.writeable = False
    return bounds


def level_index(half_extent: float, num_texels: int) -> int:
    """The level that serves a box of this half extent in pixels: 0 is the source, larger is coarser."""
    return int(np.count_nonzero(half_extent <= level_bounds(num_texels)))


def level_coverage(coverage: NDArray[np.uint8], level_u: int, level_v: int) -> NDArray[np.uint8]:
    """The texels of one level: the source filtered along u (columns) and v (rows).

    Args:
        coverage: uint8 [h, w] source, 255 = full paint.
        level_u: index into `axis_levels(w)`.
        level_v: index into `axis_levels(h)`.

    Returns:
        uint8 [axis_levels(h)[level_v].num_texels, axis_levels(w)[level_u].num_texels]; the source itself
        for levels (0, 0).
    """
    if level_u == 0 and level_v == 0:
        return coverage
    return filtered_along_v(filtered_along_u(coverage, level_u), level_v)


def level_height(
    height: NDArray[np.uint8], coverage: NDArray[np.uint8], level_u: int, level_v: int
) -> NDArray[np.uint8]:
    """The texels of one level of the height of the paint: its mean over the paint, 1/2 where there is none.

    A pixel sees the height of the paint in it, not of the gaps between bristles; so heights are weighted by
    coverage.

    Args:
        height: uint8 [h, w] source, 255 = 1.
        coverage: uint8 [h, w] where the paint is, 255 = full.
        level_u: as for `level_coverage`.
        level_v: as for `level_coverage`.

    Returns:
        uint8 like `level_coverage`; the source itself for levels (0, 0).
    """
    if level_u == 0 and level_v == 0:
        return height
    along_u = filtered_along_u(coverage, level_u), raised_along_u(height, coverage, level_u)
    return height_along_v(*along_u, level_v)


def raised_along_u(
    height: NDArray[np.uint8], coverage: NDArray[np.uint8], level_u: int
) -> NDArray[np.float64]:
    """Beside `filtered_along_u`, the height over 1/2 times coverage: the first half of `level_height`."""
    return _along_u(np.asarray((height - 127.5) * coverage, np.float64), level_u)


def height_along_v(
    coverage: NDArray[np.float64], raised: NDArray[np.float64], level_v: int
) -> NDArray[np.uint8]:
    """The second half of `level_height`, from `filtered_along_u` and `raised_along_u`."""
    paint, above = _along_v(coverage, level_v), _along_v(raised, level_v)
    mean = 127.5 + above / np.maximum(paint, _FAINT_PAINT)
    return np.asarray(np.clip(np.rint(mean), 0, 255).astype(np.uint8))


def level_gradient(
    coverage: NDArray[np.uint8], level_u: int, level_v: int, v_texels: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The derivative of `level_coverage`: the gradient of a loss by the source from that by a level's texels.

    Rounding to 8 bits counts as the identity. A texel that was clipped to 0 to 255 has no gradient.

    Args:
        coverage: uint8 [h, w] source.
        level_u: index into `axis_levels(w)`.
        level_v: index into `axis_levels(h)`.
        v_texels: [rows, columns] like the level, in units of the loss by any unit of coverage.

    Returns:
        [h, w] in the same unit.
    """
    if level_u == 0 and level_v == 0:
        return v_texels
    height, width = coverage.shape
    texels = unrounded_coverage(coverage, level_u, level_v)
    v_texels = np.where((texels >= 0) & (texels <= 255), v_texels, 0.0)
    if level_v:
        v_texels = _level_matrix(height, level_v).T @ v_texels
    if level_u:
        v_texels = (_level_matrix(width, level_u).T @ v_texels.T).T
    return np.asarray(v_texels)


def unrounded_coverage(coverage: NDArray[np.uint8], level_u: int, level_v: int) -> NDArray[np.float64]:
    """`level_coverage` before it is rounded and clipped to 8 bits."""
    return _along_v(filtered_along_u(coverage, level_u), level_v)


def filtered_along_u(coverage: NDArray[np.uint8], level_u: int) -> NDArray[np.float64]:
    """The first half of `level_coverage`, which all its levels of one `level_u` share."""
    return _along_u(coverage.astype(np.float64), level_u)


def _along_u(texels: NDArray[np.float64], level_u: int) -> NDArray[np.float64]:
    if level_u == 0:
        return texels
    return np.ascontiguousarray(_filtered(np.ascontiguousarray(texels.T), level_u).T)


def filtered_along_v(texels: NDArray[np.float64], level_v: int) -> NDArray[np.uint8]:
    """The second half of `level_coverage`, from the result of `filtered_along_u`."""
    return np.asarray(np.clip(np.rint(_along_v(texels, level_v)), 0, 255).astype(np.uint8))


def _along_v(texels: NDArray[np.float64], level_v: int) -> NDArray[np.float64]:
    """`filtered_along_v` before it is rounded and clipped to 8 bits."""
    return _filtered(texels, level_v) if level_v else texels


def _filtered(texels: NDArray[np.float64], level: int) -> NDArray[np.float64]:
    """Columns of texels filtered for a level."""
    weights = _level_matrix(len(texels), level)
    result = np.empty((len(weights), texels.shape[1]))
    _core.filter_rows(weights=weights, texels=texels, result=result)
    return result


@lru_cache(maxsize=128)
def _level_matrix(num_source: int, level: int) -> NDArray[np.float64]:
    """[num_texels, num_source]: source texels -> texels of a level.

    The target is the source's linear interpolant, 0 outside, averaged over a pixel. The level's texels are
    those whose own linear interpolant comes closest to it in the least-squares sense: interpolation blurs,
    and the projection undoes as much of that as it can (a sampled box filter leaves a third more error).
    Weights fall by a factor of 3.7 from one texel to the next, so most are too small to show and become 0.
    Source: Unser, Sampling - 50 Years After Shannon, 2000 (least-squares spline approximation).
    """
    axis = axis_levels(num_source)[level]
    spacing = (num_source - 1) * axis.scale / (axis.num_texels - 1)  # source texels between two texels
    centers = (np.arange(axis.num_texels) - (axis.num_texels - 1) / 2) * spacing + (num_source - 1) / 2
    moments = np.zeros((axis.num_texels, num_source))
    for step in range(-_QUADRATURE, _QUADRATURE):
        offset = (step + 0.5) / _QUADRATURE
        columns, mean = _pixel_mean(num_source, centers + offset * spacing, axis.footprint)
        mean[0 if offset < 0 else -1] = 0
        np.add.at(
            moments, (np.arange(len(moments))[:, None], columns), (1 - abs(offset)) / _QUADRATURE * mean
        )
    matrix = _solve_gram(moments)
    return np.where(np.abs(matrix) < _TOO_SMALL, 0.0, matrix)


def _solve_gram(moments: NDArray[np.float64]) -> NDArray[np.float64]:
    """The solution of G x = moments, G the Gram matrix of hat functions: 2/3, and 1/6 between neighbours.

    By the Thomas algorithm. SciPy's solver gives the same, but importing SciPy takes longer than all levels.
    """
    diagonal, beside, x = np.full(len(moments), 2 / 3), 1 / 6, moments.copy()
    diagonal[[0, -1]] = 1 / 3  # the outermost hats are halves: nothing is drawn beyond them
    for row in range(1, len(x)):
        factor = beside / diagonal[row - 1]
        diagonal[row] -= factor * beside
        x[row] -= factor * x[row - 1]
    x[-1] /= diagonal[-1]
    for row in range(len(x) - 2, -1, -1):
        x[row] = (x[row] - beside * x[row + 1]) / diagonal[row]
    return x


def _pixel_mean(
    num_source: int, centers: NDArray[Any], footprint: float
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Weights of the source texels in the mean over a pixel at each centre.

    Returns:
        [len(centers), n] source texels, all that have a weight among them, and their weights. Texels outside
        the source stand for its first and last one, with a weight of 0.
    """
    reach = int(np.ceil(footprint / 2)) + 1
    columns = np.rint(centers).astype(np.intp)[:, None] + np.arange(-reach, reach + 1)

    def integral(x: NDArray[Any]) -> NDArray[np.float64]:
        """Each texel's hat function, clipped at the ends of the box, integrated from the left up to x."""
        inside = np.clip(x, 0, num_source - 1)[:, None] - columns
        inside = np.clip(inside, -1, 1)
        return np.asarray(0.5 + inside - 0.5 * inside * np.abs(inside))

    weights = (integral(centers + footprint / 2) - integral(centers - footprint / 2)) / footprint
    weights[(columns < 0) | (columns >= num_source)] = 0
    return np.clip(columns, 0, num_source - 1), weights
