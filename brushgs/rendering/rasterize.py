"""Boxes become frames: the public functions over the compiled rasteriser."""

from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple, get_args
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from brushgs import _core
from brushgs.arrays import Array
from brushgs.brushes.levels import axis_levels, filtered_along_u, filtered_along_v, level_bounds
from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import MAX_PIXELS, MAX_SIDE, Filter
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.scene import Boxes, Frame
from brushgs.threads import num_threads_or_default

WHOLE_EXPONENT = 40  # softness of 1e-12 to 1e12 world units is taken as it is


def rasterize(
    boxes: Boxes,
    texture: StrokeTexture,
    *,
    height: int,
    width: int,
    filter: Filter = "mip",
    depth: bool = True,
    min_transmittance: float = MIN_TRANSMITTANCE,
    num_threads: int | None = None,
) -> Frame:
    """Paint boxes front to back with a stroke texture.

    At the centre p of a pixel a box with axes u, v and half extents h has x' = u . (p - center) and
    y' = v . (p - center). Inside (|x'| < h_u, |y'| < h_v) the coverage is read at ((1 + x'/h_u)/2,
    (1 + y'/h_v)/2) of the stroke image, and alpha = min(0.99, opacity x coverage). Alphas under 1/255 are
    skipped; a pixel is finished before its transmittance falls under `min_transmittance`.
    Source: Xiang et al. 2025, section 3.4; blending: Kerbl et al. 2023. Defined by `rendering/reference.py`.

    Boxes with softness are drawn in soft order. Box j hides the share S(x) of box i, x = (z_i - z_j) / b with
    b^2 = bands_i^2 + bands_j^2: all of it for x >= 1, nothing for x <= -1, and 1/2 + x (3 - x^2) / 4 between,
    where each hides a part of the other and none jumps while it passes. Box i weighs w_i = alpha_i x product
    over j of (1 - alpha_j S_ij), and weights are scaled to sum to 1 - product of (1 - alpha_i). A box is not
    seen, though it hides, in a pixel where what lies wholly in front (x >= 1) and the box itself would leave
    less than `min_transmittance`; a pixel takes no more boxes once all so far, however near, would leave less
    than 1e-31. Boxes further apart than b give the same bits as boxes without. The built-in kernels
    ("gaussian", "ellipse") ignore softness.

    Args:
        boxes: M strokes, nearest first.
        texture: what fills a box.
        height: pixels, 1 to 32767.
        width: pixels, 1 to 32767; height x width at most 2^28.
        filter: how a stroke image is read. "bilinear": between the four nearest texels, as published.
            "mip": bilinear from a copy of the image filtered for the stroke's size, so that small strokes do
            not shimmer. "nearest": the nearest texel. The built-in kernels need no filter.
        depth: whether the frame carries a depth.
        min_transmittance: a pixel is finished before it would let less light through, in [0, 1); what lies
            behind is not looked at, and can change the picture by about as much. The default is a hair under
            1e-4, so that both of two strokes of full paint are seen, which leave just that. 0: all strokes
            count (in soft order up to the 1e-31 above).
        num_threads: None takes the processors available to this process. The picture does not depend on it.

    Returns:
        The frame, in the dtype of the boxes.

    Raises:
        ValueError: if an option is out of range.
    """
    if filter not in get_args(Filter):
        raise ValueError(f"rasterize: filter must be one of {', '.join(get_args(Filter))}, got {filter!r}")
    for name, side in (("height", height), ("width", width)):
        if not 1 <= side <= MAX_SIDE:
            raise ValueError(f"rasterize: {name} must be in 1 to {MAX_SIDE} pixels, got {side}")
    if width * height > MAX_PIXELS:
        raise ValueError(
            f"rasterize: width x height must be at most {MAX_PIXELS} pixels, got {width} x {height}"
        )
    if not 0 <= min_transmittance < 1:
        raise ValueError(f"rasterize: min_transmittance must be in [0, 1), got {min_transmittance}")
    threads = num_threads_or_default(num_threads)
    levels = _levels_for(boxes, texture, filter)
    is_single = boxes.centers.dtype == np.float32
    new_plane: Any = _core.new_plane_float32 if is_single else _core.new_plane_float64
    rgb, alpha = new_plane([height, width, 3]), new_plane([height, width])
    z = new_plane([height, width]) if depth else None
    softness = boxes.softness if texture.kind == "image" else None
    depths, softness, exponent = _in_range(boxes.depths, softness)
    _core.rasterize(
        _kernel_of(texture, filter),
        threads,
        float(min_transmittance),
        boxes.centers,
        boxes.half_extents,
        boxes.angles,
        depths,
        boxes.colors,
        boxes.opacities,
        softness,
        levels.pairs,
        levels.sizes,
        levels.reaches,
        levels.of_box,
        rgb,
        alpha,
        z,
    )
    if exponent and z is not None:
        np.ldexp(z, -exponent, out=z)
    return Frame(rgb, alpha, z)


