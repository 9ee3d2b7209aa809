"""Boxes -> frames: the public function over the compiled rasteriser."""

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
from brushgs.values.part import TILE, Part

PLAIN_EXPONENT = 40  # softness of 1e-12 to 1e12 world units needs no rescaling


@dataclass(frozen=True, eq=False)
class RasterOptions:
    """The options of `rasterize`, which explains them."""

    height: int
    width: int
    filter: Filter = "mip"
    depth: bool = True
    underpaint: Underpaint | None = None
    streaks: float = 0.0
    relief: bool = False
    blend: Blend = "cover"
    in_front_of: DepthTest | None = None
    min_transmittance: float = MIN_TRANSMITTANCE
    num_threads: int | None = None
    part: Part | None = None
    dpi: float | None = None


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
    part: Part | None = None,
    dpi: float | None = None,
) -> Frame:
    """Paint boxes front to back with a stroke texture.

    At the center p of a pixel a box with axes u, v and half extents h has x' = u . (p - center) and y' = v .
    (p - center). Inside (|x'| < h_u, |y'| < h_v) the coverage is sampled at ((1 + x'/h_u)/2, (1 + y'/h_v)/2)
    of the stroke image, and alpha = min(0.99, opacity x coverage). Alphas below 1/255 are skipped; a pixel is
    finished before its transmittance falls below `min_transmittance`. A layer of the frame, such as depth, is
    the mean of an attribute of the boxes with the weights of their colors.
    Source: Xiang et al. 2025, section 3.4; blending: Kerbl et al. 2023. Defined by `rendering/reference.py`.

    Boxes with softness are drawn in soft order. Box j hides the share S(x) of box i, x = (z_i - z_j) / b with
    b^2 = softness_i^2 + softness_j^2: all for x >= 1, nothing for x <= -1, and 1/2 + x (3 - x^2) / 4 between,
    so that nothing jumps when boxes pass each other. Box i has the weight w_i = alpha_i x product over j of
    (1 - alpha_j S_ij), and weights are scaled to sum to 1 - product of (1 - alpha_i). A box is invisible in a
    pixel, but still hides others, if the boxes wholly in front (x >= 1) and itself would leave less than
    `min_transmittance`; a pixel takes no more boxes once all so far would leave less than 1e-31. Boxes
    further apart than b give the same bits as boxes without softness. In tiles of 32 x 16 pixels with more
    than 160 boxes pending in a block of 4 x 4 pixels, the transmittance of a box's surroundings is
    interpolated between a few depths and softnesses: the error is below 0.5 / 255 (apart from the effect of
    `min_transmittance`), without jumps. The built-in kernels ("gaussian", "ellipse") ignore softness.

    With `underpaint` each box is painted twice: as a stroke at its depth, and behind it, at depth + setback,
    as the kernel "gaussian" in the same color, with half extents times `underpaint.reach` and opacity times
    `underpaint.opacity`. All 2 M are blended by depth, ties strokes first, then by row. Layers use the
    attributes of the box for both; underpaint has no softness.

    With `streaks` the color of a stroke (not of its underpaint) is multiplied by 1 + streaks x s; s, -1 to
    1, is a noise across the stroke, shifted by the row in `ids`: of twelve bristles, and of tufts of several.
    Both fade out in boxes too narrow to show them, see `rendering/streaks.py`. The built-in kernels have no
    streaks.

    With `relief` the frame has a height: the sum over strokes of color weight x (thickness + gain (h -
    1/2)), with thickness and gain from `reliefs`, and h the height of the stroke image, sampled like its
    coverage (or the coverage, if it has no height). The built-in kernels add only their thickness, underpaint
    15/80 of it. Using the color weights, a finished pixel has its full height, and heights are as continuous
    as colors in soft order. Heights have no gradient.

    With `blend="glaze"` paint is transparent. The frame's rgb is then a tint (the transmitted share of the
    light behind): the product over boxes of c^alpha, c each color channel clamped to 0.02 to 1; 1 where
    nothing is painted. Alpha is 1 - product of (1 - alpha) as before. Order and softness do not matter,
    pixels are never finished, and there is neither depth nor height.

    With `in_front_of` boxes and their underpaint fade out behind a depth limit per pixel, see `DepthTest`, by
    the depth of the box.

    Args:
        boxes: M strokes, nearest first.
        texture: the brush, its name or path, see `render`. With a `BrushSet` each box uses the brush of its
            row in `brushes`.
        height: pixels, 1 to 32767.
        width: pixels, 1 to 32767; height x width at most 2^28.
        filter: sampling of stroke images. "bilinear": the four nearest texels, as published. "mip": bilinear
            from a copy filtered for the stroke's size, so that small strokes do not shimmer. "nearest": the
            nearest texel. The built-in kernels need no filter.
        depth: whether the frame has a depth.
        underpaint: soft copies behind strokes, or None; the boxes must have setbacks.
        streaks: amplitude of streaks, 0 to 0.5.
        relief: whether the frame has a height; the boxes must have reliefs.
        blend: "cover": paint hides what lies behind it. "glaze": it tints what lies behind it.
        in_front_of: depth test, or None.
        min_transmittance: a pixel is finished before its transmittance falls below this, in [0, 1); skipped
            strokes could change the picture by about as much. The default is just below 1e-4, so that two
            strokes of full paint, which leave exactly that, both count. 0: all strokes count (in soft order
            up to the 1e-31 above).
        num_threads: None takes the processors available to this process. The picture does not depend on it.
        part: paint only these pixels, bit for bit those of the whole picture; the frame and the depth test
            are as large as the part. It begins and ends on tiles of 32 x 16 pixels, or where the picture
            does, see `Part.grown`. None for all.
        dpi: pixels per inch on paper: strokes then have bristles of a physical width too, see
            `rendering/streaks.py`. None for none.

    Returns:
        The frame, in the dtype of the boxes.

    Raises:
        TypeError: if `underpaint` or `in_front_of` is neither None nor of its type.
        ValueError: if an option is out of range; if `underpaint` is given and boxes have no setbacks, or
            `relief` and they have no reliefs; if a brush is beyond the set; if a glaze has underpaint or
            streaks; if `in_front_of` has another size; or if `part` does not lie in the picture, on tiles.

    Example:
        >>> boxes = bg.project(strokes, camera)
        >>> bg.rasterize(boxes, "dry_brush", width=camera.width, height=camera.height)
        Frame(320x240, depth)
    """
    options = RasterOptions(
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
        part=part,
        dpi=dpi,
    )
    return _paint(RasterArguments(boxes, BrushSet.of(texture), options), blend)


