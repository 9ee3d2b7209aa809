"""A stroke texture as the core reads it: the kernel that fills a box, and the levels of the image it needs.

What the texels of a level are is decided in `brushgs.brushes.levels`; here they are packed, and kept for each
texture as long as it lives.
"""

from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64
from brushgs.brushes.levels import (
    axis_levels,
    filtered_along_u,
    filtered_along_v,
    level_bounds,
    level_gradient,
)
from brushgs.brushes.texture import StrokeTexture
from brushgs.native import core as _core
from brushgs.options.choices import Filter
from brushgs.scene import Boxes

Code = tuple[int, int]  # the level along u and along v, see `level_coverage`


def kernel_of(texture: StrokeTexture, filter: Filter) -> _core.Kernel:
    """What the core fills a box with."""
    if texture.kind == "gaussian":
        return _core.Kernel.gaussian
    if texture.kind == "ellipse":
        return _core.Kernel.ellipse
    return _core.Kernel.nearest if filter == "nearest" else _core.Kernel.bilinear


@dataclass(frozen=True, eq=False)
class TextureLevels:
    """The L levels of a stroke image that a set of boxes needs; none for a built-in kernel.

    Attributes:
        packed: as the core reads them, with the level of each box.
        codes: L times the level along u and along v.
        shapes: L times rows and columns of `packed`; an image of one row or column has two there.
    """

    packed: _core.Levels
    codes: list[Code]
    shapes: list[tuple[int, int]]


def levels_for(boxes: Boxes, texture: StrokeTexture, filter: Filter) -> TextureLevels:
    """The levels that serve these boxes; the image itself for all of them unless the filter is "mip"."""
    codes: list[Code] = []
    of_box = np.empty(0, np.uint16)  # all boxes use the first level
    if texture.kind == "image":
        codes = [(0, 0)]
        if filter == "mip":
            used, of_box = _choose_levels(boxes, texture)
            num_levels_v = len(axis_levels(texture.coverage.shape[0]))
            codes = [divmod(int(code), num_levels_v) for code in used]
    rows, columns = texture.coverage.shape
    levels = _packed_levels(texture, codes)
    reaches = [(axis_levels(columns)[u].scale, axis_levels(rows)[v].scale) for u, v in codes]
    shapes = [shape for _, shape in levels]
    packed = _core.Levels(
        pairs=[pairs for pairs, _ in levels],
        sizes=np.array([shape[::-1] for shape in shapes], np.int32).reshape(-1, 2),
        reaches=np.array(reaches, np.float64).reshape(-1, 2),
        of_box=of_box,
    )
    return TextureLevels(packed, codes, shapes)


def count_levels(boxes: Boxes, texture: StrokeTexture) -> tuple[int, int]:
    """How many levels of a stroke image these boxes need with `filter="mip"`, and how many there could be."""
    rows, columns = texture.coverage.shape
    used, _ = _choose_levels(boxes, texture)
    return len(used), len(axis_levels(columns)) * len(axis_levels(rows))


def coverage_gradient(texture: StrokeTexture, levels: TextureLevels, v_texels: list[F64]) -> F64:
    """[h, w] gradient by the coverage of a texture, from that by the texels of each level as packed."""
    total = np.zeros(texture.coverage.shape)
    for code, values in zip(levels.codes, v_texels, strict=True):
        for axis in (0, 1):  # an axis of one texel was given a second one like it
            if texture.coverage.shape[axis] == 1:
                values = values.sum(axis, keepdims=True)
        total += level_gradient(texture.coverage, *code, values)
    return total


def _choose_levels(boxes: Boxes, texture: StrokeTexture) -> tuple[NDArray[np.uint16], NDArray[np.uint16]]:
    """The codes in use as one number each, ascending, and for each box its row among them."""
    rows, columns = texture.coverage.shape
    used, of_box = _core.choose_levels(
        half_extents=boxes.half_extents, bounds_u=level_bounds(columns), bounds_v=level_bounds(rows)
    )
    return used, of_box


_Packed = tuple[NDArray[np.uint16], tuple[int, int]]  # texels, and their rows and columns
_cache: WeakKeyDictionary[StrokeTexture, dict[Code, _Packed]] = WeakKeyDictionary()


def _packed_levels(texture: StrokeTexture, codes: list[Code]) -> list[_Packed]:
    """Levels as the core reads them. Missing ones are made, those of one level along u together."""
    of_texture = _cache.setdefault(texture, {})
    missing = sorted(code for code in codes if code not in of_texture)
    for level_u, group in groupby(missing, key=itemgetter(0)):
        along_u = filtered_along_u(texture.coverage, level_u)
        for _, level_v in group:
            of_texture[level_u, level_v] = _packed(filtered_along_v(along_u, level_v))
    return [of_texture[code] for code in codes]


def _packed(coverage: NDArray[np.uint8]) -> _Packed:
    """One level as the core reads it: each texel paired with the one below."""
    texels = coverage.astype(np.uint16)
    for axis in (0, 1):  # bilinear sampling lies between two texels
        if texels.shape[axis] == 1:
            texels = np.repeat(texels, 2, axis)
    below = np.concatenate([texels[1:], texels[-1:]])
    pairs = np.append((texels | below << 8).ravel(), np.uint16(0))
    return pairs, (texels.shape[0], texels.shape[1])
