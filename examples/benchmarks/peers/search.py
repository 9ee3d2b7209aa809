"""A painter that searches the picture for its strokes, in the manner of Im2Oil; written anew.

1. Sizes: as many anchors as strokes, more where the picture changes (density from the smoothed slope),
   spread by Lloyd's rounds of a weighted Voronoi diagram. A cell is as large as the detail in it is coarse.
2. Rounds, from strokes four times as wide as the cells to 0.7 times: anchors where the canvas is still wrong,
   and at each of them a dictionary of strokes: sizes, aspects and directions around the edge tangent. Each
   anchor takes the stroke that lowers the squared error of the canvas most, in the mean color of what lies
   under it; none if no stroke lowers it.
Source: Tong et al. 2022, Im2Oil: Stroke-Based Oil Painting Rendering with Linearly Controllable Fineness Via
Adaptive Sampling. It lays one stroke at each anchor and tests it against thresholds of hue and value; here
the error of the canvas decides, round by round.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.rasterize import rasterize
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes

LEAST_DENSITY = 0.03  # of the largest slope: flat parts get strokes too (1/100 in the source)
SLOPE_BLUR = 5.0  # pixels, at a picture of 640 x 360; of the density
TANGENT_BLUR = 4.0  # pixels, at the same size; of the structure tensor
LLOYD_ROUNDS = 6
NUM_ROUNDS = 8
SHRINK = (4.0, 0.7)  # sides of strokes over those of the cells, in the first round and in the last
SPENT = 1.5  # how fast the strokes of a round grow in number as they grow smaller: power of 1 / side
LEAST_ERROR = 0.02  # of the largest error: anchors lie elsewhere too
SIZES = (0.7, 1.0, 1.45)  # width of a stroke over the side of its round
ASPECTS = (1.5, 3.0, 5.0)
TURNS = (-0.35, 0.0, 0.35)  # radians from the edge tangent
SAMPLES = (11, 5)  # along and across a stroke, at which pictures are compared
MIN_HALF_WIDTH = 0.8  # pixels
BASE_SIZE = 480.0  # pixels, geometric mean of the sides of 640 x 360
LEAST_ALPHA = 0.05  # mean coverage of a stroke below which its samples have no weight


def search_boxes(picture: Array, brush: StrokeTexture, *, num_strokes: int, seed: int = 0) -> Boxes:
    """Lay strokes over a picture.

    Args:
        picture: [H, W, 3] display-encoded, 0 to 1; the canvas is white.
        brush: of all strokes.
        num_strokes: the most that are laid, >= 1.
        seed: of the first anchors.

    Returns:
        The strokes, the last one painted first. Equal input gives equal bits.

    Raises:
        ValueError: if there is not one stroke to lay.
    """
    if num_strokes < 1:
        raise ValueError(f"search_boxes: num_strokes must be at least 1, got {num_strokes}")
    from scipy.ndimage import gaussian_filter
    from scipy.spatial import cKDTree

    target = np.asarray(picture, np.float64)
    slope, angles = _edges(target)
    rng = np.random.default_rng(seed)
    canvas = np.ones_like(target)
    laid: list[Boxes] = []
    anchors, areas = _anchors(slope, num_strokes, rng)
    cells = cKDTree(anchors)
    shrink = np.geomspace(*SHRINK, NUM_ROUNDS)
    shares = shrink**-SPENT
    ends = np.rint(num_strokes * np.cumsum(shares) / shares.sum()).astype(int)
    for factor, count in zip(shrink, np.diff(ends, prepend=0), strict=True):
        if not count:
            continue
        error = ((canvas - target) ** 2).sum(axis=2)
        error = gaussian_filter(error, 0.5 * factor * np.sqrt(np.median(areas)))
        places, _ = _anchors(error if laid else slope, count, rng, least=LEAST_ERROR)
        sides = factor * np.sqrt(areas[cells.query(places, workers=1)[1]])
        laid.append(_best(target, canvas, brush, places, sides, angles))
        canvas = _painted(laid[-1], brush, canvas)
    return _stacked(laid)


def _edges(target: F64) -> tuple[F64, F64]:
    """[H, W] smoothed length of the slope, 0 to 1, and radians of the edge tangent. Source: Di Zenzo 1986."""
    from scipy.ndimage import gaussian_filter

    scale = np.sqrt(target.shape[0] * target.shape[1]) / BASE_SIZE
    dx, dy = (
        gaussian_filter(target, (1, 1, 0), order=order, mode="nearest") for order in ((0, 1, 0), (1, 0, 0))
    )
    xx, xy, yy = (
        gaussian_filter((a * b).sum(axis=2), TANGENT_BLUR * scale, mode="nearest")
        for a, b in ((dx, dx), (dx, dy), (dy, dy))
    )
    tangent = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
    slope = gaussian_filter(np.sqrt((dx * dx + dy * dy).sum(axis=2)), SLOPE_BLUR * scale / 2, mode="nearest")
    return slope / (slope.max() or 1.0), tangent


def _anchors(
    density: F64, count: int, rng: np.random.Generator, least: float = LEAST_DENSITY
) -> tuple[F64, F64]:
    """[n, 2] (x, y) pixels and [n] areas of the cells, pixels: a weighted Voronoi stippling."""
    from scipy.spatial import cKDTree

    height, width = density.shape
    weights = np.maximum(density / (density.max() or 1.0), least).reshape(-1)
    flat = rng.choice(
        len(weights), size=count, replace=count > np.count_nonzero(weights), p=weights / weights.sum()
    )
    y, x = np.divmod(np.arange(height * width), width)
    pixels = np.stack([x, y], axis=1) + 0.5
    anchors = pixels[flat] + rng.uniform(-0.3, 0.3, (count, 2))
    for _ in range(LLOYD_ROUNDS):
        cells = cKDTree(anchors).query(pixels, workers=1)[1]
        mass = np.bincount(cells, weights, count)
        sums = [np.bincount(cells, weights * pixels[:, axis], count) for axis in (0, 1)]
        is_met = mass > 0
        anchors[is_met] = np.stack(sums, axis=1)[is_met] / mass[is_met, None]
    areas = np.bincount(cKDTree(anchors).query(pixels, workers=1)[1], minlength=count)
    return anchors, np.maximum(areas, 1.0)


def _best(target: F64, canvas: F64, brush: StrokeTexture, anchors: F64, sides: F64, angles: F64) -> Boxes:
    """At each anchor the stroke of the dictionary that lowers the squared error most."""
    weights, grid = _stamp(brush)
    rows, columns = _pixel(target, anchors)
    tangents = angles[rows, columns]
    best_gain = np.full(len(anchors), -np.inf)
    extents, turned = np.zeros((len(anchors), 2)), tangents.copy()
    colors = np.zeros((len(anchors), 3))
    for size, aspect, turn in product(SIZES, ASPECTS, TURNS):
        across = np.maximum(0.5 * sides * size, MIN_HALF_WIDTH)
        half = np.stack([aspect * across, across], axis=1)
        angle = tangents + turn
        aims, now = (_sampled(picture, anchors, half, angle, grid) for picture in (target, canvas))
        color = np.clip(np.einsum("s,nsc->nc", weights, aims), 0, 1)
        gains = ((now - aims) ** 2 - (color[:, None] - aims) ** 2).sum(axis=2) @ weights
        gains *= half.prod(axis=1)
        is_better = gains > best_gain
        best_gain[is_better] = gains[is_better]
        extents[is_better], turned[is_better], colors[is_better] = (
            half[is_better],
            angle[is_better],
            color[is_better],
        )
    helps = best_gain > 0
    return _boxes(anchors[helps], extents[helps], turned[helps], colors[helps])


def _stamp(brush: StrokeTexture) -> tuple[F64, F64]:
    """[s] shares of the samples of a stroke by what it covers there, and [s, 2] their places, -1 to 1."""
    along, across = ((np.arange(n) + 0.5) / n * 2 - 1 for n in SAMPLES)
    grid = np.stack(np.meshgrid(along, across), axis=2).reshape(-1, 2)
    height, width = brush.coverage.shape
    rows, columns = ((grid[:, axis] + 1) / 2 * side for axis, side in ((1, height), (0, width)))
    alpha = brush.coverage[rows.astype(int), columns.astype(int)].astype(np.float64) / 255
    alpha[alpha < LEAST_ALPHA] = 0
    return alpha / alpha.sum(), grid


def _sampled(picture: F64, anchors: F64, half: F64, angles: F64, grid: F64) -> F64:
    """[n, s, 3] a picture at the samples of n strokes, at the nearest pixels."""
    offsets = grid * half[:, None]
    cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x = anchors[:, :1] + cos * offsets[..., 0] - sin * offsets[..., 1]
    y = anchors[:, 1:] + sin * offsets[..., 0] + cos * offsets[..., 1]
    rows, columns = _pixel(picture, np.stack([x, y], axis=2))
    return np.asarray(picture[rows, columns])


def _pixel(picture: F64, places: F64) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the pixels at places (x, y), those at the border beyond it."""
    height, width = picture.shape[:2]
    columns, rows = places[..., 0].astype(np.intp), places[..., 1].astype(np.intp)
    return np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)


def _boxes(anchors: F64, half_extents: F64, angles: F64, colors: F64) -> Boxes:
    count = len(anchors)
    floats = anchors, half_extents, angles, np.ones(count), colors, np.ones(count)
    return Boxes(*(np.asarray(each, np.float32) for each in floats), np.arange(count, dtype=np.int32))


def _painted(boxes: Boxes, brush: StrokeTexture, canvas: F64) -> F64:
    """The canvas under some more strokes, the last on top."""
    height, width = canvas.shape[:2]
    frame = rasterize(_stacked([boxes]), brush, height=height, width=width, depth=False)
    return frame.over(canvas.astype(np.float32)).astype(np.float64)


def _stacked(laid: list[Boxes]) -> Boxes:
    """All strokes, the last one laid first, each nearer than those laid before it."""
    names = ("centers", "half_extents", "angles", "colors", "opacities")
    columns = {name: np.concatenate([getattr(each, name) for each in laid])[::-1] for name in names}
    count = len(columns["angles"])
    depths, ids = np.arange(1, count + 1, dtype=np.float32), np.arange(count, dtype=np.int32)[::-1]
    return Boxes(**columns, depths=depths, ids=ids)