@dataclass(frozen=True, eq=False)
class Below:
    """A frame that boxes are painted over, in its own arrays.

    Attributes:
        frame: of strokes; it has a height, and a depth, if the boxes are painted with one.
        hidden: share of its height that paint hides, 0 to 1.
    """

    frame: Frame
    hidden: float


def rasterize_over(boxes: Boxes, texture: Brush, options: RasterOptions, below: Below) -> Frame:
    """Paint boxes as `rasterize` does, as paint that covers, and lay their picture over a frame in one step.

    Returns:
        A frame with the arrays of `below`, changed only in tiles that boxes reach; without a depth if the
        boxes are painted without.
    """
    return _paint(RasterArguments(boxes, BrushSet.of(texture), options), "cover", below=below)


@dataclass(frozen=True, eq=False)
class Trace:
    """Data of a forward pass for `rasterize_backward`; valid for the same boxes only.

    Attributes:
        of_core: blocks of 4 x 4 pixels that each box paints: 64 bytes per box, twice that with underpaint,
            and 12 to 16 bytes per tile of 32 x 16 pixels that a box reaches; 10 MB and 6 MB for 150,000 boxes
            at 800 x 800.
        levels: of the stroke images.
    """

    of_core: Any
    levels: TextureLevels


def rasterize_traced(boxes: Boxes, brushes: BrushSet, options: RasterOptions) -> tuple[Frame, Trace]:
    """`rasterize` of boxes without softness, as paint that covers, with its trace. Raises the same."""
    painted = RasterArguments(boxes, brushes, options)
    is_single = boxes.centers.dtype == np.float32
    trace = Trace(_core.TraceFloat32() if is_single else _core.TraceFloat64(), painted.levels)
    return _paint(painted, "cover", trace), trace


def _paint(
    painted: "RasterArguments", blend: Blend, trace: Trace | None = None, below: Below | None = None
) -> Frame:
    frame = painted.new_frame() if below is None else below.frame
    layers = {name: getattr(frame, name) for name in painted.attributes}
    if below is not None and painted.exponent and "depth" in layers:
        np.ldexp(layers["depth"], painted.exponent, out=layers["depth"])
    _core.rasterize(
        **painted.of_core,
        rgb=frame.rgb,
        alpha=frame.alpha,
        layers=list(layers.values()),
        height_plane=frame.height if painted.relief else None,
        blend=_core.Blend.glaze if blend == "glaze" else _core.Blend.cover,
        hidden=None if below is None else below.hidden,
        trace=None if trace is None else trace.of_core,
        size=painted.size,
        corner=(painted.part.top, painted.part.left),
    )
    if painted.exponent and "depth" in layers:
        np.ldexp(layers["depth"], -painted.exponent, out=layers["depth"])
    return Frame(frame.rgb, frame.alpha, **layers, height=frame.height)


