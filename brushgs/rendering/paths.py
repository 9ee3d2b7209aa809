"""Convert a painted view to paths: one or more per visible stroke, in painting order.

A stroke is sampled along its axis, and cut where the depth test or a later coat hides it. Nearer strokes of
its own coat cover it, as in the picture.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.rendering.marks import LaidCoat
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F64, Array, Mask, Rows, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.paths import Path2D, PathGroup, Paths

STEPS = 17  # samples along the axis of a stroke
SHOWN = 0.5  # visible share from which a sample is drawn
THIN, SLENDER = 4.5, 1.1  # lines: largest width, px of a 1000 x 750 picture; least length over width
THIN_PIXELS = 3.0  # width that is a line at any size, px: the low-pass of projection widens thin strokes
DOT, ROUND = 8.0, 1.1  # dots: largest diameter, px of a 1000 x 750 picture; largest length over width
STRIPS, BINS = 10, 32  # bristles of a brush, and samples along them
COVERED = 0.1  # transmittance of later coats below which a line under them is cut
JOINED = 1.2  # largest gap between pieces of one line, in widths
ALIKE = 0.2  # largest difference of the paint of pieces in one path, relative to the larger
# Width of a path over that of a brush of the same paint. It is wider, as a brush has soft sides; or narrower
# where the paper takes paint, as that takes more of the sides.
NARROWER, WIDER = 0.85, 1.03
# Of dots: `WIDER`, and more by a factor for each px of half width below one of which they are like other
# paths. Renderers draw circles of a pixel as polygons, and lose up to a tenth of their area.
SMALL_DOT, WIDER_DOT, WIDEST_DOT = 1.2, 0.24, 1.12
AROUND = 3  # px, side of the window in which the paint taken by paper is averaged
FAINTEST = 2 * MIN_ALPHA  # opacity below which a path is omitted


class _Runs(NamedTuple):
    """Visible parts of strokes, [R] each: box, start and end along it, -1 to 1, and share of its paint."""

    boxes: Rows
    starts: F64
    ends: F64
    shares: F64

    def take(self, rows: Rows) -> "_Runs":
        """The runs at these rows."""
        return _Runs(self.boxes[rows], self.starts[rows], self.ends[rows], self.shares[rows])


def paths_of(
    laid: Sequence[LaidCoat],
    camera: Camera,
    ground: tuple[float, float, float] | None = None,
    region_names: Sequence[str] = (),
) -> Paths:
    """Convert the strokes of a view to paths.

    Args:
        laid: its coats, in the order of laying.
        camera: the view.
        ground: RGB behind the paths; None for transparent.
        region_names: names of the regions from 1 on.
    """
    groups: list[PathGroup] = []
    passed = np.ones((camera.height, camera.width))
    for coat in reversed(laid):
        groups[:0] = _groups(coat, passed, camera, region_names)
        if coat.tint is None:
            passed = passed * (1 - coat.alpha)
    return Paths(camera.width, camera.height, ground, tuple(groups))


def _groups(laid: LaidCoat, passed: F64, camera: Camera, names: Sequence[str]) -> list[PathGroup]:
    areas = None if laid.picture is None or laid.coat.effect is None else laid.coat.effect.areas(laid.picture)
    if areas is not None:
        found = ((outlines(laid.alpha * shares), color) for shares, color in areas)
        paths = tuple(Path2D("area", points, 0.0, color, 1.0) for points, color in found if len(points))
        return [PathGroup(laid.coat.name, "", False, paths)] if paths else []
    runs = _shown(laid, passed, _are_lines(laid, camera) | _are_dots(laid, camera))
    regions = np.zeros(laid.num_rows, np.intp)
    own = laid.coat.strokes.regions
    if own is not None:
        regions[: len(own)] = own
    of_runs, depths = regions[laid.boxes.ids[runs.boxes]], laid.boxes.depths[runs.boxes]
    groups = []
    # Farther regions are painted first, by the median depth of their strokes.
    labels = sorted(np.unique(of_runs), key=lambda label: -float(np.median(depths[of_runs == label])))
    for label in labels:
        rows = np.flatnonzero(of_runs == label)
        some = runs.take(rows)
        paths = tuple(path for path in _paths(laid, some, camera) if path.opacity >= FAINTEST)
        name = names[label - 1] if 0 < label <= len(names) else f"region {label}" if label else ""
        if paths:
            groups.append(PathGroup(laid.coat.name, name, laid.coat.blend == "glaze", paths))
    return groups


def _are_lines(laid: LaidCoat, camera: Camera) -> Mask:
    """[M] whether a box is drawn as a line."""
    brushes, half = BrushSet.of(laid.coat.texture), laid.boxes.half_extents
    thin = max(THIN * canvas_scale(camera.width, camera.height), THIN_PIXELS)
    is_thin = (2 * half[:, 1] <= thin) & (half[:, 0] >= SLENDER * half[:, 1])
    return np.asarray(is_thin & (brushes.kind == "image"))


def _are_dots(laid: LaidCoat, camera: Camera) -> Mask:
    """[M] whether a box is drawn as a dot, and not as a line."""
    half, most = laid.boxes.half_extents, DOT * canvas_scale(camera.width, camera.height)
    is_round = (2 * half[:, 1] <= most) & (half[:, 0] <= ROUND * half[:, 1])
    is_image = BrushSet.of(laid.coat.texture).kind != "gaussian"
    return np.asarray(is_round & is_image & ~_are_lines(laid, camera))


def _shown(laid: LaidCoat, passed: F64, is_line: Mask) -> _Runs:
    """The visible parts of the strokes of a coat, the farthest first; only lines and dots are cut here."""
    boxes, steps = laid.boxes, np.linspace(-1, 1, STEPS)
    along = np.stack([np.cos(boxes.angles), np.sin(boxes.angles)], axis=1) * boxes.half_extents[:, :1]
    points = boxes.centers[:, None] + steps[:, None] * along[:, None]
    height, width = passed.shape
    with np.errstate(invalid="ignore"):
        columns = np.clip(points[..., 0], 0, width - 1).astype(np.intp)
        rows = np.clip(points[..., 1], 0, height - 1).astype(np.intp)
    shown = _fade(laid, np.arange(len(boxes)), points)
    # Areas are painted over, and cut later; lines and dots may be plotted, so hidden parts are removed.
    shown[is_line] *= passed[rows[is_line], columns[is_line]] > COVERED
    shown[~is_line] = np.maximum(shown[~is_line], 1)
    taken = shown
    if laid.share is not None and laid.coat.effect is None:
        taken = shown * _taken(laid, laid.share)[rows, columns]
    is_shown = np.zeros((len(boxes), STEPS + 2), np.int8)
    is_shown[:, 1:-1] = shown > SHOWN
    change = np.diff(is_shown, axis=1)[::-1]
    box, first = np.nonzero(change == 1)
    _, end = np.nonzero(change == -1)
    box = len(boxes) - 1 - box
    half = 1 / (STEPS - 1)
    starts = np.where(first == 0, -1, steps[first] - half)
    ends = np.where(end == STEPS, 1, steps[end - 1] + half)
    totals = np.pad(np.cumsum(taken, axis=1), ((0, 0), (1, 0)))
    shares = (totals[box, end] - totals[box, first]) / (end - first)
    return _Runs(box, np.maximum(starts, -1), np.minimum(ends, 1), shares)


def _taken(laid: LaidCoat, share: Array) -> F64:
    """[H, W] share of the paint taken by the paper, averaged around each pixel of `share`."""
    painted = np.divide(laid.alpha, share, out=np.zeros_like(laid.alpha), where=share > 0)
    around = [uniform_filter(one.astype(np.float64), AROUND) for one in (laid.alpha, painted)]
    return np.asarray(np.minimum(around[0] / np.maximum(around[1], 1e-9), 1))


def _paths(laid: LaidCoat, runs: _Runs, camera: Camera) -> Iterator[Path2D]:
    brushes, boxes = BrushSet.of(laid.coat.texture), laid.boxes
    covers = [_covers(texture) for texture in brushes.textures]
    solid = np.array([_solid(texture) for texture in brushes.textures])
    rows = runs.boxes
    brush = np.zeros(len(rows), np.intp)
    if boxes.brushes is not None and len(covers) > 1:
        brush = boxes.brushes[rows].astype(np.intp)
    half = boxes.half_extents[rows].astype(np.float64)
    is_thin, is_dot = _are_lines(laid, camera)[rows], _are_dots(laid, camera)[rows]
    colors = np.clip(boxes.colors[rows].astype(np.float64), 0, 1)
    opacities = boxes.opacities[rows] * runs.shares
    opacities[is_dot] *= (0.5 * (runs.ends - runs.starts))[is_dot]  # of a dot half hidden, half of the paint
    axes = np.stack([np.cos(boxes.angles[rows]), np.sin(boxes.angles[rows])], axis=1)
    normals = axes[:, ::-1] * (-1, 1)
    centers = boxes.centers[rows].astype(np.float64)
    if is_thin.any():
        yield from _lines(np.flatnonzero(is_thin), laid, runs, solid[brush])
    wide = np.flatnonzero(~is_thin)
    soft = brushes.kind == "gaussian"
    areas = [None] * len(wide) if soft else _areas(laid, rows[wide], covers, brush[wide])
    for i, area in zip(wide, areas, strict=True):
        color, opacity = tuple(colors[i].tolist()), float(opacities[i])
        if area is None:
            ends = centers[i] + np.stack([0 * axes[i], axes[i] * half[i, 0], normals[i] * half[i, 1]])
            yield Path2D("soft", ends, 0.0, color, opacity)
        elif is_dot[i]:
            wider = float(np.clip(1 + WIDER_DOT * (SMALL_DOT - half[i, 1]), WIDER, WIDEST_DOT))
            size = 2 * wider * float(np.sqrt(half[i].prod() * 4 / np.pi * solid[brush[i]]))
            yield Path2D("dot", centers[i : i + 1], size, color, opacity / wider)
        elif len(area):
            yield Path2D("area", area, 0.0, color, opacity)


@cache
def _covers(texture: StrokeTexture) -> Mask:
    """[STRIPS, BINS] mask of where a brush covers its box (v by u), with its mean coverage as area."""
    across, along = ((np.arange(n) + 0.5) / n * 2 - 1 for n in (STRIPS, BINS))
    if texture.kind != "image":
        return np.asarray(across[:, None] ** 2 + along**2 < 1)
    coverage = texture.coverage / 255.0
    rows, columns = (
        (np.clip(at * n, -n, n - 1) + n).astype(int) // 2
        for at, n in zip((across, along), coverage.shape, strict=True)
    )
    means = uniform_filter(
        coverage, [max(n // k, 1) for n, k in zip(coverage.shape, (STRIPS, BINS), strict=True)]
    )
    found = means[np.ix_(rows, columns)]
    return np.asarray(found >= np.quantile(found, 1 - float(coverage.mean())))


@cache
def _solid(texture: StrokeTexture) -> float:
    """Mean coverage of a box by a brush; the outermost texels of an image count half (they overhang)."""
    if texture.kind != "image":
        return np.pi / 4
    rows, columns = (np.convolve(np.ones(max(n - 1, 1)), (0.5, 0.5)) for n in texture.coverage.shape)
    return float(rows @ (texture.coverage / 255.0) @ columns / (rows.sum() * columns.sum()))


def _areas(laid: LaidCoat, rows: Rows, covers: Sequence[Mask], brush: Rows) -> list[F64]:
    """For each of these boxes, its visible bristles: rectangles [K, 2] separated by NaN; K may be 0."""
    boxes = laid.boxes
    across, along = ((np.arange(n) + 0.5) / n * 2 - 1 for n in (STRIPS, BINS))
    u = np.stack([np.cos(boxes.angles[rows]), np.sin(boxes.angles[rows])], axis=1).astype(np.float64)
    v = u[:, ::-1] * (-1, 1) * boxes.half_extents[rows, 1:]
    u = u * boxes.half_extents[rows, :1]
    centers = boxes.centers[rows].astype(np.float64)
    places = (
        centers[:, None, None] + across[:, None, None] * v[:, None, None] + along[:, None] * u[:, None, None]
    )
    inside = np.stack(covers)[brush] & (_fade(laid, rows, places) > SHOWN)
    change = np.diff(np.pad(inside, ((0, 0), (0, 0), (1, 1))).astype(np.int8), axis=2)
    box, strip, first = np.nonzero(change == 1)
    last = np.nonzero(change == -1)[2]
    sides = [first / BINS, last / BINS, strip / STRIPS, (strip + 1) / STRIPS]
    left, right, low, high = (2 * side - 1 for side in sides)
    nothing = np.full(len(box), np.nan)
    corners = np.stack([[left, right, right, left, nothing], [low, low, high, high, nothing]], axis=2)
    points = centers[box] + corners[..., :1] * u[box] + corners[..., 1:] * v[box]
    ends = np.searchsorted(box, np.arange(len(rows) + 1))
    flat = points.transpose(1, 0, 2).reshape(-1, 2)
    return [flat[5 * first : max(5 * last - 1, 5 * first)] for first, last in pairwise(ends)]


def _fade(laid: LaidCoat, rows: Rows, places: F64) -> F64:
    """Factors of the depth test on boxes at places [n, ..., 2], see `DepthTest`."""
    test = laid.in_front_of
    if test is None:
        return np.ones(places.shape[:-1])
    height, width = test.limit.shape
    x, y = (np.clip(places[..., k], 0, n - 1).astype(np.intp) for k, n in ((0, width), (1, height)))
    shape = (-1,) + (1,) * (places.ndim - 2)
    tolerance = np.maximum(test.tolerance[rows].astype(np.float64), 1e-12).reshape(shape)
    ahead = test.limit[y, x] + tolerance - laid.boxes.depths[rows].reshape(shape)
    return smoothstep(ahead / (tolerance / 2))


def _lines(thin: Rows, laid: LaidCoat, runs: _Runs, solid: F64) -> Iterator[Path2D]:
    """Thin strokes as polylines; consecutive pieces of a line whose ends meet are joined."""
    boxes = laid.boxes
    thin = thin[np.lexsort((runs.starts[thin], boxes.ids[runs.boxes[thin]]))]
    rows = runs.boxes[thin]
    half = boxes.half_extents[rows].astype(np.float64)
    axes = np.stack([np.cos(boxes.angles[rows]), np.sin(boxes.angles[rows])], axis=1) * half[:, :1]
    ends = (
        boxes.centers[rows, None]
        + np.stack([runs.starts[thin], runs.ends[thin]], axis=1)[..., None] * axes[:, None]
    )
    opacities = boxes.opacities[rows] * runs.shares[thin]
    factors = np.clip(WIDER * runs.shares[thin], NARROWER, WIDER)
    widths, opacities = 2 * half[:, 1] * solid[thin] * factors, opacities / factors
    colors = np.clip(boxes.colors[rows].astype(np.float64), 0, 1)
    lines = laid.coat.chains
    line = boxes.ids[rows].astype(np.int64)
    follows = np.diff(line, prepend=-2) <= 1
    line = line if lines is None else lines[line]
    follows[1:] &= line[1:] == line[:-1]
    follows[1:] &= (colors[1:] == colors[:-1]).all(axis=1)
    starts = np.flatnonzero(~follows)
    for first, last in zip(starts, [*starts[1:], len(thin)], strict=True):
        yield from _joined(ends[first:last], widths[first:last], opacities[first:last], tuple(colors[first]))


def _joined(ends: F64, widths: F64, opacities: F64, color: tuple[float, ...]) -> Iterator[Path2D]:
    """Polylines of consecutive pieces [n, 2, 2]; a gap or a change of paint starts a new one."""
    red, green, blue = map(float, color)
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    points, begin = [ends[0, 0], ends[0, 1]], 0

    def made(end: int) -> Path2D:
        pieces, line = slice(begin, end), np.array(points)
        weights = np.maximum(lengths[pieces], 1e-9)
        width, opacity = (np.average(one[pieces], weights=weights) for one in (widths, opacities))
        length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
        overlap = max(float(weights.sum() / max(length, 1e-9)), 1.0)  # paint adds up where pieces overlap
        return Path2D("line", line, float(width), (red, green, blue), 1 - (1 - float(opacity)) ** overlap)

    paint = widths * opacities
    for i in range(1, len(ends)):
        reach = JOINED * widths[i] + 1.0
        away = np.linalg.norm(points[-1] - ends[i], axis=1)
        if len(points) == 2 and np.linalg.norm(points[0] - ends[i], axis=1).min() < away.min():
            points.reverse()
            away = np.linalg.norm(points[-1] - ends[i], axis=1)
        if away.min() > reach:
            yield made(i)
            points, begin = [ends[i, 0], ends[i, 1]], i
            continue
        near = int(away.argmin())
        points[-1] = 0.5 * (points[-1] + ends[i, near])
        if abs(paint[i] - paint[begin]) > ALIKE * max(paint[i], paint[begin]):
            yield made(i)
            points, begin = [points[-1]], i
        points.append(ends[i, 1 - near])
    yield made(len(ends))


# Trace areas of a picture as closed polygons, by marching squares (Lorensen and Cline 1987).


# For each of the 16 cases of a square (bit k: corner k is inside; corners go round from the upper left), the
# sides that its lines lead from and to, with the inside on their right: 0 top, 1 right, 2 bottom, 3 left.
_LINES = (
    *((), ((3, 0),), ((0, 1),), ((3, 1),), ((1, 2),), ((3, 0), (1, 2)), ((0, 2),), ((3, 2),)),
    *(((2, 3),), ((2, 0),), ((0, 1), (2, 3)), ((2, 1),), ((1, 3),), ((1, 0),), ((0, 3),), ()),
)


def outlines(values: Array, level: float = 0.5) -> F64:
    """The outlines of the areas where values are above a level.

    Args:
        values: [H, W] of the pixels; 0 is assumed outside.
        level: above 0.

    Returns:
        [K, 2] (x, y) in pixels, (0, 0) is the upper left corner of the picture: closed polygons, separated by
        NaN and filled by the even-odd rule.
    """
    padded = np.pad(values.astype(np.float64), 1)
    inside = padded > level
    corners = inside[:-1, :-1], inside[:-1, 1:], inside[1:, 1:], inside[1:, :-1]
    cases = np.sum([corner.astype(np.int64) << k for k, corner in enumerate(corners)], axis=0)
    follows: dict[tuple[int, int, int], tuple[int, int, int]] = {}
    for case, lines in enumerate(_LINES):
        rows, columns = np.nonzero(cases == case)
        for begin, end in lines:
            for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
                follows[_side(row, column, begin)] = _side(row, column, end)
    found: list[F64] = []
    while follows:
        first, at = follows.popitem()
        loop = [first]
        while at != first:
            loop.append(at)
            at = follows.pop(at)
        found += [_places(np.array(loop), padded, level), np.full((1, 2), np.nan)]
    return np.concatenate(found[:-1]) if found else np.empty((0, 2))


def _side(row: int, column: int, side: int) -> tuple[int, int, int]:
    """Key of a side, shared by adjacent squares: row and column where it starts, and 1 if it goes down."""
    return row + (side == 2), column + (side == 1), side % 2


def _places(sides: Array, padded: F64, level: float) -> F64:
    """[K, 2] where the level crosses sides [K, 3]."""
    rows, columns, leads_down = sides.T
    start, end = padded[rows, columns], padded[rows + leads_down, columns + 1 - leads_down]
    share = (level - start) / (end - start)
    # The center of pixel (0, 0) is at (0.5, 0.5), and the padding moves it by one.
    return np.stack([columns + share * (1 - leads_down) - 0.5, rows + share * leads_down - 0.5], axis=1)
