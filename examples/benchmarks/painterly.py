"""A baseline: the classic painterly filter on the image plane, which paints one picture with strokes.

It knows neither the scene nor the previous picture: a sequence painted with it shows what it costs to style
every frame alone. It avoids all needless flicker: the places, the order and the random numbers of its grids
depend on the seed and the size of the picture, not on its content.
Source: Hertzmann 1998, Painterly Rendering with Curved Brush Strokes of Multiple Sizes (layers from coarse to
fine, each on a grid, strokes where the canvas is still far from the blurred picture); Litwinowicz 1997,
Processing Images and Video for an Impressionist Effect (straight strokes across the gradient, random order).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.measure.stability import Comparison, PaintTimer
from brushgs.options.choices import Filter
from brushgs.rendering.rasterize import rasterize
from brushgs.values.arrays import F64, Array, check
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame

# The numbers below were chosen by eye and PSNR on four scenes. Flicker hardly depends on them: with 2000
# strokes on orbits of koala and chair in steps of 1.5 degrees, eight other choices have an excess error
# (`warp.match_views`) of 5.5 to 6.6 and 4.4 to 5.0 of 255.
# Share of the strokes that each layer may use; the next one gets what is left. The cells of a layer are half
# as wide as those of the one before.
LAYER_SHARES = (0.03, 0.07, 0.15, 0.30, 0.45)
JITTER = 0.25  # of a cell: how far a stroke lies from the middle of its own, at most
# Area that a stroke paints over that of its cell: in the first layer, which hides the background, and later.
FIRST_OVERLAP, OVERLAP = 4.0, 2.0
MAX_ASPECT = 3.0  # of a stroke: longer ones cross the edges of what they paint
BLUR = 0.5  # standard deviation over the half width of a stroke: detail finer than that is for later layers
TENSOR_REACH = 0.5  # standard deviation over the cell, of the area in which a direction is measured
MIN_BLUR = 2.0  # pixels, standard deviation left when a picture is made smaller for a coarse layer
EDGE = 1.0  # pixels, standard deviation at which the picture is differentiated
NO_EDGE = 1e-9  # squared slope per pixel, below which it is only rounding
ENOUGH = 0.015  # RMS error of a cell, 0 to 1, below which it gets no stroke: about 4 of 255
# Part of its box that a kernel paints (an image has its coverage): the means of 1 and exp(-4.5 r^2).
KERNEL_MEANS = {"ellipse": np.pi / 4, "gaussian": 0.174}


class _Layer(NamedTuple):
    """Cells of one layer, row by row, and the strokes that would lie in them."""

    cell: float  # width, pixels
    places: F64  # [n, 2] (x, y), pixels
    keys: F64  # [n] 0 to 1, the order of painting
    half_extents: F64  # [2] along u, v, pixels


def paint_image(
    rgb: Array,
    texture: StrokeTexture,
    *,
    num_strokes: int,
    seed: int = 0,
    filter: Filter = "mip",
    background: Sequence[float] | Array = (1.0, 1.0, 1.0),
    num_threads: int | None = None,
) -> Frame:
    """Paint one picture with strokes on the image plane.

    Five layers, each of half the size of the one before. A layer puts its strokes on a jittered grid, in the
    cells where the canvas is furthest from the picture. A stroke has the color of the picture blurred to its
    size, and lies along the edges (the minor axis of the structure tensor of the three channels); the order
    is random.

    Args:
        rgb: [H, W, 3] the picture on its background, display-encoded, 0 to 1.
        texture: the stroke.
        num_strokes: the most strokes, >= 1; fewer if the picture is reached before.
        seed: of the jitter and the order.
        filter: see `rasterize`.
        background: the empty canvas, one RGB color 0 to 1 or [H, W, 3]; where it equals the picture it stays
            empty.
        num_threads: see `rasterize`.

    Returns:
        The frame, float32, without depth. Equal input gives equal bits.

    Raises:
        TypeError: if `rgb` is not a floating array.
        ValueError: if a shape or a number is out of range.
    """
    boxes = image_boxes(
        rgb,
        texture,
        num_strokes=num_strokes,
        seed=seed,
        filter=filter,
        background=background,
        num_threads=num_threads,
    )
    height, width = rgb.shape[:2]
    return rasterize(
        boxes, texture, height=height, width=width, filter=filter, depth=False, num_threads=num_threads
    )


def image_boxes(
    rgb: Array,
    texture: StrokeTexture,
    *,
    num_strokes: int,
    seed: int = 0,
    filter: Filter = "mip",
    background: Sequence[float] | Array = (1.0, 1.0, 1.0),
    num_threads: int | None = None,
) -> Boxes:
    """The strokes of `paint_image`, the last one painted first; takes and raises the same.

    `ids` number the cells of all layers: a stroke of the same id in another picture lies in the same place.
    """
    picture = _checked(rgb, num_strokes, seed)
    height, width = picture.shape[:2]
    canvas = np.broadcast_to(np.asarray(background, np.float64), picture.shape)
    tensor = _tensor(picture)
    rng = np.random.default_rng(seed)
    laid: list[tuple[Any, ...]] = []
    budget, first_id = 0.0, 0
    for number, share in enumerate(LAYER_SHARES):
        budget += share * num_strokes
        num_cells = LAYER_SHARES[0] * num_strokes * 4**number
        layer = _layer(picture.shape, texture, num_cells, OVERLAP if number else FIRST_OVERLAP, rng)
        rows, colors, angles = _choose(picture, tensor, canvas, layer, round(budget))
        budget -= len(rows)
        columns = layer.places[rows], layer.half_extents, angles, colors, first_id + rows
        laid.append(columns)
        first_id += len(layer.places)
        if number + 1 < len(LAYER_SHARES):
            frame = rasterize(
                _boxes([columns]),
                texture,
                height=height,
                width=width,
                filter=filter,
                depth=False,
                num_threads=num_threads,
            )
            canvas = frame.over(canvas.astype(np.float32)).astype(np.float64)
    return _boxes(laid)


def _checked(rgb: Array, num_strokes: int, seed: int) -> F64:
    """The picture as float64, after checking all arguments."""
    check("paint_image", rgb=(rgb, "H W 3"))
    if not np.issubdtype(rgb.dtype, np.floating):
        raise TypeError(f"paint_image: rgb must be floating, 0 to 1, got {rgb.dtype}; divide it by 255")
    if 0 in rgb.shape:
        raise ValueError(f"paint_image: rgb must have pixels, got shape {list(rgb.shape)}")
    if not np.isfinite(rgb).all():
        raise ValueError(f"paint_image: rgb must be finite, got {np.count_nonzero(~np.isfinite(rgb))} others")
    if num_strokes < 1:
        raise ValueError(f"paint_image: num_strokes must be at least 1, got {num_strokes}")
    if seed < 0:
        raise ValueError(f"paint_image: seed must be 0 or more, got {seed}")
    return rgb.astype(np.float64)


def _layer(
    shape: tuple[int, ...], texture: StrokeTexture, num_cells: float, overlap: float, rng: np.random.Generator
) -> _Layer:
    """About `num_cells` square cells over a picture, and the size of their strokes."""
    height, width = shape[:2]
    cell = np.sqrt(height * width / max(num_cells, 1.0))
    rows, columns = max(1, round(height / cell)), max(1, round(width / cell))
    y, x = np.indices((rows, columns)).reshape(2, -1)
    jitter = rng.uniform(-JITTER, JITTER, (rows * columns, 2))
    places = (np.stack([x, y], 1) + 0.5 + jitter) * (width / columns, height / rows)
    texel_rows, texel_columns = texture.coverage.shape
    aspect = np.clip(texel_columns / texel_rows, 1 / MAX_ASPECT, MAX_ASPECT)
    mean = KERNEL_MEANS.get(texture.kind, float(texture.coverage.mean()) / 255)
    half_width = 0.5 * cell * np.sqrt(overlap / (aspect * max(mean, 0.05)))
    return _Layer(cell, places, rng.random(rows * columns), np.array([aspect * half_width, half_width]))


def _tensor(picture: F64) -> F64:
    """[H, W, 3] xx, xy and yy of the structure tensor. Source: Di Zenzo 1986 (the channels add up)."""
    from scipy.ndimage import gaussian_filter

    dx, dy = (
        gaussian_filter(picture, (EDGE, EDGE, 0), order=order, mode="nearest")
        for order in ((0, 1, 0), (1, 0, 0))
    )
    return np.stack([(dx * dx).sum(2), (dx * dy).sum(2), (dy * dy).sum(2)], axis=2)


def _choose(
    picture: F64, tensor: F64, canvas: F64, layer: _Layer, budget: int
) -> tuple[NDArray[np.intp], F64, F64]:
    """Rows of the cells that are painted, in the order of painting; their colors and directions."""
    from scipy.ndimage import gaussian_filter

    deviation = BLUR * float(layer.half_extents.min())
    factor = max(1, int(deviation / MIN_BLUR))  # a blurred picture needs no more pixels than that

    def blurred(values: F64, deviation: float) -> F64:
        return np.asarray(gaussian_filter(values, (*2 * (deviation / factor,), 0), mode="nearest"))

    target = blurred(_reduced(picture, factor), deviation)
    squares = ((target - _reduced(canvas, factor)) ** 2).mean(axis=2, keepdims=True)
    errors = np.sqrt(_sample(blurred(squares, 0.5 * layer.cell), layer.places / factor)[:, 0])
    best = np.argsort(-errors, kind="stable")[:budget]
    rows = best[errors[best] > ENOUGH]
    rows = rows[np.argsort(layer.keys[rows], kind="stable")]
    places = layer.places[rows] / factor
    edges = _sample(blurred(_reduced(tensor, factor), TENSOR_REACH * layer.cell), places)
    return rows, np.clip(_sample(target, places), 0, 1), _directions(edges)


def _directions(tensors: F64) -> F64:
    """[n] radians in (-pi/2, pi/2] along the edges of [n, 3] structure tensors; 0 where there is no edge."""
    xx, xy, yy = tensors.T
    across = 0.5 * np.arctan2(2 * xy, xx - yy)
    along = np.where(across > 0, across - np.pi / 2, across + np.pi / 2)
    return np.where(xx + yy < NO_EDGE, 0.0, along)


def _reduced(values: F64, factor: int) -> F64:
    """[ceil(H / factor), ceil(W / factor), C] means of square blocks; the border is repeated outside."""
    height, width, channels = values.shape
    padding = (0, -height % factor), (0, -width % factor), (0, 0)
    blocks = np.pad(values, padding, mode="edge") if factor > 1 else values
    rows, columns = blocks.shape[0] // factor, blocks.shape[1] // factor
    return np.asarray(blocks.reshape(rows, factor, columns, factor, channels).mean(axis=(1, 3)))


def _sample(values: F64, places: F64) -> F64:
    """[n, C] of [H, W, C] at places (x, y), linear between the centers of pixels."""
    from scipy.ndimage import map_coordinates

    at = places.T[::-1] - 0.5
    channels = [map_coordinates(values[..., i], at, order=1, mode="nearest") for i in range(values.shape[2])]
    return np.stack(channels, axis=1)


def _boxes(layers: Sequence[tuple[Any, ...]]) -> Boxes:
    """Boxes of some layers of strokes in the order of painting; the one painted last is the nearest."""
    counts = [len(layer[0]) for layer in layers]
    centers, angles, colors, ids = (np.concatenate([layer[i] for layer in layers]) for i in (0, 2, 3, 4))
    half_extents = np.repeat([layer[1] for layer in layers], counts, axis=0)
    total = len(centers)
    columns = (centers, half_extents, angles, np.arange(1.0, total + 1), colors, np.ones(total))
    floats = [np.asarray(column, np.float32) for column in columns]
    back = slice(None, None, -1)
    centers, half_extents, angles, depths, colors, opacities = floats
    return Boxes(
        centers[back],
        half_extents[back],
        angles[back],
        depths,
        colors[back],
        opacities,
        ids[back].astype(np.int32),
    )


@dataclass
class PainterlyPainter:
    """A configuration of the temporal report: the plain picture of each frame, painted alone."""

    texture: StrokeTexture
    num_strokes: int
    filter: Filter
    seed: int
    background: Sequence[float] | Array
    num_threads: int | None
    name: str = "image"
    what: str = "each plain picture painted alone"
    timer: PaintTimer = field(default_factory=PaintTimer)

    def paint(self, index: int, plain: Array) -> Frame:
        """One frame, from the plain picture of that frame and nothing else."""
        with self.timer.draw.running():
            frame = paint_image(
                plain,
                self.texture,
                num_strokes=self.num_strokes,
                seed=self.seed,
                filter=self.filter,
                background=self.background,
                num_threads=self.num_threads,
            )
        self.timer.frames += 1
        return frame

    def marks(self, index: int, plain: Array) -> Boxes:
        """The strokes of that frame: those of one cell of the picture have one id in all frames."""
        return image_boxes(
            plain,
            self.texture,
            num_strokes=self.num_strokes,
            seed=self.seed,
            filter=self.filter,
            background=self.background,
            num_threads=self.num_threads,
        )


def painterly_painters(comparison: Comparison, num_threads: int | None) -> list[PainterlyPainter]:
    """For `measure_stability(make_extra_painters=...)`: as many strokes of the same brush, equal seeds.

    Of several brushes the first.
    """
    texture = comparison.texture
    return [
        PainterlyPainter(
            texture.textures[0] if isinstance(texture, BrushSet) else texture,
            len(comparison.strokes),
            comparison.options.filter,
            0,
            comparison.background,
            num_threads,
        )
    ]
