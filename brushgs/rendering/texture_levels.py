"""Brushes packed for the core: kernels, and the image levels that boxes need.

Texels of levels are defined in `brushgs.brushes.levels`; here they are packed, and cached per texture.
"""

from dataclasses import dataclass
from typing import TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.levels import (
    axis_levels,
    level_bounds,
    level_gradient,
    stroke_levels,
)
from brushgs.brushes.texture import StrokeTexture, Tint
from brushgs.core.native import core as _core
from brushgs.options.choices import Filter
from brushgs.rendering.relief import paint_height
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes

Code = tuple[int, int]  # the level along u and along v, see `level_coverage`


def kernel_of(brush_set: BrushSet, filter: Filter) -> _core.Kernel:
    """The core's kernel of a brush set."""
    if brush_set.kind == "gaussian":
        return _core.Kernel.gaussian
    if brush_set.kind == "ellipse":
        return _core.Kernel.ellipse
    return _core.Kernel.nearest if filter == "nearest" else _core.Kernel.bilinear


@dataclass(frozen=True, eq=False)
class TextureLevels:
    """The L levels of stroke images that a set of boxes needs; none for a built-in kernel.

    Attributes:
        packed: for the core, with the level of each box; grouped by brush.
        brushes: row of the brush, for each of L levels.
        codes: (level along u, level along v), for each of L.
        shapes: (rows, columns) of `packed`, for each of L; single rows or columns are doubled.
    """

    packed: _core.Levels
    brushes: list[int]
    codes: list[Code]
    shapes: list[tuple[int, int]]


def levels_for(
    where: str,
    boxes: Boxes,
    brush_set: BrushSet,
    filter: Filter,
    *,
    heights: bool = False,
    num_threads: int | None = None,
) -> TextureLevels:
    """The levels for these boxes; only the images themselves unless the filter is "mip".

    With `heights` they hold the paint's height beside its coverage. `num_threads` as for `rasterize`.

    Raises:
        ValueError: if a brush is beyond the set; the message starts with `where`.
    """
    of_box = np.empty(0, np.uint16)  # all boxes use the first level
    chosen: list[tuple[int, list[Code]]] = []  # brushes in use, and the codes of their levels
    rows = brush_set.rows_of(where, boxes.brushes)
    if rows is not None:
        of_box = np.zeros(len(boxes), np.uint16)
        first = 0
        for brush in np.flatnonzero(np.bincount(rows, minlength=1)).tolist():
            own = np.flatnonzero(rows == brush)
            codes, level = _levels_of(boxes.half_extents[own], brush_set.textures[brush], filter)
            of_box[own] = first + level if len(level) else first
            chosen.append((brush, codes))
            first += len(codes)
    elif brush_set.kind == "image":
        codes, of_box = _levels_of(boxes.half_extents, brush_set.textures[0], filter)
        chosen.append((0, codes))
    packed: list[_Packed] = []
    tints, steps = _tints_of(brush_set, chosen, num_threads)
    with_heights: list[NDArray[np.uint32]] = []
    reaches = []
    for brush, codes in chosen:
        texture = brush_set.textures[brush]
        height, width = texture.coverage.shape
        with_heights += _with_heights(texture, codes, num_threads) if heights else []
        packed += _packed_levels(texture, codes, num_threads)
        reaches += [(axis_levels(width)[u].scale, axis_levels(height)[v].scale) for u, v in codes]
    shapes = [shape for _, shape in packed]
    levels = _core.Levels(
        pairs=[pairs for pairs, _ in packed],
        sizes=np.array([shape[::-1] for shape in shapes], np.int32).reshape(-1, 2),
        reaches=np.array(reaches, np.float64).reshape(-1, 2),
        of_box=of_box,
        pairs_with_height=with_heights,
        tints=tints,
        tint_steps=np.array(steps, np.float64),
    )
    brushes = [brush for brush, codes in chosen for _ in codes]
    return TextureLevels(levels, brushes, [code for _, codes in chosen for code in codes], shapes)


def count_levels(boxes: Boxes, brush_set: BrushSet) -> tuple[int, int]:
    """Number of levels that these boxes need with `filter="mip"`, and number of all levels."""
    most = 0
    for texture in brush_set.textures:
        rows, columns = texture.coverage.shape
        most += len(axis_levels(columns)) * len(axis_levels(rows))
    return len(levels_for("count_levels", boxes, brush_set, "mip").codes), most


def coverage_gradients(brush_set: BrushSet, levels: TextureLevels, v_texels: list[F64]) -> tuple[F64, ...]:
    """Gradient by the coverage [h, w] of each brush, from those by the packed texels of each level."""
    totals = tuple(np.zeros(texture.coverage.shape) for texture in brush_set.textures)
    for brush, code, values in zip(levels.brushes, levels.codes, v_texels, strict=True):
        coverage = brush_set.textures[brush].coverage
        for axis in (0, 1):  # single texels were doubled
            if coverage.shape[axis] == 1:
                values = values.sum(axis, keepdims=True)
        totals[brush][...] += level_gradient(coverage, *code, values)
    return totals


