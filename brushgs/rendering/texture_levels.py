"""Brushes packed for the core: kernels, and the image levels that boxes need.

Texels of levels are defined in `brushgs.brushes.levels`; here they are packed, and cached per texture.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar
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
from brushgs.core.threads import side_by_side
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
    chosen, of_box = _chosen(where, boxes, brush_set, filter)
    wanted = [(brush_set.textures[brush], codes) for brush, codes in chosen]

    def made(one: tuple[StrokeTexture, list[Code]]) -> list[Level]:
        return packed_levels(*one, heights=heights, num_threads=num_threads)

    side_by_side(made, (one for one in wanted if _missing(*one, heights)), num_threads)
    found = [level for one in wanted for level in made(one)]
    brushes = [brush for brush, codes in chosen for _ in codes]
    levels = _packed(found, [brush_set.textures[brush].tint for brush in brushes], of_box, heights)
    all_codes = [code for _, codes in chosen for code in codes]
    return TextureLevels(levels, brushes, all_codes, [level.shape for level in found])


def _packed(
    found: Sequence["Level"], tints: Sequence[Tint | None], of_box: NDArray[np.uint16], heights: bool
) -> _core.Levels:
    """Levels as the core takes them; `tints` are those of their brushes."""
    asked = found if heights else []
    with_heights = [pairs for level in asked if (pairs := level.pairs_with_height) is not None]
    is_colored = any(tint is not None for tint in tints)
    return _core.Levels(
        pairs=[level.pairs for level in found],
        sizes=np.array([level.shape[::-1] for level in found], np.int32).reshape(-1, 2),
        reaches=np.array([level.reaches for level in found], np.float64).reshape(-1, 2),
        of_box=of_box,
        pairs_with_height=with_heights,
        tints=[level.tints for level in found] if is_colored else [],
        tint_steps=np.array([0.0 if tint is None else tint.step for tint in tints] if is_colored else []),
    )


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


def _chosen(
    where: str, boxes: Boxes, brush_set: BrushSet, filter: Filter
) -> tuple[list[tuple[int, list[Code]]], NDArray[np.uint16]]:
    """Brushes in use with the codes of their levels, and each box's row among these; none: all the first."""
    rows = brush_set.rows_of(where, boxes.brushes)
    if rows is None:
        if brush_set.kind != "image":
            return [], np.empty(0, np.uint16)  # all boxes use the first level
        codes, of_box = _levels_of(boxes.half_extents, brush_set.textures[0], filter)
        return [(0, codes)], of_box
    chosen: list[tuple[int, list[Code]]] = []
    by_brush = np.argsort(rows, kind="stable")
    counts = np.bincount(rows, minlength=1)
    half_extents, in_order = boxes.half_extents[by_brush], np.zeros(len(boxes), np.uint16)
    first, ends = 0, np.cumsum(counts)
    for brush in np.flatnonzero(counts).tolist():
        own = slice(ends[brush] - counts[brush], ends[brush])
        codes, level = _levels_of(half_extents[own], brush_set.textures[brush], filter)
        in_order[own] = first + level if len(level) else first
        chosen.append((brush, codes))
        first += len(codes)
    of_box = np.empty_like(in_order)
    of_box[by_brush] = in_order
    return chosen, of_box


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


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """A level of a brush as the core reads it, see raster.hpp.

    Attributes:
        pairs: texels, each paired with the one below.
        shape: rows and columns; single ones are doubled.
        reaches: half extents along u and v, in those of the box.
        pairs_with_height: the same with the height of the paint; None where nobody asked for it.
        tints: of a colored brush, its colors: a word a texel.
    """

    pairs: NDArray[np.uint16]
    shape: tuple[int, int]
    reaches: tuple[float, float]
    pairs_with_height: NDArray[np.uint32] | None
    tints: NDArray[np.uint32] | None


Levels = Mapping[Code, Level]
_cache: WeakKeyDictionary[StrokeTexture, dict[Code, Level]] = WeakKeyDictionary()


def _none(texture: StrokeTexture) -> Levels:
    return {}


_find: Callable[[StrokeTexture], Levels] = _none


@contextmanager
def found_by(find: Callable[[StrokeTexture], Levels]) -> Iterator[None]:
    """Within the block, levels of a texture that has none yet are first asked from a function."""
    global _find
    before, _find = _find, find
    try:
        yield
    finally:
        _find = before


def known_levels(texture: StrokeTexture) -> Levels:
    """The levels of a texture that were made or found so far."""
    return _cache.get(texture, {})