def _in_range(depths: Array, softness: Array | None) -> tuple[Array, Array | None, int]:
    """Depths and softness in a unit, a power of two, in which their squares fit the type, and its exponent.

    The kernel squares softness. In float32 that ends at 1e19 and begins at 1e-19 world units.
    """
    largest = 0.0 if softness is None else float(softness.max(initial=0))
    if softness is None or largest == 0 or 2.0**-WHOLE_EXPONENT < largest < 2.0**WHOLE_EXPONENT:
        return depths, softness, 0
    largest_exponent = np.finfo(depths.dtype).maxexp - 2
    exponent = int(min(-np.frexp(largest)[1], largest_exponent - np.frexp(depths[-1])[1]))
    return np.ldexp(depths, exponent), np.ldexp(softness, exponent), exponent


def _kernel_of(texture: StrokeTexture, filter: Filter) -> _core.Kernel:
    if texture.kind == "gaussian":
        return _core.Kernel.gaussian
    if texture.kind == "ellipse":
        return _core.Kernel.ellipse
    return _core.Kernel.nearest if filter == "nearest" else _core.Kernel.bilinear


def count_levels(boxes: Boxes, texture: StrokeTexture) -> tuple[int, int]:
    """How many copies of a stroke image these boxes need with `filter="mip"`, and how many there could be."""
    bounds = [level_bounds(size) for size in reversed(texture.coverage.shape)]
    used, _ = _core.choose_levels(boxes.half_extents, *bounds)
    return len(used), (len(bounds[0]) + 1) * (len(bounds[1]) + 1)


class _Levels(NamedTuple):
    """The L versions of the stroke image that a set of boxes needs, as the core reads them."""

    pairs: list[NDArray[np.uint16]]  # L times [rows * columns + 1]
    sizes: NDArray[np.int32]  # [L, 2] columns, rows
    reaches: NDArray[np.float64]  # [L, 2] along u, v: half extents of the box that the texels span
    of_box: NDArray[np.uint16]  # [M] row of the above; [0]: all boxes use the first
    codes: list[tuple[int, int]]  # L times the level along u and along v, see `level_coverage`


def _levels_for(boxes: Boxes, texture: StrokeTexture, filter: Filter) -> _Levels:
    all_first = np.empty(0, np.uint16)
    if texture.kind != "image":
        return _Levels([], np.empty((0, 2), np.int32), np.empty((0, 2)), all_first, [])
    rows, columns = texture.coverage.shape
    u, v = axis_levels(columns), axis_levels(rows)
    if filter == "mip":
        used, of_box = _core.choose_levels(boxes.half_extents, level_bounds(columns), level_bounds(rows))
        codes = [divmod(int(code), len(v)) for code in used]
    else:
        codes, of_box = [(0, 0)], all_first
    levels = _packed_levels(texture, codes)
    sizes = np.array([size for _, size in levels], np.int32).reshape(-1, 2)
    reaches = np.array([(u[i].scale, v[j].scale) for i, j in codes]).reshape(-1, 2)
    return _Levels([pairs for pairs, _ in levels], sizes, reaches, of_box, codes)


_Packed = tuple[NDArray[np.uint16], tuple[int, int]]
_cache: WeakKeyDictionary[StrokeTexture, dict[tuple[int, int], _Packed]] = WeakKeyDictionary()


def _packed_levels(texture: StrokeTexture, codes: list[tuple[int, int]]) -> list[_Packed]:
    """Levels (u, v) as the core reads them; those not asked for before are made, those of one u together."""
    of_texture = _cache.setdefault(texture, {})
    missing = sorted(code for code in codes if code not in of_texture)
    for level_u, group in groupby(missing, key=itemgetter(0)):
        along_u = filtered_along_u(texture.coverage, level_u)
        for _, level_v in group:
            of_texture[level_u, level_v] = _packed(filtered_along_v(along_u, level_v))
    return [of_texture[code] for code in codes]


def _packed(coverage: NDArray[np.uint8]) -> _Packed:
    """One level as the core reads it, each texel paired with the one below, and its (columns, rows)."""
    texels = coverage.astype(np.uint16)
    for axis in (0, 1):  # bilinear sampling stands between two texels
        if texels.shape[axis] == 1:
            texels = np.repeat(texels, 2, axis)
    below = np.concatenate([texels[1:], texels[-1:]])
    pairs = np.append((texels | below << 8).ravel(), np.uint16(0))
    return pairs, (texels.shape[1], texels.shape[0])