def _levels_of(
    half_extents: Array, texture: StrokeTexture, filter: Filter
) -> tuple[list[Code], NDArray[np.uint16]]:
    """Levels used by boxes of one brush, ascending, and the row of each box (no rows: the first for all)."""
    if filter != "mip":
        return [(0, 0)], np.empty(0, np.uint16)
    rows, columns = texture.coverage.shape
    used, of_box = _core.choose_levels(
        half_extents=half_extents, bounds_u=level_bounds(columns), bounds_v=level_bounds(rows)
    )
    num_levels_v = len(axis_levels(rows))
    return [divmod(int(code), num_levels_v) for code in used], of_box


T = TypeVar("T", bound=np.generic)
_Packed = tuple[NDArray[np.uint16], tuple[int, int]]  # texels, and their rows and columns
_cache: WeakKeyDictionary[StrokeTexture, dict[Code, _Packed]] = WeakKeyDictionary()


def _packed_levels(
    texture: StrokeTexture, codes: list[Code], num_threads: int | None = None
) -> list[_Packed]:
    """Packed levels; missing ones are made together."""
    of_texture = _cache.setdefault(texture, {})
    missing = sorted(code for code in codes if code not in of_texture)
    made = stroke_levels(texture.coverage, missing, num_threads=num_threads)
    for code, (coverage, _) in zip(missing, made, strict=True):
        of_texture[code] = _packed(coverage)
    return [of_texture[code] for code in codes]


_height_cache: WeakKeyDictionary[StrokeTexture, dict[Code, NDArray[np.uint32]]] = WeakKeyDictionary()


def _with_heights(
    texture: StrokeTexture, codes: list[Code], num_threads: int | None
) -> list[NDArray[np.uint32]]:
    """Packed levels with heights.

    Missing ones are made together, and cached for `_packed_levels` too.
    """
    of_texture, flat = _height_cache.setdefault(texture, {}), _cache.setdefault(texture, {})
    missing = sorted(code for code in codes if code not in of_texture)
    height = paint_height(texture) if missing and texture.height is not None else None
    made = stroke_levels(texture.coverage, missing, height, num_threads=num_threads)
    for code, (paint, raised) in zip(missing, made, strict=True):
        pairs, shape = _packed(paint)
        heights = pairs if raised is None else _packed(raised)[0]
        flat[code] = pairs, shape
        of_texture[code] = pairs | heights.astype(np.uint32) << np.uint32(16)
    return [of_texture[code] for code in codes]


def _tints_of(
    brush_set: BrushSet, chosen: list[tuple[int, list[Code]]], num_threads: int | None
) -> tuple[list[NDArray[np.uint32] | None], list[float]]:
    """The colours and their steps of each level of brushes; empty where no brush has colours."""
    tints: list[NDArray[np.uint32] | None] = []
    steps: list[float] = []
    if all(brush_set.textures[brush].tint is None for brush, _ in chosen):
        return tints, steps
    for brush, codes in chosen:
        texture = brush_set.textures[brush]
        tint = texture.tint
        tints += [None] * len(codes) if tint is None else _packed_tints(texture, codes, num_threads)
        steps += [0.0 if tint is None else tint.step] * len(codes)
    return tints, steps


_tint_cache: WeakKeyDictionary[Tint, dict[Code, NDArray[np.uint32]]] = WeakKeyDictionary()


def _packed_tints(
    texture: StrokeTexture, codes: list[Code], num_threads: int | None
) -> list[NDArray[np.uint32]]:
    """Levels of the colours of a brush as the core reads them: a word a texel."""
    assert texture.tint is not None, "only of coloured brushes"
    of_tint = _tint_cache.setdefault(texture.tint, {})
    missing = sorted(code for code in codes if code not in of_tint)
    for code, channels in zip(missing, tint_levels(texture, missing, num_threads), strict=True):
        words = np.zeros(channels.shape[:2], np.uint32)
        for c in range(3):
            words |= channels[..., c].astype(np.uint32) << np.uint32(8 * c)
        words = _doubled(words)
        of_tint[code] = np.append(np.concatenate([words, words[-1:]]).ravel(), np.uint32(0))
    return [of_tint[code] for code in codes]


def tint_levels(
    texture: StrokeTexture, codes: list[Code], num_threads: int | None = None
) -> list[NDArray[np.uint8]]:
    """[rows, columns, 3] the colours of a brush in levels: means over the paint, none where there is none."""
    assert texture.tint is not None, "only of coloured brushes"
    planes = []
    for c in range(3):
        plane = np.ascontiguousarray(texture.tint.texels[..., c])
        planes.append(stroke_levels(texture.coverage, codes, plane, num_threads=num_threads))
    return [
        np.stack([found for _, found in of_code if found is not None], axis=-1)
        for of_code in zip(*planes, strict=True)
    ]


def _doubled(texels: NDArray[T]) -> NDArray[T]:
    """Texels with single rows and columns twice: bilinear sampling needs two."""
    for axis in (0, 1):
        if texels.shape[axis] == 1:
            texels = np.repeat(texels, 2, axis)
    return texels


def _packed(coverage: NDArray[np.uint8]) -> _Packed:
    """One packed level: each texel paired with the one below."""
    texels = _doubled(coverage.astype(np.uint16))
    below = np.concatenate([texels[1:], texels[-1:]])
    pairs = np.append((texels | below << 8).ravel(), np.uint16(0))
    return pairs, (texels.shape[0], texels.shape[1])