class RasterArguments:
    """Checked arguments of `rasterize` for the core, to paint boxes or list fragments.

    Attributes:
        boxes: with world lengths in a unit that suits the dtype.
        exponent: of that unit: 2^-exponent world units.
        attributes: layer name -> attribute.
        relief: whether there is a height.
        size: height and width, pixels.
        part: of the picture that is painted.
        levels: of the stroke images.
        of_core: core arguments by name.
    """

    def __init__(self, boxes: Boxes, brushes: BrushSet, options: RasterOptions) -> None:
        height, width, filter, relief = options.height, options.width, options.filter, options.relief
        if filter not in get_args(Filter):
            known = ", ".join(get_args(Filter))
            raise ValueError(f"rasterize: filter must be one of {known}, got {filter!r}")
        _check_size(height, width)
        self.part = Part.whole(width, height) if options.part is None else options.part
        _check_part(self.part, height, width)
        if not 0 <= options.min_transmittance < 1:
            got = options.min_transmittance
            raise ValueError(f"rasterize: min_transmittance must be in [0, 1), got {got}")
        check_streaks("rasterize", options.streaks)
        check_glaze("rasterize", options.blend, options.underpaint, options.streaks)
        if relief:
            check_relief("rasterize", boxes)
        depth_test = depth_test_arguments(
            "rasterize", boxes, options.in_front_of, self.part.height, self.part.width
        )
        threads = num_threads_or_default(options.num_threads)
        is_image, is_glaze = brushes.kind == "image", options.blend == "glaze"
        is_soft = boxes.softness is not None and is_image and not is_glaze
        streaks = options.streaks if is_image else 0.0
        boxes, self.exponent = _in_plain_range(boxes) if is_soft else (boxes, 0)
        self.boxes, self.relief, self.size = boxes, relief, (height, width)
        named = {} if is_glaze else boxes.attributes()
        self.attributes = {name: a for name, a in named.items() if options.depth or name != "depth"}
        self.levels = levels_for("rasterize", boxes, brushes, filter, heights=relief, num_threads=threads)
        self.of_core: dict[str, Any] = {
            "kernel": kernel_of(brushes, filter),
            "levels": self.levels.packed,
            "min_transmittance": float(options.min_transmittance),
            "num_threads": threads,
            "boxes": box_arrays(
                boxes,
                self.attributes.values(),
                colors=glaze_colors(boxes) if is_glaze else boxes.colors,
                softness=boxes.softness if is_soft else None,
                reliefs=boxes.reliefs if relief else None,
                **underpaint_arguments("rasterize", boxes, brushes, options.underpaint),
                **streak_arguments(boxes, streaks, brushes, dpi=options.dpi, relief=relief),
                **depth_test,
            ),
        }

    def new_frame(self) -> Frame:
        """Arrays to paint into."""
        height, width = self.part.height, self.part.width
        is_single = self.boxes.centers.dtype == np.float32
        new_plane: Any = _core.new_plane_float32 if is_single else _core.new_plane_float64
        rgb, alpha = new_plane([height, width, 3]), new_plane([height, width])
        layers = {name: new_plane([height, width, *a.shape[1:]]) for name, a in self.attributes.items()}
        return Frame(rgb, alpha, **layers, height=new_plane([height, width]) if self.relief else None)


def _check_size(height: int, width: int) -> None:
    for name, side in (("height", height), ("width", width)):
        if not 1 <= side <= MAX_SIDE:
            raise ValueError(f"rasterize: {name} must be in 1 to {MAX_SIDE} pixels, got {side}")
    if width * height > MAX_PIXELS:
        raise ValueError(
            f"rasterize: width x height must be at most {MAX_PIXELS} pixels, got {width} x {height}"
        )


def _check_part(part: Part, height: int, width: int) -> None:
    if not part.is_in(width, height) or part.grown(0, width, height) != part:
        raise ValueError(
            f"rasterize: part must begin and end on tiles of {TILE[0]} x {TILE[1]} pixels or where the "
            f"picture of {width} x {height} does, got {part}"
        )


def box_arrays(boxes: Boxes, attributes: Iterable[Array], *, colors: Array, **given: Any) -> Any:
    """Boxes for the core, with these colors and further arrays by name."""
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
    """Boxes with world lengths in units of 2^-exponent, so that squared softness fits the dtype.

    In float32 the square overflows above 1e19 world units and vanishes below 1e-19.
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
