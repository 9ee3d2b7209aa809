"""The lines of a scene, found in a few views: silhouettes, creases and marks, as strokes fixed in space."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.add.line_agreement import Sight, agreed
from brushgs.passes.add.line_chains import in_order, link
from brushgs.passes.add.line_edges import EdgePoints, Picture, edge_points
from brushgs.passes.add.line_fit import fit, strokes_of
from brushgs.passes.add.line_lift import PIXELS, SMOOTH, Chains, lift, unit_of
from brushgs.rendering.plain import PlainViews
from brushgs.rendering.render import render
from brushgs.values.along import Along
from brushgs.values.arrays import F64, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.lines import Lines

# Choose the chains of a picture that are worth a line: long or strong, without the zigzag of texture.
#
# The limit depends on the picture: a face has few and faint edges, a truck has many. So faint lines are drawn
# only if a picture has few.


SHORTEST = 20.0  # px
WORTH = 4.5  # px x strength: 40 px of 1/8
ENOUGH = 0.3  # maximum strength that counts: a short line of high contrast is still short
PEAK = 0.1  # strength that a line must have somewhere
ZIGZAG = 0.03  # radians of zigzag per px that halve the strength
RANGE = (0.5, 1.4)  # of the minimum importance that is drawn: in an empty picture, and in a full one
CLOSE, LESSER, MOSTLY = 5.0, 2.0, 0.6  # px, factor of importance, share of a chain: of a double
AMOUNT = 4300.0  # px of lines that a picture should have


def importance(points: F64, strengths: F64, steps: F64, along: Along) -> F64:
    """[C] importance of each chain, about 1 for the faintest that is drawn.

    Args:
        points: [P, 2] px, smooth.
        strengths: [P] of the edge.
        steps: [P] see `EdgePoints`; a clear outline may zigzag, as that of fur.
        along: their chains.
    """
    lengths = along.totals(along.lengths(points))
    outline = np.clip(3 * along.means(steps) - 2, 0, 1) * np.clip(10 * along.means(strengths) - 1.5, 0, 1)
    factor = 1 / (1 + ((1 - outline) * zigzag(points, along) / ZIGZAG) ** 2)
    mean = along.mean(strengths, 4)
    worth = along.totals(np.minimum(mean, ENOUGH) * along.lengths(points))
    peak = np.zeros(along.num)
    np.maximum.at(peak, along.chains, mean)
    return np.where(lengths >= SHORTEST, factor * np.minimum(worth / WORTH, peak / PEAK), 0)


def without_doubles(importances: F64, points: F64, strengths: F64, along: Along) -> F64:
    """[C] importances, 0 for chains that run close beside much longer or stronger ones.

    Such chains come from rows of Gaussians on a surface seen from the side, and from shade along an outline.
    """
    kept = np.flatnonzero(importances[along.chains] >= RANGE[0])
    chains = along.chains[kept]
    first, second = cKDTree(points[kept]).query_pairs(CLOSE, output_type="ndarray").T
    weights = along.totals(strengths)[chains]
    lesser = np.concatenate(
        [some[LESSER * weights[some] < weights[other]] for some, other in ((first, second), (second, first))]
    )
    is_close = np.zeros(len(along))
    is_close[kept[lesser]] = 1
    return np.where(along.means(is_close) > MOSTLY, 0, importances)


def least_drawn(points: F64, importances: F64, along: Along) -> float:
    """The minimum importance of drawn chains: lower in a picture with few chains.

    Args:
        points: [P, 2] px, smooth.
        importances: [C] of the chains.
        along: their chains.
    """
    lengths = along.totals(along.lengths(points))
    order = np.argsort(-importances, kind="stable")
    too_many = order[np.cumsum(lengths[order]) > AMOUNT]
    return float(np.clip(importances[too_many[0]] if len(too_many) else 0, *RANGE))


def zigzag(points: F64, along: Along) -> F64:
    """Radians of zigzag per px of each chain: its total turning minus its net turning."""
    ahead, behind = points[along.near(3)] - points, points - points[along.near(-3)]
    cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    turn = np.arctan2(cross, (behind * ahead).sum(axis=1)) / 3
    lengths = np.maximum(along.totals(along.lengths(points)), 1)
    return (along.totals(np.abs(turn)) - np.abs(along.totals(turn))) / lengths


LEAST = 0.065 * RANGE[0]  # strength of an edge
# Radians, and shares of the distance, between views that show the same lines, and nearly the same.
ALIKE, WITNESS = 0.08, 0.3
GAP = 8.0  # px, maximum gap in a line
WIDTH = 2.2  # px, of the strongest line, in a picture of 800x600
FAINT = 0.4  # of that, the width of the faintest
FULL = 0.35  # strength above which a line has its full width
LINE_SIGMAS = 1.76  # half length of a box, standard deviations: `fitted_sigmas` of the stroke "line"


def find_lines(
    gaussians: Gaussians,
    views: Sequence[Camera] | PlainViews,
    *,
    width: float = WIDTH,
    color: tuple[float, float, float] = (0.0, 0.0, 0.0),
    opacity: float = 1.0,
    num_sigmas: float = LINE_SIGMAS,
    num_threads: int | None = None,
) -> Lines:
    """Find the lines of a contour drawing of a scene.

    Edges of color and depth are found in the plain picture of each view, lifted into space by its depth and
    compared with the other views; see the modules of this folder. The first view is the picture: it is drawn
    at 480,000 pixels, and decides alone about the surfaces it sees. Other views add lines on hidden surfaces,
    for a moving camera.

    Args:
        gaussians: N Gaussians.
        views: cameras, or plain pictures already drawn; those with depth are not drawn again. Some 120,000
            pixels each are enough.
        width: px of the strongest lines in a picture of 480,000 pixels, > 0; fixed in space, so near lines
            are wider.
        color: RGB of all lines, display-encoded.
        opacity: 0 to 1.
        num_sigmas: half length of a box in standard deviations that the strokes will be drawn with, > 0:
            `fitted_sigmas` of their stroke image.
        num_threads: None takes the processors available to this process. The lines do not depend on it.

    Returns:
        The lines, those of the first view first; perhaps none.

    Raises:
        ValueError: if there is no view, or a number is out of range.
    """
    for name, value in (("width", width), ("num_sigmas", num_sigmas)):
        if not 0 < value < np.inf:
            raise ValueError(f"find_lines: {name} must be positive and finite, got {value}")
    if not 0 <= opacity <= 1:
        raise ValueError(f"find_lines: opacity must be in 0 to 1, got {opacity}")
    cameras = views.cameras if isinstance(views, PlainViews) else tuple(views)
    if len(cameras) == 0:
        raise ValueError("find_lines: views must have at least one camera, got none")
    frames = views.frames if isinstance(views, PlainViews) else (None,) * len(cameras)
    kernel = StrokeTexture.open("gaussian")

    def drawn(camera: Camera, frame: Frame | None) -> Frame:
        if (
            frame is not None
            and frame.depth is not None
            and frame.alpha.shape == (camera.height, camera.width)
        ):
            return frame
        return render(gaussians, camera, kernel, num_threads=num_threads)

    camera = in_pixels(cameras[0], PIXELS)
    first = _Traced.of(camera, drawn(camera, frames[0]))
    least = least_drawn(first.smooth, first.importances, first.along)
    found, sights = [first.lines(least, 0)], [first.sight(least)]
    for row, is_witness in others_than_first(cameras, first.distance):
        view = _Traced.of(cameras[row], drawn(cameras[row], frames[row]), only_edges=is_witness)
        found.append(view.lines(least, row))
        sights.append(view.sight(least))
    chains = agreed(found, sights, least=SHORTEST)
    strengths = np.clip(chains.strengths / FULL, 0, 1)
    widths = width * chains.sizes * (FAINT + (1 - FAINT) * np.maximum(strengths, chains.steps))
    pieces = fit(chains, widths)
    strokes = strokes_of(pieces, color, opacity, num_sigmas, gaussians)
    starts = np.flatnonzero(np.diff(chains.chains, prepend=-1))
    ranks = 1 - least / np.maximum(chains.importances[starts], least)
    return Lines(strokes, ranks[pieces.chains], pieces.chains, pieces.normals)


@dataclass(frozen=True, eq=False)
class _Traced:
    """A picture and all its candidate chains.

    Attributes:
        camera: the view.
        frame: its plain picture, with depth.
        edges: all edge points.
        rows: [P] edge points, chain after chain, in order.
        smooth: [P, 2] their smoothed positions, px.
        along: their chains.
        importances: [C] of the chains.
    """

    camera: Camera
    frame: Frame
    edges: EdgePoints
    rows: Rows
    smooth: F64
    along: Along
    importances: F64

    @classmethod
    def of(cls, camera: Camera, frame: Frame, *, only_edges: bool = False) -> "_Traced":
        """Trace a plain picture; without chains if `only_edges`."""
        edges = edge_points(Picture.of(frame), least=LEAST)
        if only_edges:
            none = np.zeros(0, np.intp)
            return cls(camera, frame, edges, none, np.zeros((0, 2)), Along.of(none), np.zeros(0))
        order = in_order(link(edges.points, edges.normals, gap=GAP))
        points, along = edges.take(order.rows), Along.of(order.chains)
        smooth = along.smooth(points.points, SMOOTH)
        importances = importance(smooth, points.strengths, points.steps, along)
        importances = without_doubles(importances, smooth, points.strengths, along)
        return cls(camera, frame, edges, order.rows, smooth, along, importances)

    @property
    def distance(self) -> float:
        """Distance of the visible surfaces, world units; 0 for an empty picture."""
        assert self.frame.depth is not None
        seen = self.frame.depth[self.frame.alpha > 0.5]
        return float(np.median(seen)) if len(seen) else 0.0

    def lines(self, least: float, view: int) -> Chains:
        """The chains of at least this importance, in space."""
        kept = self._kept(least)
        along, points = Along.of(self.along.chains[kept]), self.edges.take(self.rows[kept])
        importances = self.importances[self.along.chains[kept]]
        return lift(points, along, importances, self.camera, self.frame, view)

    def sight(self, least: float) -> Sight:
        """The edges of the view, and those worth a line."""
        lines = self.rows[self._kept(least)] if len(self.rows) else self.edges.strengths > LEAST / RANGE[0]
        return Sight.of(self.camera, self.frame, self.edges.points, self.edges.points[lines])

    def _kept(self, least: float) -> Mask:
        return np.asarray(self.importances >= least)[self.along.chains]


def in_pixels(camera: Camera, pixels: int) -> Camera:
    """The same view with about `pixels` pixels; the camera itself if it has as many."""
    factor = float(np.sqrt(pixels / (camera.width * camera.height)))
    width, height = (max(round(side * factor), 1) for side in (camera.width, camera.height))
    if (width, height) == (camera.width, camera.height):
        return camera
    scale = np.diag([width / camera.width, height / camera.height, 1.0])
    return replace(camera, K=scale @ camera.K, width=width, height=height)


def others_than_first(cameras: Sequence[Camera], distance: float) -> list[tuple[int, bool]]:
    """Cameras after the first that differ from all earlier ones, each with whether it is so similar to the
    first that it only confirms its lines.

    Args:
        cameras: the views.
        distance: of the visible surfaces.
    """
    kept = [0]
    for row, camera in enumerate(cameras):
        if not any(_is_like(camera, cameras[other], distance, ALIKE) for other in kept):
            kept.append(row)
    return [(row, _is_like(cameras[row], cameras[0], distance, WITNESS)) for row in kept[1:]]


def _is_like(camera: Camera, other: Camera, distance: float, most: float) -> bool:
    """Whether two pictures of a surface at this distance have nearly the same edges."""
    turn = np.arccos(np.clip(camera.viewmat[2, :3] @ other.viewmat[2, :3], -1, 1))
    moved = np.linalg.norm(camera.position - other.position)
    zoom = unit_of(camera) / unit_of(other)
    return bool(turn < most and moved <= most * distance and 0.8 < zoom < 1.25)
