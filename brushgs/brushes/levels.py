"""A stroke's coverage, filtered in advance for small boxes: what `filter="mip"` samples.

A stroke image of 256 texels on a box 20 pixels long, sampled once per pixel, uses every twelfth texel and
shimmers. The footprint of a pixel is constant over a stroke, so each axis is filtered on its own (a ripmap),
and sampling stays one bilinear lookup. This file defines the levels and their texels; the rasterizer chooses
the level of each stroke.

How to draw a box of half extents (h_u, h_v) pixels with the mip filter:

1. per axis, with n texels: `k = level_index(h, n)`;
2. `texels = level_coverage(coverage, k_u, k_v)`, uint8 [v.num_texels, u.num_texels];
3. sample it like a source image (t = 0 and 1 on the centers of the outermost texels, bilinear, 0 outside)
   in a box whose half extents are `h_u * u.scale` and `h_v * v.scale`, the center and angle unchanged.

The enlarged box (by about half a pixel on either side) contains the soft edge: a pixel half outside of the
original box is half painted. Level 0 of an axis is the source with scale 1.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default

# Below 0.85 texels per pixel (a magnified stroke) bilinear interpolation is as smooth as the filter.
FIRST_FOOTPRINT = 0.85
LEVELS_PER_OCTAVE = 2
# Minimum texels per pixel of a level; the maximum is sqrt(2) times that. Measured on bristles and swirls of
# 3-100 px: error against 8 x 8 samples, relative to bilinear, 0.39-0.57 at 1, 0.19-0.40 at 1.4, 0.12-0.25 at
# 1.7, 0.12-0.24 at 2.
TEXELS_PER_PIXEL = 1.7
# Half width of the pixel filter up to which the soft edge is painted (0.7 adds nothing).
MARGIN_PIXELS = 0.45
# A box shorter than this, in pixels, is drawn with the level of this length: the projection's low-pass
# keeps every box of the default settings above 2.2 px.
SHORTEST_BOX = 0.25


@dataclass(frozen=True)
class AxisLevel:
    """One axis of one level.

    Attributes:
        num_texels: texels along the axis, margins included.
        scale: length of the box that these texels span, relative to the stroke's box, >= 1.
        footprint: source texels per pixel that the level is filtered for; 0 for the source itself.
        largest_box: half extent of the largest box that uses the level, pixels.
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
    smallest = FIRST_FOOTPRINT  # smallest footprint of the level
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
    """Largest half extents for levels 1, 2, ..., pixels, descending; read-only."""
    bounds = np.array([level.largest_box for level in axis_levels(num_texels)[1:]])
    bounds.flags.writeable = False
    return bounds


def level_index(half_extent: float, num_texels: int) -> int:
    """The level for a box of this half extent in pixels: 0 is the source, larger is coarser."""
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
    return stroke_levels(coverage, [(level_u, level_v)])[0][0]


def level_height(
    height: NDArray[np.uint8], coverage: NDArray[np.uint8], level_u: int, level_v: int
) -> NDArray[np.uint8]:
    """The texels of one level of the paint's height: the mean weighted by coverage, 1/2 without paint.

    The weighting leaves out the gaps between bristles.

    Args:
        height: uint8 [h, w] source, 255 = 1.
        coverage: uint8 [h, w] paint mask, 255 = full.
        level_u: as for `level_coverage`.
        level_v: as for `level_coverage`.

    Returns:
        uint8 like `level_coverage`; the source itself for levels (0, 0).
    """
    found = stroke_levels(coverage, [(level_u, level_v)], height)[0][1]
    assert found is not None
    return found


def stroke_levels(
    coverage: NDArray[np.uint8],
    codes: list[tuple[int, int]],
    height: NDArray[np.uint8] | None = None,
    *,
    num_threads: int | None = None,
) -> list[tuple[NDArray[np.uint8], NDArray[np.uint8] | None]]:
    """`level_coverage` and, with a height, `level_height` for several levels at once.

    Args:
        coverage: uint8 [h, w] source.
        codes: (level along u, level along v) of each; consecutive codes of equal u share half of the work.
        height: uint8 [h, w] source, or None.
        num_threads: None takes the processors available to this process. The result does not depend on it.
    """
    rows, columns = coverage.shape
    made = [code for code in codes if code != (0, 0)]
    shapes = [(axis_levels(rows)[v].num_texels, axis_levels(columns)[u].num_texels) for u, v in made]
    coverages = [np.empty(shape, np.uint8) for shape in shapes]
    heights = [] if height is None else [np.empty(shape, np.uint8) for shape in shapes]
    if made:
        us, vs = (sorted(set(levels)) for levels in zip(*made, strict=True))
        _core.fill_levels(
            coverage=np.ascontiguousarray(coverage),
            height=None if height is None else np.ascontiguousarray(height),
            along_u=[_level_filter(columns, level) for level in us],
            along_v=[_level_filter(rows, level) for level in vs],
            codes=np.array([(us.index(u), vs.index(v)) for u, v in made], np.int32),
            coverages=coverages,
            heights=heights,
            num_threads=num_threads_or_default(num_threads),
        )
    levels = dict(zip(made, zip_longest(coverages, heights), strict=True))
    return [levels.get(code, (coverage, height)) for code in codes]


def level_gradient(
    coverage: NDArray[np.uint8], level_u: int, level_v: int, v_texels: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The derivative of `level_coverage`: gradient of a loss by the source, given that by the texels of a
    level.

    Rounding to 8 bits counts as the identity. Texels clipped to 0 to 255 have no gradient.

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
        v_texels = _level_filter(height, level_v).weights().T @ v_texels
    if level_u:
        v_texels = (_level_filter(width, level_u).weights().T @ v_texels.T).T
    return np.asarray(v_texels)


def unrounded_coverage(coverage: NDArray[np.uint8], level_u: int, level_v: int) -> NDArray[np.float64]:
    """`level_coverage` before it is rounded and clipped to 8 bits."""
    texels = coverage.astype(np.float64)
    if level_u:
        texels = _filtered(np.ascontiguousarray(texels.T), level_u).T
    return _filtered(np.ascontiguousarray(texels), level_v) if level_v else np.asarray(texels)


def _filtered(texels: NDArray[np.float64], level: int) -> NDArray[np.float64]:
    """Columns of texels filtered for a level."""
    result = np.empty((axis_levels(len(texels))[level].num_texels, texels.shape[1]))
    _level_filter(len(texels), level).apply(texels=texels, result=result)
    return result


@lru_cache(maxsize=256)
def _level_filter(num_source: int, level: int) -> _core.LevelFilter:
    """Source texels -> texels of a level, along one axis."""
    axis = axis_levels(num_source)[level]
    return _core.LevelFilter(
        num_source=num_source, num_texels=axis.num_texels, scale=axis.scale, footprint=axis.footprint
    )
