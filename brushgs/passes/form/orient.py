"""Turn strokes within their own plane, along the form they depict.

Clustering gives strokes that are about as long as wide, in random directions: paint on a plank lies across
it. Here each stroke gets a direction from its surroundings, smoothed over neighbors in space. Strokes
without a clear direction stay, and slender ones keep their axis. Position, normal, thickness, area, opacity
and color stay. A stroke becomes at most `ASPECT` times as long as wide; less where neighbors disagree, and
never thinner than thick.

Direction (as twice the angle) and aspect (as logarithm) form one 2D vector, so that shapes change without
jumps.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.guides import Guides
from brushgs.options.direction import Direction
from brushgs.passes.color.color_space import Space
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.mark_directions import Marks, mark_wish
from brushgs.passes.form.neighborhood import Neighborhood
from brushgs.passes.form.open_field import open_field
from brushgs.passes.form.planes import Planes, Wish, blocks, pairs_of, ramp, unit_pairs
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import base_colors

# Largest aspect of turned strokes. Measured with flat and impasto at 6000 strokes on five scenes: 1.8 to 2.2
# are within 0.02 dB of each other, 2.6 loses 0.03.
ASPECT = 2.2
# Aspects between which strokes increasingly keep their own direction and aspect. Starting at 1.3 loses 0.03
# dB, ending at 1.6 another 0.05: medium aspects are still random.
OWN = (1.1, ASPECT)
SURE = 0.3  # confidence above which the field decides; below it the own shape is kept more and more
SLENDER = (4.0, 6.0)  # the same for directions set by the user: ropes and grass stay as they are
OWN_COUNTS = (1.1, 1.6)  # aspects over which a stroke's own direction gains weight for its neighbors
UNSURE = 0.05  # weight of having no direction, so that noise on a surface of one color has no effect
WISH = 4.0  # weight of a direction set by the user, where fully clear; a field has up to 4.2
# Lengths of the own field over which it gains priority over the marks of a style, and the share of these that
# it then replaces: smooth places follow the flow of the painting, form keeps its own direction.
FORMED, FORM = (0.3, 1.5), 0.7
ROUNDING = 1e-9  # of a ratio of scales
# Default for signs: a direction that is not perpendicular to any likely axis of a scene.
HEADING = np.array([0.61, 0.53, 0.59])


@dataclass(frozen=True)
class Weights:
    """Weights of the parts of a direction field.

    Attributes:
        own: long axis of slender strokes.
        color: lines of equal color on the surface.
        curvature: direction of least curvature.
        long: direction in which the surface extends.
    """

    own: float
    color: float
    curvature: float
    long: float


FIELDS: Mapping[str, Weights] = {
    # Own axes at 1.2 instead of 2.4 lose up to 0.03 dB; without curvature and extent 0.02.
    "form": Weights(own=2.4, color=1.0, curvature=0.4, long=0.4),
    "color": Weights(own=0.0, color=1.0, curvature=0.0, long=0.0),
}


def orient(
    strokes: Gaussians,
    gaussians: Gaussians,
    field: str | Direction | Guides | Marks = "form",
    *,
    camera: Camera | None = None,
) -> Gaussians:
    """Turn strokes within their own plane, along the form they depict.

    Args:
        strokes: n strokes; their plane is perpendicular to their shortest axis.
        gaussians: the scene they were made of, for surface colors.
        field: "form": along lines of equal color, least curvature, extent of the surface, and slender
            strokes nearby. "color": only along lines of equal color. "own": unchanged. "guides:FILE": along
            lines in space, see `read_guides`; "painting:FILE": as the brush marks of a picture, see
            `mark_wish`; both fall back to "form". Or a parsed `Direction`, or opened `Guides` or `Marks`, see
            `open_field`.
        camera: the view that a painting from a file lies over.

    Returns:
        The strokes in their order and dtype, with other quats and scales; the input itself if nothing can
        change.

    Raises:
        ValueError: if the field is unknown, or a painting lacks its camera.
        SceneError: if the file cannot be used.

    Strokes with an aspect above 2.2 keep their axes (above 6 under guides and marks). Signs are chosen so
    that neighbors point the same way: with the lock "anchor", stroke images run along the longest axis. Up
    to rounding the result does not depend on unit, position, order of rows or number of threads; equal input
    gives bit-identical output.

    Example:
        >>> along = bg.orient(strokes, gaussians, "form")
        >>> len(along) == len(strokes)
        True
    """
    if isinstance(field, str):
        field = Direction.of(field)
    opened = open_field(field, camera) if isinstance(field, Direction) else field
    if opened == "own" or len(strokes) == 0 or len(gaussians) == 0:
        return strokes
    planes = Planes.of(strokes)
    around = Neighborhood.of(planes, strokes)
    mix = FIELDS[opened if isinstance(opened, str) else "form"]
    pairs, weights = _field(planes, around, gaussians, mix)
    turnable = 1 - ramp(planes.aspects, *OWN)
    headings = np.broadcast_to(HEADING, planes.means.shape)
    aspects, marked = np.full(len(planes), ASPECT), np.zeros(len(planes))
    if not isinstance(opened, str):
        wish = guide_wish(opened, planes) if isinstance(opened, Guides) else mark_wish(opened, planes)
        wished = wish.pairs
        if isinstance(opened, Marks) and opened.aspect is not None:
            wished = wished * (1 - FORM * ramp(np.hypot(pairs[:, 0], pairs[:, 1]), *FORMED))[:, None]
        say = np.hypot(wished[:, 0], wished[:, 1])
        pairs = (1 - say)[:, None] * pairs + WISH * wished
        weights = (1 - say) * weights + WISH * say
        turnable = np.maximum(turnable, say * (1 - ramp(planes.aspects, *SLENDER)))
        if isinstance(opened, Marks) and opened.aspect is not None:
            marked = say / max(opened.clearest, np.finfo(np.float64).tiny)
            aspects *= (opened.aspect / ASPECT) ** marked
        headings = np.where(wish.headings.any(axis=1, keepdims=True), wish.headings, headings)
    smooth = around.smoothed(planes.lift(pairs, weights))
    shapes = _shapes(planes, *planes.lower(smooth), turnable, aspects, marked)
    return _shaped(strokes, planes, shapes, turnable > 0, around, headings)


def _field(planes: Planes, around: Neighborhood, gaussians: Gaussians, mix: Weights) -> tuple[F64, F64]:
    """Directions of a field before smoothing: pairs [n, 2] and their weights [n]."""
    surface = surface_around(planes, gaussians)
    own = np.zeros((len(planes), 2))
    own[:, 0] = ramp(planes.aspects, *OWN_COUNTS)
    parts = [(mix.own, own), (mix.color, surface.color), (mix.long, surface.long)]
    if mix.curvature:
        parts.append((mix.curvature, around.least_curvature(planes)))
    pairs, weights = np.zeros((len(planes), 2)), np.zeros(len(planes))
    for weight, part in parts:
        pairs += weight * part
        weights += weight * np.hypot(part[:, 0], part[:, 1])
    return pairs, weights


def _shapes(planes: Planes, pairs: F64, weights: F64, turnable: F64, aspects: F64, marked: F64) -> F64:
    """The shapes of strokes, [n, 2]: pairs whose weight is the logarithm of the aspect.

    Args:
        planes: of the strokes.
        pairs: [n, 2] smoothed directions.
        weights: [n] of the pairs: the more they exceed the pairs' lengths, the less neighbors agree.
        turnable: [n] share of the shape that the field decides, 0 to 1.
        aspects: [n] largest aspect of turned strokes.
        marked: [n] 0 to 1, how far guides or marks apply; such strokes may get as thin as they are wide.
    """
    directions, agreement = unit_pairs(pairs)
    confidence = 2 * agreement / (weights + agreement + UNSURE)  # 1 - smaller / larger eigenvalue, damped
    wanted = np.log1p((aspects - 1) * confidence)[:, None] * directions
    own = np.zeros_like(wanted)
    own[:, 0] = np.log(np.minimum(planes.aspects, np.finfo(np.float64).max))
    shapes = (1 - turnable * ramp(confidence, 0.0, SURE))[:, None] * own + turnable[:, None] * wanted
    directions, logs = unit_pairs(shapes)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        thinnest = 2 * np.log(planes.sizes / planes.scales[:, 2])  # where the middle axis is as thin
    limit = np.maximum(own[:, 0], np.where(planes.scales[:, 2] > 0, thinnest, np.inf))
    limit = np.maximum(limit, marked * np.log(aspects))
    return directions * np.minimum(logs, limit)[:, None]


def _shaped(
    strokes: Gaussians, planes: Planes, shapes: F64, is_free: Mask, around: Neighborhood, headings: F64
) -> Gaussians:
    """The strokes with these shapes [n, 2], signs aligned with their neighbors."""
    angles = 0.5 * np.arctan2(shapes[:, 1], shapes[:, 0])
    logs = np.hypot(shapes[:, 0], shapes[:, 1])
    along, across, normals = (planes.axes[:, i] for i in range(3))
    turned = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across
    directions = around.agreed(np.where(is_free[:, None], turned, along), headings)
    is_same = ~is_free & (directions == along).all(axis=1)
    # Columns of a rotation are right-handed; so are longest, middle and shortest, unless their order is an
    # odd permutation.
    is_even = (planes.order[:, 1] - planes.order[:, 0]) % 3 == 1
    beside = np.cross(normals, directions) * np.where(is_even, 1.0, -1.0)[:, None]
    rotations = np.empty((len(planes), 3, 3))
    _put(rotations.transpose(0, 2, 1), planes.order[:, :, None], [directions, beside, normals])
    scales = np.empty_like(strokes.scales)
    sizes, stretch = planes.sizes, np.exp(0.5 * logs)
    longest = np.where(is_free, sizes * stretch, planes.scales[:, 0])
    middle = np.where(is_free, sizes / stretch, planes.scales[:, 1])
    # Undo rounding below the thickness; marks may become thinner.
    thick = planes.scales[:, 2]
    middle = np.where(middle > (1 - ROUNDING) * thick, np.maximum(middle, thick), middle)
    largest = np.finfo(scales.dtype).max
    _put(scales, planes.order, [np.minimum(longest, largest), middle, np.minimum(thick, middle)])
    quats = np.where(is_same[:, None], strokes.quats, quats_of(rotations).astype(scales.dtype))
    return replace(strokes, quats=quats, scales=scales)


def _put(target: Array, order: NDArray[np.intp], columns: list[F64]) -> None:
    """Write values of the longest, middle and shortest axis to their columns."""
    np.put_along_axis(target, order, np.stack(columns, axis=1).astype(target.dtype), axis=1)


# Stroke directions along guides: that of the nearest line in space, weaker with distance.


REACH = 0.1  # scene radii, default reach of guides
STEP = 0.125  # of the reach, spacing of the search points on a guide
MOST_PLACES = 1 << 18  # maximum number of search points of all guides


def guide_wish(guides: Guides, planes: Planes) -> Wish:
    """The directions of strokes by guides.

    A stroke on a guide follows it fully, one at `reach` and beyond not at all; a guide perpendicular to the
    plane of a stroke has no effect. Strokes point in the direction in which the line was drawn.
    """
    center, radius = robust_frame(planes.means)
    reach = (guides.reach or REACH * radius) / radius
    starts, ends = (guides.starts - center) / radius, (guides.ends - center) / radius
    means = (planes.means - center) / radius
    along = ends - starts
    lengths = np.linalg.norm(along, axis=1)
    segments = _nearest_segments(starts, along, lengths, reach, means)
    units = along / np.where(lengths > 0, lengths, 1.0)[:, None]
    tangents, offsets = units[segments], means - starts[segments]
    at = np.clip(np.einsum("ni,ni->n", offsets, tangents), 0, lengths[segments])
    distances = np.linalg.norm(offsets - at[:, None] * tangents, axis=1)
    say = np.maximum(1 - np.minimum(distances / reach, 1) ** 2, 0) ** 2
    return Wish(say[:, None] * pairs_of(planes.project(tangents)), say[:, None] * tangents)


def _nearest_segments(starts: F64, along: F64, lengths: F64, reach: float, means: F64) -> Rows:
    """The segment that is nearest to each of the means, [n], to within half a step."""
    step = max(STEP * reach, float(lengths.sum()) / MOST_PLACES)
    counts = np.maximum(np.ceil(lengths / step), 1).astype(np.int64)
    owners = np.repeat(np.arange(len(starts)), counts)
    ranks = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
    places = starts[owners] + ((ranks + 0.5) / counts[owners])[:, None] * along[owners]
    _, rows = nearest(places, means, 1)
    return np.asarray(owners[rows[:, 0]])


# Directions of constant color, and of the surface's extent, from the Gaussians around each stroke.
#
# Gaussians are finer than strokes, so they show edges that strokes cross. The unit of length is the distance
# of the farthest neighbor, whose weight is zero: the result depends neither on unit and position of the
# scene, nor on the choice between equally far neighbors.


NUM_NEIGHBORS = 20
SURFACE = 0.6  # share of the Gaussians used, those with the most paint: the others are mostly hidden
FARTHEST = 1e6  # scene radii; larger distances are clipped
# Step of color across a stroke with weight 1/2, CIELAB / 100: 3 units are just visible side by side.
HALF_STEP = 0.03
FLATNESS = 0.02  # of the spread of neighbors, added to it: against neighbors on a line
LONG = (0.5, 0.9)  # 1 - smaller / larger spread over which neighbors count as elongated; 0.4 by chance
LEAST_SPREAD = 1e-12  # squared distances of the farthest neighbor


@dataclass(frozen=True, eq=False)
class Surface:
    """Directions from the Gaussians around n strokes, as pairs in the planes of the strokes.

    Attributes:
        color: [n, 2] along lines of equal color; weight 0 to 1, 1/2 for a step of `HALF_STEP`.
        long: [n, 2] along the extent of the surface; weight 0 to 1, 0 if it is as long as wide, or no
            surface.
    """

    color: F64
    long: F64


def surface_around(planes: Planes, gaussians: Gaussians) -> Surface:
    """Find these directions for strokes.

    Args:
        planes: of the strokes.
        gaussians: the N >= 1 Gaussians of the strokes.
    """
    near = _Near.of(gaussians, planes.means)
    color, long = np.empty((2, len(planes), 2))
    for rows in blocks(len(planes)):
        color[rows], long[rows] = _surface_of(planes.take(rows), near, rows)
    return Surface(color, long)


def _surface_of(planes: Planes, near: "_Near", rows: slice) -> tuple[F64, F64]:
    """Both fields of `Surface`, for some rows of the strokes."""
    weights, offsets, reach, colors = near.around(rows)
    offsets -= np.einsum("nk,nki->ni", weights, offsets)[:, None]
    colors -= np.einsum("nk,nkc->nc", weights, colors)[:, None]
    flat = offsets @ planes.axes.transpose(0, 2, 1)  # along, across, off the plane
    weighted = weights[:, :, None] * flat
    moments = weighted.transpose(0, 2, 1) @ flat
    xx, yy, zz = (moments[:, i, i] for i in range(3))
    xy = moments[:, 0, 1]
    slopes = _solved(xx, xy, yy, weighted[:, :, :2].transpose(0, 2, 1) @ colors)
    products = slopes @ slopes.transpose(0, 2, 1)
    across, contrast = unit_pairs(
        np.stack([products[:, 0, 0] - products[:, 1, 1], 2 * products[:, 0, 1]], axis=1)
    )
    with np.errstate(over="ignore"):
        sizes = np.minimum(planes.sizes / reach, FARTHEST)
    steps = np.sqrt(contrast) * sizes  # of color, across the stroke
    long, difference = unit_pairs(np.stack([xx - yy, 2 * xy], axis=1))
    widest, narrow = 0.5 * (xx + yy + difference), 0.5 * (xx + yy - difference)
    is_long = ramp(difference / np.maximum(widest, LEAST_SPREAD), *LONG)
    is_flat = 1 - np.minimum(zz / np.maximum(narrow, LEAST_SPREAD), 1)
    return -across * (steps / (steps + HALF_STEP))[:, None], long * (is_long * is_flat)[:, None]


@dataclass(frozen=True, eq=False)
class _Near:
    """The Gaussians of the surface nearest to each stroke. Positions are in scene radii from the center.

    Attributes:
        places: [n, 3] positions of the strokes.
        distances: [n, k] to the nearest Gaussians, nearest first.
        found: [n, k] the rows of these.
        points: [S, 3] positions of the Gaussians.
        radius: of the scene, world units.
        shares: [S] root of their paint over that of the largest.
        sh: [S, k, 3] their colors.
    """

    places: F64
    distances: F64
    found: NDArray[np.int64]
    points: F64
    radius: float
    shares: F64
    sh: Array

    @classmethod
    def of(cls, gaussians: Gaussians, means: F64) -> "_Near":
        paint = paint_of(gaussians)
        rank = int((1 - SURFACE) * len(paint))
        rows = np.flatnonzero(paint >= np.partition(paint, rank)[rank])
        center, radius = robust_frame(gaussians.means)
        points, places = (
            np.clip((x - center) / radius, -FARTHEST, FARTHEST) for x in (gaussians.means[rows], means)
        )
        distances, found = nearest(points, places, min(NUM_NEIGHBORS, len(rows)))
        shares = np.sqrt(paint[rows] / max(float(paint.max()), np.finfo(np.float64).tiny))
        return cls(places, distances, found, points, radius, shares, gaussians.sh[rows])

    def around(self, strokes: slice) -> tuple[F64, F64, F64, F64]:
        """Weights [n, k], positions [n, k, 3], their unit [n], world units, and colors [n, k, 3]."""
        places, distances, found = (x[strokes] for x in (self.places, self.distances, self.found))
        reach = np.where(distances[:, -1] > 0, distances[:, -1], 1.0)
        weights = (1 - (distances / reach[:, None]) ** 2) ** 2 * self.shares[found]
        totals = weights.sum(axis=1, keepdims=True)
        weights /= np.where(totals > 0, totals, 1.0)
        used, local = np.unique(found, return_inverse=True)
        colors = Space("lab").to(base_colors(self.sh[used]))[local.reshape(found.shape)]
        offsets = (self.points[found] - places[:, None]) / reach[:, None, None]
        return weights, offsets, reach * self.radius, colors


def _solved(xx: F64, xy: F64, yy: F64, sides: F64) -> F64:
    """Solve [[xx, xy], [xy, yy]] s = sides, [n, 2, 3], for well-conditioned matrices."""
    more = FLATNESS * (xx + yy) + LEAST_SPREAD
    xx, yy = xx + more, yy + more
    scaled = np.stack(
        [
            yy[:, None] * sides[:, 0] - xy[:, None] * sides[:, 1],
            xx[:, None] * sides[:, 1] - xy[:, None] * sides[:, 0],
        ],
        axis=1,
    )
    return np.asarray(scaled / (xx * yy - xy * xy)[:, None, None])
