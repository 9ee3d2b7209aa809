"""Strokes -> the same strokes, turned within their own plane so that they run along what they depict.

Clustering leaves strokes that are about as long as wide, and their direction to chance: paint on a plank lies
across it. Here each gets a direction from what is around it, smoothed over its neighbours in space. What no
direction is found for stays as it is, and what is slender already keeps its axis.
The place, normal, thickness, area, opacity and colour of a stroke stay. A stroke becomes at most `ASPECT`
times as long as wide; less where neighbours disagree, and never thinner than it is thick: a ball has no
plane.

Direction and aspect are chosen as one: the aspect as a logarithm, the direction as twice its angle. So a
stroke passes from one shape to another without a jump.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.guides import Guides
from brushgs.options.direction import Direction
from brushgs.passes.form.guide_lines import guide_wish
from brushgs.passes.form.mark_directions import Marks, mark_wish
from brushgs.passes.form.neighborhood import Neighborhood
from brushgs.passes.form.open_field import open_field
from brushgs.passes.form.planes import Planes, ramp, unit_pairs
from brushgs.passes.form.surface import surface_around
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of

# At most, of strokes that turn. Measured with flat and impasto at 6000 strokes on five scenes: 1.8 to 2.2 are
# within 0.02 dB of each other, 2.6 loses 0.03.
ASPECT = 2.2
# Aspects between which a stroke comes to keep its own direction and aspect. From 1.3 on loses 0.03 dB, and up
# to 1.6 only 0.05 more: strokes of medium aspect that lie across a plank are chance as well.
OWN = (1.1, ASPECT)
SURE = 0.3  # confidence from which on the field decides; below, the own shape stays more and more
SLENDER = (4.0, 6.0)  # likewise, where the user says how strokes run: ropes and grass stay what they are
OWN_COUNTS = (1.1, 1.6)  # aspects between which the own direction comes to count for the neighbours
UNSURE = 0.05  # weight of having no direction: beside it, noise on a surface of one colour is nothing
WISH = 4.0  # weight of what the user says, where it counts wholly; a field has up to 4.2
# Lengths of the own field between which it comes to count more than the marks of a style, and how much of
# these it then replaces: smooth places take the flow of a painting, form keeps its own.
FORMED, FORM = (0.3, 1.5), 0.7
ROUNDING = 1e-9  # of a ratio of scales
# Signs that have nothing else to follow: any direction that no axis of a scene is at right angles to.
HEADING = np.array([0.61, 0.53, 0.59])


@dataclass(frozen=True)
class Weights:
    """What a field of the scene is made of.

    Attributes:
        own: of the long axis of slender strokes.
        color: of lines of equal colour on the surface.
        curvature: of the direction in which the surface bends least.
        long: of the direction in which the surface extends.
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
    """Turn strokes within their own plane, along what they depict.

    Args:
        strokes: n strokes; their plane is at right angles to their shortest axis.
        gaussians: that they were made of, with the colours of the surface.
        field: "form": along lines of equal colour, the least curvature and the extent of the surface, and the
            slender strokes around. "color": along lines of equal colour alone. "own": nothing changes.
            "guides:FILE": along lines in space, see `read_guides`; "painting:FILE": as the brush marks of a
            picture, see `mark_wish`; both with "form" where they say nothing. A `Direction` is such a text
            parsed, `Guides` and `Marks` are such files opened, see `open_field`.
        camera: of a painting that is a file: takes the picture that the painting lies over.

    Returns:
        The strokes in their order and dtype, with other quaternions and scales; the input itself where
        nothing can change.

    Raises:
        ValueError: if the field is unknown, or a painting lacks its camera.
        SceneError: if the file cannot be used.

    A stroke with an aspect above 2.2 keeps its axes; under guides and marks, one above 6. Signs are chosen so
    that neighbours point the same way: the stroke image runs along the longest axis, as `project` with the
    lock "anchor" takes it. The result does not depend on unit, position, order of rows or number of threads,
    but for rounding; equal input gives equal output, bit for bit.

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
    """The directions of a field before smoothing: pairs [n, 2] and the weights [n] behind them."""
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
        weights: [n] behind them: the more these exceed the pairs, the less neighbours agree.
        turnable: [n] share of the shape that the field decides, 0 to 1.
        aspects: [n] at most, of strokes that turn.
        marked: [n] how far a stroke is a mark, which gets as thin as it is wide, 0 to 1.
    """
    directions, agreement = unit_pairs(pairs)
    confidence = 2 * agreement / (weights + agreement + UNSURE)  # 1 - smaller / larger eigenvalue, but for it
    wanted = np.log1p((aspects - 1) * confidence)[:, None] * directions
    own = np.zeros_like(wanted)
    own[:, 0] = np.log(np.minimum(planes.aspects, np.finfo(np.float64).max))
    shapes = (1 - turnable * ramp(confidence, 0.0, SURE))[:, None] * own + turnable[:, None] * wanted
    directions, logs = unit_pairs(shapes)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        thinnest = 2 * np.log(planes.sizes / planes.scales[:, 2])  # the aspect of a middle axis so thin
    limit = np.maximum(own[:, 0], np.where(planes.scales[:, 2] > 0, thinnest, np.inf))
    limit = np.maximum(limit, marked * np.log(aspects))
    return directions * np.minimum(logs, limit)[:, None]


def _shaped(
    strokes: Gaussians, planes: Planes, shapes: F64, is_free: Mask, around: Neighborhood, headings: F64
) -> Gaussians:
    """The strokes in these shapes [n, 2], pointing as their neighbours do."""
    angles = 0.5 * np.arctan2(shapes[:, 1], shapes[:, 0])
    logs = np.hypot(shapes[:, 0], shapes[:, 1])
    along, across, normals = (planes.axes[:, i] for i in range(3))
    turned = np.cos(angles)[:, None] * along + np.sin(angles)[:, None] * across
    directions = around.agreed(np.where(is_free[:, None], turned, along), headings)
    is_same = ~is_free & (directions == along).all(axis=1)
    # Columns of a rotation are right-handed: so the longest, middle and shortest are, unless they stand in an
    # odd order.
    is_even = (planes.order[:, 1] - planes.order[:, 0]) % 3 == 1
    beside = np.cross(normals, directions) * np.where(is_even, 1.0, -1.0)[:, None]
    rotations = np.empty((len(planes), 3, 3))
    _put(rotations.transpose(0, 2, 1), planes.order[:, :, None], [directions, beside, normals])
    scales = np.empty_like(strokes.scales)
    sizes, stretch = planes.sizes, np.exp(0.5 * logs)
    longest = np.where(is_free, sizes * stretch, planes.scales[:, 0])
    middle = np.where(is_free, sizes / stretch, planes.scales[:, 1])
    # What rounding makes thinner than it is thick stays so thick; a mark becomes thinner.
    thick = planes.scales[:, 2]
    middle = np.where(middle > (1 - ROUNDING) * thick, np.maximum(middle, thick), middle)
    largest = np.finfo(scales.dtype).max
    _put(scales, planes.order, [np.minimum(longest, largest), middle, np.minimum(thick, middle)])
    quats = np.where(is_same[:, None], strokes.quats, quats_of(rotations).astype(scales.dtype))
    return replace(strokes, quats=quats, scales=scales)


def _put(target: Array, order: NDArray[np.intp], columns: list[F64]) -> None:
    """Write the values of the longest, middle and shortest axes to their places."""
    np.put_along_axis(target, order, np.stack(columns, axis=1).astype(target.dtype), axis=1)
