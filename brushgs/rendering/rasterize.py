"""Boxes become frames: the public function over the compiled rasteriser."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from brushgs.brushes.brush_set import Brush, BrushSet
from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import MAX_PIXELS, MAX_SIDE, Blend, Filter
from brushgs.rendering.constants import MIN_TRANSMITTANCE
from brushgs.rendering.depth_test import DepthTest, depth_test_arguments
from brushgs.rendering.glaze import check_glaze, glaze_colors
from brushgs.rendering.relief import check_relief
from brushgs.rendering.streaks import check_streaks, streak_arguments
from brushgs.rendering.texture_levels import TextureLevels, kernel_of, levels_for
from brushgs.rendering.underpaint import Underpaint, underpaint_arguments
from brushgs.values.arrays import Array
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame

PLAIN_EXPONENT = 40  # softness of 1e-12 to 1e12 world units needs no other unit


def rasterize(
    boxes: Boxes,
    texture: Brush,
    *,
    height: int,
    width: int,
    filter: Filter = "mip",
    depth: bool = True,
    underpaint: Underpaint | None = None,
    streaks: float = 0.0,
    relief: bool = False,
    blend: Blend = "cover",
    in_front_of: DepthTest | None = None,
    min_transmittance: float = MIN_TRANSMITTANCE,
    num_threads: int | None = None,
) -> Frame:
    """Paint boxes front to back with a stroke texture.

    At the centre p of a pixel a box with axes u, v and half extents h has x' = u . (p - center) and
    y' = v . (p - center). Inside (|x'| < h_u, |y'| < h_v) the coverage is sampled at ((1 + x'/h_u)/2,
    (1 + y'/h_v)/2) of the stroke image, and alpha = min(0.99, opacity x coverage). Alphas under 1/255 are
    skipped; a pixel is finished before its transmittance falls under `min_transmittance`. A layer of the
    frame, like its depth, is the mean of an attribute of the boxes, weighted as their colours are.
    Source: Xiang et al. 2025, section 3.4; blending: Kerbl et al. 2023. Defined by `rendering/reference.py`.

    Boxes with softness are drawn in soft order. Box j hides the share S(x) of box i, x = (z_i - z_j) / b with
    b^2 = softness_i^2 + softness_j^2: all of it for x >= 1, nothing for x <= -1, and 1/2 + x (3 - x^2) / 4
    between, where each hides a part of the other and none jumps while it passes. Box i has the weight w_i =
    alpha_i x product over j of (1 - alpha_j S_ij), and weights are scaled to sum to 1 - product of
    (1 - alpha_i). A box is not seen, though it hides others, in a pixel where what lies wholly in front
    (x >= 1) and the box itself would leave less than `min_transmittance`; a pixel takes no more boxes once
    all so far, however near, would leave less than 1e-31. Boxes further apart than b give the same bits as
    boxes without softness. In tiles of 32 x 16 pixels where more than 160 boxes wait for each other in four
    by four pixels, the light that passes what surrounds a box is interpolated between a few depths and
    softnesses: there the picture is right to 0.5 / 255, to what `min_transmittance` may change, and never
    jumps. The built-in kernels ("gaussian", "ellipse") ignore softness.

    With `underpaint` each box is painted twice: as a stroke at its depth, and behind that, at its depth plus
    its setback, as the kernel "gaussian" in the same colour, its half extents and its opacity those of the
    box times `underpaint.reach` and `underpaint.opacity`. All 2 M are blended in the order of these depths,
    ties strokes first, then by row. For a layer like the depth both count as the box itself; underpaint has
    no softness.

    With `streaks` the colour of a stroke, though not of its underpaint, is multiplied by 1 + streaks x s,
    where s, -1 to 1, is a noise across the stroke that the row in `ids` shifts: of twelve bristles and of
    tufts of several. Either fades out where boxes are too narrow to show it, see `rendering/streaks.py`. The
    built-in kernels have neither.

    With `relief` the frame has a height: the sum over strokes of the weight of their colour times thickness +
    gain (h - 1/2), both from the box's `reliefs`, h the height of the stroke image, sampled as its coverage
    is (its coverage, where the image has no height). The built-in kernels add their thickness alone,
    underpaint 15/80 of that. Weights are those of the colours, though real paint keeps a part of what it
    covers: so a pixel that is finished has its whole height, and in soft order heights are as continuous as
    colours. No gradient passes through them.

    With `blend="glaze"` paint is transparent. The frame's rgb is then a tint, what is left of the light
    behind: the product over boxes of c^alpha, c each channel of a colour held within 0.02 to 1; it is 1 where
    nothing is painted. Alpha is 1 - product of (1 - alpha) as before. The order of boxes plays no part, nor
    softness; no pixel is ever finished, and there is neither depth nor height.

    With `in_front_of` boxes fade out behind a limit that each pixel sets, see `DepthTest`; a box and its
    underpaint alike, by the depth of the box.

    Args:
        boxes: M strokes, nearest first.
        texture: what fills a box; or its name or path, see `render`. A `BrushSet` fills each with the brush
            of its row in `brushes`.
        height: pixels, 1 to 32767.
        width: pixels, 1 to 32767; height x width at most 2^28.
        filter: how a stroke image is sampled. "bilinear": between the four nearest texels, as published.
            "mip": bilinear from a copy of the image filtered for the stroke's size, so that small strokes do
            not shimmer. "nearest": the nearest texel. The built-in kernels need no filter.
        depth: whether the frame has a depth.
        underpaint: what lies behind each stroke, or None for nothing; the boxes must have setbacks.
        streaks: largest share by which the colour of a stroke is lighter or darker, 0 to 0.5.
        relief: whether the frame has a height; the boxes must have reliefs.
        blend: "cover": paint hides what lies behind it. "glaze": it tints what lies behind it.
        in_front_of: how far back boxes are seen, or None for all the way.
        min_transmittance: a pixel is finished before it would let less light through, in [0, 1); strokes
            behind are skipped, and could change the picture by about as much. The default is just below 1e-4,
            so that two strokes of full paint, which leave exactly that, are both seen. 0: all strokes count
            (in soft order up to the 1e-31 above).
        num_threads: None takes the processors available to this process. The picture does not depend on it.

    Returns:
        The frame, in the dtype of the boxes.

    Raises:
        TypeError: if `underpaint` or `in_front_of` is neither None nor of its type.
        ValueError: if an option is out of range; if `underpaint` is given and boxes have no setbacks, or
            `relief` and they have no reliefs; if the brush of a box lies beyond the set; if a glaze is to
            have underpaint or streaks; or if `in_front_of` is of another size.

    Example:
        >>> boxes = bg.project(strokes, camera)
        >>> bg.rasterize(boxes, "dry_brush", width=camera.width, height=camera.height)
        Frame(320x240, depth)
    """
    painted = RasterArguments(
        boxes,
        BrushSet.of(texture),
        height,
        width,
        filter=filter,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        relief=relief and blend != "glaze",
        blend=blend,
        in_front_of=in_front_of,
        min_transmittance=min_transmittance,
        num_threads=num_threads,
    )
    return _paint(painted, blend, trace=None)


@dataclass(frozen=True, eq=False)
class Trace:
    """What painting boxes found out and `rasterize_backward` needs again; good for these boxes alone.

    Attributes:
        of_core: which blocks of 4 x 4 pixels each box paints on. 64 bytes a box, twice that with underpaint,
            and 12 to 16 bytes for each tile of 32 x 16 pixels that a box reaches: 10 MB and 6 MB for 150,000
            boxes at 800 x 800.
        levels: of the stroke images.
    """

    of_core: Any
    levels: TextureLevels


def rasterize_traced(
    boxes: Boxes,
    brushes: BrushSet,
    *,
    height: int,
    width: int,
    filter: Filter,
    depth: bool,
    underpaint: Underpaint | None,
    streaks: float,
    min_transmittance: float,
    num_threads: int | None,
) -> tuple[Frame, Trace]:
    """`rasterize` of boxes without softness, and what it found out. Raises the same."""
    painted = RasterArguments(
        boxes,
        brushes,
        height,
        width,
        filter=filter,
        depth=depth,
        underpaint=underpaint,
        streaks=streaks,
        relief=False,
        blend="cover",
        in_front_of=None,
        min_transmittance=min_transmittance,
        num_threads=num_threads,
    )
    is_single = boxes.centers.dtype == np.float32
    trace = Trace(_core.TraceFloat32() if is_single else _core.TraceFloat64(), painted.levels)
    return _paint(painted, "cover", trace), trace


def _paint(painted: "RasterArguments", blend: Blend, trace: Trace | None) -> Frame:
    height, width = painted.size
    is_single = painted.boxes.centers.dtype == np.float32
    new_plane: Any = _core.new_plane_float32 if is_single else _core.new_plane_float64
    rgb, alpha = new_plane([height, width, 3]), new_plane([height, width])
    layers = {name: new_plane([height, width, *a.shape[1:]]) for name, a in painted.attributes.items()}
    height_plane = new_plane([height, width]) if painted.relief else None
    _core.rasterize(
        **painted.of_core,
        rgb=rgb,
        alpha=alpha,
        layers=list(layers.values()),
        height_plane=height_plane,
        blend=_core.Blend.glaze if blend == "glaze" else _core.Blend.cover,
        trace=None if trace is None else trace.of_core,
    )
    if painted.exponent and "depth" in layers:
        np.ldexp(layers["depth"], -painted.exponent, out=layers["depth"])
    return Frame(rgb, alpha, **layers, height=height_plane)


class RasterArguments:
    """What the core takes to paint boxes, or to list what paints them; arguments and checks of `rasterize`.

    Attributes:
        boxes: with lengths of the world in a unit that suits the dtype.
        exponent: of that unit: 2^-exponent world units.
        attributes: of which there are layers, by their names.
        relief: whether there is a height.
        size: height and width, pixels.
        levels: of the stroke images.
        of_core: by name.
    """

    def __init__(
        self,
        boxes: Boxes,
        brushes: BrushSet,
        height: int,
        width: int,
        *,
        filter: Filter,
        depth: bool,
        underpaint: Underpaint | None,
        streaks: float,
        relief: bool,
        blend: Blend,
        in_front_of: DepthTest | None,
        min_transmittance: float,
        num_threads: int | None,
    ) -> None:
        if filter not in get_args(Filter):
            known = ", ".join(get_args(Filter))
            raise ValueError(f"rasterize: filter must be one of {known}, got {filter!r}")
        _check_size(height, width)
        if not 0 <= min_transmittance < 1:
            raise ValueError(f"rasterize: min_transmittance must be in [0, 1), got {min_transmittance}")
        check_streaks("rasterize", streaks)
        check_glaze("rasterize", blend, underpaint, streaks)
        if relief:
            check_relief("rasterize", boxes)
        depth_test = depth_test_arguments("rasterize", boxes, in_front_of, height, width)
        threads = num_threads_or_default(num_threads)
        is_image, is_glaze = brushes.kind == "image", blend == "glaze"
        is_soft = boxes.softness is not None and is_image and not is_glaze
        streaks = streaks if is_image else 0.0
        boxes, self.exponent = _in_plain_range(boxes) if is_soft else (boxes, 0)
        self.boxes, self.relief, self.size = boxes, relief, (height, width)
        named = {} if is_glaze else boxes.attributes()
        self.attributes = {name: a for name, a in named.items() if depth or name != "depth"}
        self.levels = levels_for("rasterize", boxes, brushes, filter, heights=relief, num_threads=threads)
        self.of_core: dict[str, Any] = {
            "kernel": kernel_of(brushes, filter),
            "levels": self.levels.packed,
            "min_transmittance": float(min_transmittance),
            "num_threads": threads,
            "boxes": box_arrays(
                boxes,
                self.attributes.values(),
                colors=glaze_colors(boxes) if is_glaze else boxes.colors,
                softness=boxes.softness if is_soft else None,
                reliefs=boxes.reliefs if relief else None,
                **underpaint_arguments("rasterize", boxes, brushes, underpaint),
                **streak_arguments(boxes, streaks, brushes),
                **depth_test,
            ),
        }


def _check_size(height: int, width: int) -> None:
    for name, side in (("height", height), ("width", width)):
        if not 1 <= side <= MAX_SIDE:
            raise ValueError(f"rasterize: {name} must be in 1 to {MAX_SIDE} pixels, got {side}")
    if width * height > MAX_PIXELS:
        raise ValueError(
            f"rasterize: width x height must be at most {MAX_PIXELS} pixels, got {width} x {height}"
        )


def box_arrays(boxes: Boxes, attributes: Iterable[Array], *, colors: Array, **given: Any) -> Any:
    """Boxes as the core takes them: painted with these colours, and with what else is given, by its name."""
    make: Any = _core.BoxArraysFloat32 if boxes.centers.dtype == np.float32 else _core.BoxArraysFloat64
    return make(
        centers=boxes.centers,
        half_extents=boxes.half_extents,
        angles=boxes.angles,
        colors=colors,
        opacities=boxes.opacities,
        depths=boxes.depths,
        attributes=list(attributes),
        **given,
    )


def _in_plain_range(boxes: Boxes) -> tuple[Boxes, int]:
    """Boxes with all lengths of the world in units of 2^-exponent, in which squared softness fits the dtype.

    The kernel squares softness: in float32 that overflows from 1e19 world units on and vanishes below 1e-19.
    """
    assert boxes.softness is not None, "only the soft order needs this"
    largest = float(boxes.softness.max(initial=0))
    if largest == 0 or 2.0**-PLAIN_EXPONENT < largest < 2.0**PLAIN_EXPONENT:
        return boxes, 0
    largest_exponent = np.finfo(boxes.depths.dtype).maxexp - 2
    farthest = boxes.depths[-1]
    if boxes.setbacks is not None:
        farthest = max(farthest, boxes.setbacks.max())
    exponent = int(min(-np.frexp(largest)[1], largest_exponent - np.frexp(farthest)[1]))
    columns = {"depths": boxes.depths, "softness": boxes.softness, "setbacks": boxes.setbacks}
    scaled: Any = {name: np.ldexp(c, exponent) for name, c in columns.items() if c is not None}
    return replace(boxes, **scaled), exponent
