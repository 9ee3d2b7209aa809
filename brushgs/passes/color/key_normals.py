"""The surface normal at each stroke, from strokes and views of them.

The shortest axis of a stroke is a normal without sign, and undefined for needles and crumbs: in fur and
leaves neighbors disagree. So normals are averaged over neighbors as axes, without sign, then turned toward
the views that see them, and averaged as vectors. The shorter such a mean, the less there is a surface, and
the rest is taken from a wider neighborhood. If normals point in all directions, the plane through the
positions of strokes is used: a mass of fur is lit as a mass.
Source: Toksvig 2005, Mipmapping normal maps (the length of a mean normal says how rough a surface is).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.extent import robust_frame
from brushgs.passes.form.coverage import nearest_others
from brushgs.passes.groups import add_rows
from brushgs.passes.reduce.contribution import paint_of
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.view_by_view import view_by_view
from brushgs.rendering.visibility import painted_shares
from brushgs.values.arrays import F64, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import base_colors

NUM_NEAR = 8  # strokes around one, over which axes and normals are averaged
# Neighbors, and the stride among them: for the form without a surface, and the mass behind a stroke.
NUM_WIDE, WIDE_STEP = 40, 2
LEAST_FLAT = 0.05  # minimum weight of a stroke, for needles
NUM_PATCH = 16  # neighbors for the roughness of a surface
ROUGH = (0.45, 0.8)  # roughness over which normals lose their weight; 0 if they agree, 1 for all directions
# Falloff of a neighbor's weight with its squared distance over that of the farthest neighbor.
FALLS, WIDE_FALLS = 8.0, 5.0
# OKLab distance in a and b that suggests another body; and the cap on its square, in units of that.
OTHER_PAINT, MOST_APART = 0.04, 6.0
PLACES = 1.0  # weight of the plane through positions if normals point in all directions
OTHER_SIDE = 0.05  # weight of a neighbor at right angles: edges stay
ROUNDS = 6  # of agreement among neighbors
SURE = 1.5  # lead of one side in visible area that outvotes neighbors
MOST_SHOWN = 0.05  # maximum share of a picture for one stroke
SEEN = 0.03  # visible share of a stroke's area in all views that is enough to decide its side
GUESS = 0.02  # weight of the direction out of the mass, relative to views
OUTWARD = 0.8  # weight of the direction from the scene's center, relative to the local mass, without views
_TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Around:
    """Each of k strokes and its nearest others.

    Attributes:
        centers: [k, 3] positions of strokes, scene radii.
        rows: [k, n] the stroke itself and others, nearest first.
        weights: [k, n] by paint, distance and similarity of color; sum 1.
    """

    centers: F64
    rows: NDArray[np.int64]
    weights: F64

    def means(self, values: F64) -> F64:
        """Weighted means, [k] or [k, c], of values of strokes."""
        return np.asarray(np.einsum("kn,kn...->k...", self.weights, values[self.rows]))

    def like(self, normals: F64) -> F64:
        """[k, 3] means of normals [k, 3], without the other side of a thin wall."""
        found = normals[self.rows]
        alike = (0.5 + 0.5 * np.einsum("knc,kc->kn", found, normals)) ** 2
        weights = self.weights * alike
        sums = np.einsum("kn,knc->kc", weights, found)
        return np.asarray(sums / np.maximum(weights.sum(axis=1, keepdims=True), _TINY))


@dataclass(frozen=True, eq=False)
class Facing:
    """Normals of k strokes.

    Attributes:
        normals: [k, 3] unit vectors out of the surface, world axes.
        shares: [k] agreement of neighbors, 0 (all directions) to 1 (a plane).
        shown: [k] area of each in all views, pixels.
        near: the neighbors on the surface.
        wide: the neighbors in the mass.
    """

    normals: F64
    shares: F64
    shown: F64
    near: Around
    wide: Around


def find_facing(strokes: Gaussians, views_from: Sequence[Camera] = ()) -> Facing:
    """Find the normals of strokes.

    Args:
        strokes: k strokes.
        views_from: cameras that see them; normals that no camera decides agree with their neighbors. Without
            cameras, strokes face away from the mass around them.

    Returns:
        The normals; they do not depend on the order of the strokes.
    """
    if len(strokes) == 0:
        none = Around(np.empty((0, 3)), np.empty((0, 1), np.int64), np.empty((0, 1)))
        return Facing(np.empty((0, 3)), np.empty(0), np.empty(0), none, none)
    near, patch, wide = _around(strokes)
    axes = _agreed_axes(strokes, near, patch, wide)
    out = _out_of_mass(wide)
    seen, shown = _seen_from(strokes, views_from)
    normals = _turned(axes, seen, out, near)
    agreement = np.minimum(np.linalg.norm(near.means(normals), axis=1, keepdims=True), 1)
    trust = agreement**2
    normals = trust * near.like(normals) + (1 - trust) * wide.like(normals)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 1e-9, normals / np.maximum(length, 1e-9), out)
    return Facing(normals, agreement[:, 0], shown, near, wide)


def _around(strokes: Gaussians) -> tuple[Around, Around, Around]:
    """Three neighborhoods, the nearest first."""
    center, radius = robust_frame(strokes.means)
    means = np.clip((strokes.means.astype(np.float64) - center) / radius, -1e6, 1e6)
    others = nearest_others(means, NUM_WIDE)
    rows = np.concatenate([np.arange(len(means))[:, None], others], axis=1).astype(np.int64)
    away = _squares(means[rows] - means[:, None])
    paint, lab = paint_shares(strokes), oklab_of(base_colors(strokes.sh))
    ab = np.ascontiguousarray(lab[:, 1:])
    apart = np.minimum(_squares(ab[rows] - ab[:, None]) / OTHER_PAINT**2, MOST_APART)

    def part(count: int, falls: float, step: int = 1) -> Around:
        some, squares = rows[:, : count + 1 : step], away[:, : count + 1 : step]
        reach = np.maximum(squares[:, -1:], _TINY)
        weights = np.exp(-falls * squares / reach - 0.5 * apart[:, : count + 1 : step]) * paint[some]
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), _TINY)
        return Around(means, some, weights)

    return part(NUM_NEAR, FALLS), part(NUM_PATCH, WIDE_FALLS), part(NUM_WIDE, WIDE_FALLS, WIDE_STEP)


def paint_shares(strokes: Gaussians) -> F64:
    """[k] the paint of strokes over that of the largest, above 0."""
    with np.errstate(over="ignore", invalid="ignore"):
        paint = np.nan_to_num(paint_of(strokes), nan=0.0, posinf=np.finfo(np.float64).max)
    return np.asarray(paint / max(float(paint.max()), _TINY) + 1e-6)


def _flatness(strokes: Gaussians) -> F64:
    """[k] certainty of the shortest axis: 1 for a thin sheet, small for needles and balls."""
    short, middle, _ = np.sort(strokes.scales.astype(np.float64), axis=1).T
    return np.asarray(LEAST_FLAT + (1 - LEAST_FLAT) * (1 - short / np.maximum(middle, _TINY)))


def _agreed_axes(strokes: Gaussians, near: Around, patch: Around, wide: Around) -> F64:
    """[k, 3] the common axis, of either sign, of the normals around, or of the positions of strokes."""
    axes = shortest_axes(strokes.quats, strokes.scales)
    around, flatness = axes[near.rows], _flatness(strokes)
    alike = np.einsum("kc,knc->kn", axes, around) ** 2
    own = near.weights * flatness[near.rows] * (OTHER_SIDE + (1 - OTHER_SIDE) * alike)
    same, all_ways = _tensors(own, around), _tensors(patch.weights * flatness[patch.rows], axes[patch.rows])
    rough = smoothstep((1.5 * (1 - np.linalg.eigvalsh(all_ways)[:, 2]) - ROUGH[0]) / (ROUGH[1] - ROUGH[0]))
    tensors = same + rough[:, None, None] * (all_ways - same)
    some = np.flatnonzero(rough > 0)
    places, weights = wide.centers[wide.rows[some]], wide.weights[some]
    middles = np.einsum("kn,knc->kc", weights, places)
    sizes, planes = np.linalg.eigh(_tensors(weights, places - middles[:, None]))
    is_plane = PLACES * (1 - sizes[:, 0] / np.maximum(sizes[:, 1], _TINY))
    across = planes[:, :, 0]
    tensors[some] += (rough[some] * is_plane)[:, None, None] * across[:, :, None] * across[:, None, :]
    return np.asarray(np.linalg.eigh(tensors)[1][:, :, 2])


def _tensors(weights: F64, vectors: F64) -> F64:
    """[k, 3, 3] weighted sums of the squares of vectors [k, n, 3], of trace 1."""
    sums = np.matmul((weights[:, :, None] * vectors).transpose(0, 2, 1), vectors)
    traces = np.einsum("kii->k", sums)[:, None, None]
    return np.asarray(sums / np.where(traces > 0, traces, 1.0))


def _out_of_mass(wide: Around) -> F64:
    """[k, 3] unit vectors away from the mass around strokes, and from the center of the scene."""
    means = wide.centers
    out = _unit(_unit(means - wide.means(means)) + OUTWARD * _unit(means))
    return np.where(np.abs(out).max(axis=1, keepdims=True) > 0, out, np.array([0.0, 0.0, 1.0]))


def _seen_from(strokes: Gaussians, cameras: Sequence[Camera]) -> tuple[F64, F64]:
    """[k, 3] direction to the views of each stroke, weighted by visible area; and [k] that area in all views.

    The length is 1 if a stroke is completely visible from one side, and less if only specks are visible.
    """
    kernel = StrokeTexture.open("ellipse")
    towards, areas, whole = np.zeros((len(strokes), 3)), *np.zeros((2, len(strokes)))
    means = strokes.means.astype(np.float64)

    def look(camera: Camera) -> tuple[NDArray[np.int32], F64, F64]:
        boxes, _ = project_with(strokes, camera, RenderOptions.of(kernel))
        size = camera.height, camera.width
        shown = painted_shares(boxes, kernel, np.ones(size)).astype(np.float64)
        sizes = boxes.half_extents.astype(np.float64)
        return boxes.ids, shown, np.minimum(np.pi * sizes[:, 0] * sizes[:, 1], MOST_SHOWN * size[0] * size[1])

    for camera, (ids, shown, sizes) in zip(cameras, view_by_view(look, cameras, len(strokes)), strict=True):
        add_rows(areas, ids, shown)
        add_rows(whole, ids, sizes)
        add_rows(towards, ids, shown[:, None] * _unit(camera.position - means[ids]))
    open_shares = np.minimum(areas / np.maximum(SEEN * whole, 1e-12), 1)
    return np.asarray(towards * (open_shares / np.maximum(areas, 1e-12))[:, None]), areas


def _turned(axes: F64, seen: F64, out: F64, near: Around) -> F64:
    """[k, 3] axes turned toward the views that see them, else like their neighbors."""
    unsure = 1 - np.minimum(np.linalg.norm(seen, axis=1), 1)
    side = np.einsum("ki,ki->k", axes, seen + (GUESS * unsure)[:, None] * out)
    normals = axes * np.where(side < 0, -1.0, 1.0)[:, None]
    sureness = np.abs(side)
    for _ in range(ROUNDS):
        around = near.means(normals * sureness[:, None])
        agree = np.einsum("ki,ki->k", normals, around)
        own = np.einsum("ki,ki->k", normals, axes) * side
        flip = agree + SURE * own < 0
        normals = np.where(flip[:, None], -normals, normals)
    return np.asarray(normals)


def _squares(steps: F64) -> F64:
    """[k, n] squares of the lengths of steps [k, n, c]."""
    return np.asarray(np.einsum("knc,knc->kn", steps, steps))


def _unit(vectors: F64) -> F64:
    """[n, 3] vectors of length 1; a zero vector stays zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12))
