"""Turn strokes into marks of a painting, with its direction, length and slenderness, before any fit.

Gradients turn and stretch strokes slowly, and strokes of a scene are nearly round and follow its forms: a fit
from there only changes the colors of the old marks. So strokes are first laid in the direction of the
painting's marks, with the painting over the picture of a camera, see `mark_directions`. The first camera
decides for the strokes that it sees, cameras around the scene for the others. Marks become shorter and wider
where their ends would leave the surface or reach another color (Litwinowicz 1997).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.form.mark_directions import Marks, mark_wish
from brushgs.passes.form.neighborhood import Neighborhood
from brushgs.passes.form.planes import Planes, ramp, unit_pairs
from brushgs.rendering.render import render
from brushgs.values.arrays import F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import base_colors, shift_base_colors
from brushgs.values.style import StyleMarks

IN_FRONT = 0.04  # depth tolerance of a visible stroke, relative to its depth
FACING = (0.15, 0.45)  # cosine between normal and view over which views gain weight; edge-on is unreliable
FIRST = 3.0  # weight of the first view over each of the others
STEEP = 2.0  # exponent of that cosine in the weight of views
FAINT = 1e-6  # least meaningful sum of directions
SMOOTH = 1.0  # weight of the neighbors over a stroke's own direction
LENGTHS = (0.02, 0.14)  # limits in shorter sides of the picture: longer marks hide the scene
MOST_MARKS = 12_000  # limit: the time of a step grows with the number of marks
MOST_PARTS = 12  # rows, and columns, of marks per stroke
APART = 1.0  # distance between rows of marks, in widths
OWN_SIZE = 0.7  # how far mark sizes follow stroke sizes: 0 (one size) to 1
SIZES = (0.35, 1.4)  # smallest and largest mark, relative to a typical one
OWN_PAINT = 0.9  # least area of a mark, relative to that of its stroke
SLENDER = 4.0  # aspect above which strokes are kept: posts and ropes
LEAST_ASPECT = 1.3  # least aspect of a shortened mark
TRIED = (1.0, 0.8, 0.63, 0.5, 0.4, 0.32, 0.25)  # shares of the length to try
OUTSIDE = 0.4  # alpha below which a picture shows no surface
OTHER_COLOR = 0.11  # RGB distance above which an end lies on another object
TINY = 1e-30


@dataclass(frozen=True, eq=False)
class Seen:
    """A view with its plain picture.

    Attributes:
        camera: the view.
        rgb: [H, W, 3] straight alpha; undefined where alpha is 0.
        alpha: [H, W].
        depth: [H, W] camera z.
    """

    camera: Camera
    rgb: Array
    alpha: Array
    depth: Array

    @classmethod
    def of(cls, scene: Gaussians, camera: Camera) -> "Seen":
        """The plain picture of a scene."""
        frame = render(scene, camera, StrokeTexture.open("gaussian"))
        assert frame.depth is not None, "it was asked for"
        rgb = frame.rgb / np.maximum(frame.alpha, 1e-3)[..., None]
        return cls(camera, rgb, frame.alpha, frame.depth)

    def _projected(self, points: F64, *, behind: float) -> tuple[Array, Array, Array]:
        """Column, row and depth [n] of points; those behind the camera count as in the depth `behind`."""
        camera = self.camera
        x, y, z = (points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
        ahead = np.where(z > camera.near, z, behind)
        columns = camera.K[0, 0] * x / ahead + camera.K[0, 2]
        return columns, camera.K[1, 1] * y / ahead + camera.K[1, 2], z

    def at(self, points: F64) -> tuple[F64, F64, F64]:
        """RGB [n, 3], alpha [n], and depth minus that of the points [n, 3], at their projections.

        Outside the picture the nearest pixel counts, so that marks do not end at its border.
        """
        camera = self.camera
        columns, rows, z = self._projected(points, behind=1.0)
        j = np.clip(columns, 0, camera.width - 1).astype(np.intp)
        i = np.clip(rows, 0, camera.height - 1).astype(np.intp)
        alpha = np.where(z > camera.near, self.alpha[i, j], 0.0)
        return self.rgb[i, j].astype(np.float64), alpha, self.depth[i, j] - z

    def facing(self, planes: Planes) -> F64:
        """[n] cosine between the normals of strokes and the view, 0 where they are hidden."""
        view = planes.means - self.camera.position
        cosines = np.abs(np.einsum("ni,ni->n", planes.axes[:, 2], view)) / np.linalg.norm(view, axis=1)
        _, alpha, behind = self.at(planes.means)
        z = planes.means @ self.camera.viewmat[2, :3] + self.camera.viewmat[2, 3]
        is_seen = (alpha > OUTSIDE) & (behind > -IN_FRONT * z - planes.sizes) & self.holds(planes.means)
        return np.where(is_seen, cosines, 0.0)

    def holds(self, points: F64) -> Array:
        """[n] whether points project into the picture."""
        camera = self.camera
        columns, rows, z = self._projected(points, behind=np.inf)
        inside = (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
        return np.asarray(inside & (z > camera.near))


def lay_marks(
    strokes: Gaussians,
    marks: StyleMarks,
    views: Sequence[Seen],
    num_sigmas: float = 1.6,
    *,
    turns: bool = True,
    most: int | None = None,
) -> tuple[Gaussians, Rows]:
    """Lay strokes as the marks of a painting.

    Args:
        strokes: n strokes, with planes perpendicular to their shortest axes.
        marks: of the painting.
        views: the first is that of the painting, the others are around the scene.
        num_sigmas: half length of a stroke in standard deviations.
        turns: whether marks take the direction of the painting's marks; else that of their strokes.
        most: maximum number of marks, at least n; None for `MOST_MARKS`.

    Returns:
        The marks, and the row of each one's stroke, ascending. A typical mark has the same length in the
        first view as in the painting, within `LENGTHS`; larger strokes become several marks, in the visible
        colors.
    """
    if len(strokes) == 0:
        return strokes, np.arange(0)
    planes = Planes.of(strokes)
    facing = np.stack([view.facing(planes) for view in views])
    typical = mark_length(marks, views[0], planes, facing[0])
    pairs = _directions(planes, marks, views, facing) if turns else _own_directions(planes)
    laid, parents = _split(strokes, planes, pairs, typical, marks.aspect, num_sigmas, most or MOST_MARKS)
    planes = Planes.of(laid)
    facing = np.stack([view.facing(planes) for view in views])
    judges = np.where(facing.max(axis=0) > FACING[0], (facing * _weights_of(views)).argmax(axis=0), -1)
    laid = _as_seen(laid, planes, views, judges, np.bincount(parents)[parents] > 1)
    around = Neighborhood(laid)
    pairs = _directions(planes, marks, views, facing) if turns else _own_directions(planes)
    smooth = planes.lower(around.smoothed(planes.lift(pairs, np.hypot(*pairs.T))))[0]
    units, lengths = unit_pairs(pairs + SMOOTH * smooth)
    is_laid = (lengths > FAINT) & (planes.aspects < SLENDER)
    along = np.where(is_laid[:, None], _along(planes, units), planes.axes[:, 0])
    reach, half_width = _sizes(planes, marks, typical, num_sigmas)
    shares = _shares(planes, along, reach, views, judges)
    # Widen shortened marks, up to the area of the stroke.
    own_paint = OWN_PAINT * (planes.sizes * num_sigmas) ** 2
    half_length = np.maximum(shares * reach, np.minimum(reach, LEAST_ASPECT * half_width))
    widest = np.minimum(own_paint / np.maximum(half_length, TINY), half_length / LEAST_ASPECT)
    half_width = np.maximum(half_width, widest)
    longest = np.where(is_laid, half_length / num_sigmas, planes.scales[:, 0])
    middle = np.where(is_laid, half_width / num_sigmas, planes.scales[:, 1])
    return _shaped(laid, planes, along, longest, middle, around), parents


def _weights_of(views: Sequence[Seen]) -> F64:
    """[V, 1] weights of views; the first counts most."""
    return np.where(np.arange(len(views)) == 0, FIRST, 1.0)[:, None]


def _own_directions(planes: Planes) -> F64:
    return np.tile([1.0, 0.0], (len(planes), 1))


def _as_seen(
    strokes: Gaussians, planes: Planes, views: Sequence[Seen], judges: Rows, is_part: Mask
) -> Gaussians:
    """Parts of strokes in the visible colors at their positions."""
    steps = np.zeros((len(strokes), 3))
    own = base_colors(strokes.sh)
    for index, view in enumerate(views):
        rows = np.flatnonzero(is_part & (judges == index))
        steps[rows] = view.at(planes.means[rows])[0] - own[rows]
    return shift_base_colors(strokes, steps)


def _along(planes: Planes, units: F64) -> F64:
    """[n, 3] directions in space of unit pairs."""
    angles = 0.5 * np.arctan2(units[:, 1], units[:, 0])
    return np.asarray(
        np.cos(angles)[:, None] * planes.axes[:, 0] + np.sin(angles)[:, None] * planes.axes[:, 1]
    )


def _split(
    strokes: Gaussians,
    planes: Planes,
    pairs: F64,
    typical: float,
    aspect: float,
    num_sigmas: float,
    most: int,
) -> tuple[Gaussians, Rows]:
    """Split strokes larger than marks into rows of marks along the direction."""
    along = _along(planes, unit_pairs(pairs)[0])
    across = np.cross(planes.axes[:, 2], along)
    extents = num_sigmas * planes.scales[:, :2]
    # Half extents of the ellipse along the direction and across it.
    reach = [
        np.sqrt((np.einsum("nij,nj->ni", planes.axes[:, :2], way) ** 2 * extents**2).sum(axis=1))
        for way in (along, across)
    ]
    half_length, stretch = 0.5 * typical * SIZES[1], 1.0
    while True:
        columns, rows = (
            np.clip(np.round(r / (stretch * step)), 1, MOST_PARTS).astype(np.intp)
            for r, step in zip(reach, (half_length, half_length / aspect / APART), strict=True)
        )
        is_slender = planes.aspects >= SLENDER
        columns, rows = np.where(is_slender, 1, columns), np.where(is_slender, 1, rows)
        if (columns * rows).sum() <= max(most, len(strokes)) or (columns * rows == 1).all():
            break
        stretch *= 1.15
    parents, offsets, factors = [], [], []
    for n, m in sorted(set(zip(columns.tolist(), rows.tolist(), strict=True))):
        of_shape = np.flatnonzero((columns == n) & (rows == m))
        x, y = _bricks(n, m)
        place = x[:, None] * (reach[0][of_shape, None] * along[of_shape])[:, None]
        place = place + y[:, None] * (reach[1][of_shape, None] * across[of_shape])[:, None]
        parents.append(np.repeat(of_shape, len(x)))
        offsets.append(place.reshape(-1, 3))
        factors.append(np.full(len(x) * len(of_shape), 1 / np.sqrt(len(x))))
    order = np.argsort(np.concatenate(parents), kind="stable")
    found = np.concatenate(parents)[order]
    taken, dtype = strokes.take(found), strokes.means.dtype
    means = taken.means + np.concatenate(offsets)[order].astype(dtype)
    scales = taken.scales * np.concatenate(factors)[order, None].astype(dtype)
    return replace(taken, means=means, scales=scales), found


def _bricks(columns: int, rows: int) -> tuple[F64, F64]:
    """Positions [k] of marks in rows within the unit disk, every other row shifted by half a mark."""
    if columns * rows == 1:
        return np.zeros(1), np.zeros(1)
    v, u = np.mgrid[:rows, :columns]
    x = ((u + 0.25 + 0.5 * (v % 2)) / columns * 2 - 1).ravel()
    y = ((v + 0.5) / rows * 2 - 1).ravel()
    inside = x**2 + y**2 <= 1
    return (x[inside], y[inside]) if inside.any() else (np.zeros(1), np.zeros(1))


def mark_length(marks: StyleMarks, view: Seen, planes: Planes, facing: F64) -> float:
    """Length of a typical mark of the painting, world units, at the depth of the visible strokes."""
    camera = view.camera
    z = planes.means @ camera.viewmat[2, :3] + camera.viewmat[2, 3]
    seen = facing > 0
    depth = float(np.median(z[seen])) if seen.any() else float(np.median(np.abs(z)))
    share = np.clip(marks.length, *LENGTHS)
    return float(share * min(camera.width, camera.height) * depth / camera.K[0, 0])


def _directions(planes: Planes, marks: StyleMarks, views: Sequence[Seen], facing: F64) -> F64:
    """[n, 2] direction pairs in the planes of strokes, from the painting over each view."""
    total = np.zeros((len(planes), 2))
    weights = ramp(facing, *FACING) * facing**STEEP * _weights_of(views)
    norm = np.maximum(weights.sum(axis=0), 1e-9)
    for view, weight in zip(views, weights, strict=True):
        wish = mark_wish(Marks(view.camera, marks.directions.astype(np.float64)), planes)
        total += (weight / norm)[:, None] * wish.pairs
    return total


def _sizes(planes: Planes, marks: StyleMarks, typical: float, num_sigmas: float) -> tuple[F64, F64]:
    """Half length and half width [n], world units; part of the variation of stroke sizes is kept."""
    size = 0.5 * typical / np.sqrt(marks.aspect)  # root of half length times half width
    own = planes.sizes * num_sigmas
    median = float(np.median(own)) or 1.0
    sizes = np.maximum(size * np.clip((own / median) ** OWN_SIZE, *SIZES), np.sqrt(OWN_PAINT) * own)
    stretch = np.sqrt(marks.aspect)
    return sizes * stretch, sizes / stretch


def _shares(planes: Planes, along: F64, reach: F64, views: Sequence[Seen], judges: Rows) -> F64:
    """[n] share of the length within which a mark stays on its surface and color, in its best view."""
    shares = np.ones(len(planes))
    for index, view in enumerate(views):
        rows = np.flatnonzero(judges == index)
        if len(rows) == 0:
            continue
        middle, _, _ = view.at(planes.means[rows])
        fits = np.zeros(len(rows))
        for share in TRIED:
            is_in = np.ones(len(rows), dtype=bool)
            for end in (-1, 1):
                points = planes.means[rows] + end * share * reach[rows, None] * along[rows]
                rgb, alpha, behind = view.at(points)
                is_in &= (alpha > OUTSIDE) & (np.abs(behind) < 2 * reach[rows])
                is_in &= np.linalg.norm(rgb - middle, axis=1) < OTHER_COLOR
            fits = np.where((fits == 0) & is_in, share, fits)
        shares[rows] = np.where(fits == 0, TRIED[-1], fits)
    return shares


def _shaped(
    strokes: Gaussians, planes: Planes, along: F64, longest: F64, middle: F64, around: Neighborhood
) -> Gaussians:
    """The strokes with these directions [n, 3] and scales [n] in their planes."""
    along = around.agreed(along)
    normals = planes.axes[:, 2]
    rotations = np.stack([along, np.cross(normals, along), normals], axis=2)
    scales = np.stack([longest, middle, np.minimum(planes.scales[:, 2], 0.5 * middle)], axis=1)
    dtype = strokes.scales.dtype
    return replace(strokes, quats=quats_of(rotations).astype(dtype), scales=scales.astype(dtype))