def as_arrays(levels: Levels) -> dict[str, NDArray[Any]]:
    """Levels, without tints, as arrays for a file."""
    raised = {code: one for code, one in levels.items() if one.pairs_with_height is not None}
    flat = {code: one for code, one in levels.items() if code not in raised}
    ordered = [*raised.items(), *flat.items()]
    words = [one.pairs_with_height for one in raised.values() if one.pairs_with_height is not None]
    pairs = [one.pairs for one in flat.values()]
    return {
        "codes": np.array([code for code, _ in ordered], np.int64).reshape(-1, 2),
        "shapes": np.array([one.shape for _, one in ordered], np.int64).reshape(-1, 2),
        "reaches": np.array([one.reaches for _, one in ordered], np.float64).reshape(-1, 2),
        "words": np.concatenate([np.empty(0, np.uint32), *words]),
        "pairs": np.concatenate([np.empty(0, np.uint16), *pairs]),
    }


def of_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[Code, Level]:
    """The inverse of `as_arrays`."""
    words, shapes = arrays["words"], [(rows, columns) for rows, columns in arrays["shapes"].tolist()]
    pairs = np.concatenate([words.astype(np.uint16), arrays["pairs"]])  # the low half of words
    levels, start = {}, 0
    for (u, v), shape, (along, across) in zip(
        arrays["codes"].tolist(), shapes, arrays["reaches"].tolist(), strict=True
    ):
        own = slice(start, start := start + shape[0] * shape[1] + 1)
        raised = words[own] if start <= len(words) else None
        levels[u, v] = Level(pairs[own], shape, (along, across), raised, None)
    return levels


def packed_levels(
    texture: StrokeTexture, codes: list[Code], *, heights: bool = False, num_threads: int | None = None
) -> list[Level]:
    """Levels of a brush, with heights where they are asked for; missing ones are made together."""
    if missing := _missing(texture, codes, heights):
        _cache[texture] |= zip(missing, _made(texture, missing, heights, num_threads), strict=True)
    return [_cache[texture][code] for code in codes]


def _missing(texture: StrokeTexture, codes: list[Code], heights: bool) -> list[Code]:
    """Those of the codes whose levels are neither made nor found yet, in order."""
    known = _cache.get(texture)
    if known is None:
        known = _cache.setdefault(texture, dict(_find(texture)))
    return sorted(
        code for code in codes if code not in known or (heights and known[code].pairs_with_height is None)
    )


def _made(
    texture: StrokeTexture, codes: list[Code], heights: bool, num_threads: int | None
) -> Iterator[Level]:
    rows, columns = (axis_levels(count) for count in texture.coverage.shape)
    height = paint_height(texture) if heights and texture.height is not None else None
    made = stroke_levels(texture.coverage, codes, height, num_threads=num_threads)
    shapes = [(max(paint.shape[0], 2), max(paint.shape[1], 2)) for paint, _ in made]
    sizes = [num_rows * num_columns + 1 for num_rows, num_columns in shapes]
    pairs = [np.empty(size, np.uint16) for size in sizes]
    with_height = [np.empty(size, np.uint32) for size in sizes] if heights else []
    _core.pack_levels(
        coverages=[paint for paint, _ in made],
        heights=[raised for _, raised in made if raised is not None],
        pairs=pairs,
        pairs_with_height=with_height,
    )
    colors = [None] * len(codes) if texture.tint is None else tint_levels(texture, codes, num_threads)
    for i, (u, v) in enumerate(codes):
        tints = colors[i]
        yield Level(
            pairs[i],
            shapes[i],
            (columns[u].scale, rows[v].scale),
            with_height[i] if heights else None,
            None if tints is None else _packed_tints(tints),
        )


def _packed_tints(channels: NDArray[np.uint8]) -> NDArray[np.uint32]:
    words = np.zeros(channels.shape[:2], np.uint32)
    for c in range(3):
        words |= channels[..., c].astype(np.uint32) << np.uint32(8 * c)
    words = _doubled(words)
    return np.append(np.concatenate([words, words[-1:]]).ravel(), np.uint32(0))


def tint_levels(
    texture: StrokeTexture, codes: list[Code], num_threads: int | None = None
) -> list[NDArray[np.uint8]]:
    """[rows, columns, 3] the colors of a brush in levels: means over the paint, none where there is none."""
    assert texture.tint is not None, "only of colored brushes"
    planes = []
    for c in range(3):
        plane = np.ascontiguousarray(texture.tint.texels[..., c])
        planes.append(stroke_levels(texture.coverage, codes, plane, num_threads=num_threads))
    return [
        np.stack([found for _, found in of_code if found is not None], axis=-1)
        for of_code in zip(*planes, strict=True)
    ]


T = TypeVar("T", bound=np.generic)


def _doubled(texels: NDArray[T]) -> NDArray[T]:
    """Texels with single rows and columns twice: bilinear sampling needs two."""
    for axis in (0, 1):
        if texels.shape[axis] == 1:
            texels = np.repeat(texels, 2, axis)
    return texels
