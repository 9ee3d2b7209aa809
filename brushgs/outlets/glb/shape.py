"""Convert coats to rectangles in space with brushes, in drawing order.

`lying` puts each stroke in the plane of its two longest axes, for free viewpoints. `baked` uses the box that
the renderer paints in one view, at its depth, parallel to the picture.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet, per_row
from brushgs.outlets.page.columns import shown_by
from brushgs.passes.color.key_normals import find_facing
from brushgs.rendering.coat import Coat
from brushgs.rendering.constants import MAX_ALPHA, MIN_ALPHA
from brushgs.rendering.facing import facing_shares
from brushgs.rendering.project import ProjectCounts
from brushgs.values.arrays import F64, Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import base_colors

# Along u and v of the box: left top, right top, right bottom, left bottom of the brush.
CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
# Distance of underpaint behind a lying stroke, in stroke sizes. In the renderer it is one size deeper in each
# view, which is impossible in space. Differences of koala from its painting, seen from the first view and 40
# and 150 degrees beside it: 0.026, 0.027, 0.030 without underpaint (larger strokes), 0.028, 0.026, 0.025 with
# 1 and 0.022, 0.020, 0.021 with 0.5. Of the still life: 0.029, 0.051, 0.007, 0.030, 0.053, 0.014 and 0.027,
# 0.049, 0.011.
SETBACK = 0.5
# Number of averagings of normals over some 20 neighbors. With none or one, fur is black or white under a
# lamp.
SMOOTHINGS = 4


@dataclass(frozen=True, eq=False)
class Quads:
    """M rectangles in space, farthest in the first view first.

    Attributes:
        corners: [M, 4, 3] in the scene's coordinates, in the order of `CORNERS`.
        colors: [M, 3] RGB, display-encoded, 0 to 1.
        alphas: [M] at full coverage, 0 to 0.99.
        brushes: [M] row of the coat's brush; one beyond the last is the soft kernel.
        normals: [M, 3] of the surface, unit vectors on the front side of the rectangle.
    """

    corners: F64  # [M, 4, 3]
    colors: F64  # [M, 3]
    alphas: F64  # [M]
    brushes: NDArray[np.intp]  # [M]
    normals: F64  # [M, 3]

    def __len__(self) -> int:
        return len(self.corners)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "Quads":
        """The rows chosen by an index array or a mask, in that order."""
        return Quads(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def joined(parts: "Sequence[Quads]") -> "Quads":
        """Concatenate one or more sets of rectangles."""
        columns = ([getattr(part, field.name) for part in parts] for field in fields(Quads))
        return Quads(*(np.concatenate(column) for column in columns))


def baked(coat: Coat, camera: Camera) -> tuple[Quads, ProjectCounts]:
    """The boxes of a coat in one view, with underpaint, as rectangles; and cull counts.

    From this camera each rectangle exactly covers the box of its stroke, in its color in that view.
    """
    boxes, counts = coat.boxes(camera)
    brush_set = BrushSet.of(coat.texture)
    rows = brush_set.rows_of("quads", boxes.brushes)
    own = np.zeros(len(boxes), np.intp) if rows is None else rows.astype(np.intp)
    quads, depths = _unprojected(boxes, camera, own), boxes.depths.astype(np.float64)
    underpaint = coat.options.underpaint
    if underpaint is not None and boxes.setbacks is not None and brush_set.kind == "image":
        reaches = underpaint.reaches(boxes)
        behind = depths + boxes.setbacks.astype(np.float64)
        soft = np.full(len(boxes), len(brush_set))
        below = _unprojected(
            boxes,
            camera,
            soft,
            depths=behind,
            reach=np.broadcast_to(underpaint.reach if reaches is None else reaches, len(boxes)),
            opacity=underpaint.opacity,
        )
        quads, depths = Quads.joined([quads, below]), np.concatenate([depths, behind])
    # Reverse of the renderer's order, nearest first.
    quads = quads.take(np.argsort(depths, kind="stable")[::-1])
    return quads.take((quads.alphas >= MIN_ALPHA) & _have_area(quads)), counts


def _unprojected(
    boxes: Boxes,
    camera: Camera,
    brushes: NDArray[np.intp],
    *,
    depths: F64 | None = None,
    reach: Array | None = None,
    opacity: float = 1.0,
) -> Quads:
    half = boxes.half_extents.astype(np.float64)
    if reach is not None:
        half = half * reach[:, None]
    angles = boxes.angles.astype(np.float64)
    u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=1)
    along, across = half[:, :1] * u, half[:, 1:] * v
    pixels = boxes.centers.astype(np.float64)[:, None] + (
        CORNERS[:, :1] * along[:, None] + CORNERS[:, 1:] * across[:, None]
    )
    z = (boxes.depths.astype(np.float64) if depths is None else depths)[:, None, None]
    on_plane = (pixels - camera.K[:2, 2]) / np.diag(camera.K)[:2] * z
    in_camera = np.concatenate([on_plane, np.broadcast_to(z, (*on_plane.shape[:2], 1))], axis=2)
    corners = (in_camera - camera.viewmat[:3, 3]) @ camera.viewmat[:3, :3]
    colors = np.clip(boxes.colors.astype(np.float64), 0, 1)
    normals = np.broadcast_to(-camera.viewmat[2, :3], (len(corners), 3))
    return Quads(corners, colors, _alphas(opacity * boxes.opacities.astype(np.float64)), brushes, normals)


def lying(coat: Coat, camera: Camera, *, is_lit: bool = False) -> Quads:
    """The strokes of a coat in the planes of their two longest axes; u runs along the longest.

    A stroke has one color, the mean over all directions, as SH are untrained for views from behind. The
    camera decides the order and the front side, on which brushes are not mirrored and underpaint lies behind.
    Strokes without area, or with an opacity below 1/255, are omitted. With `is_lit`, for programs that light
    the paint, normals are smoothed over the surface; otherwise they are those of the rectangles.
    """
    strokes = shown_by(coat)
    opacities = strokes.opacities.astype(np.float64)
    if coat.normals is not None:  # silhouette lines and one-sided strokes: as in the first view
        shares = facing_shares(coat.strokes.means, coat.normals, camera, is_one_sided=coat.is_one_sided)
        opacities[: len(shares)] *= shares
    means, scales = strokes.means.astype(np.float64), strokes.scales.astype(np.float64)
    order, rows = np.argsort(-scales, axis=1, kind="stable"), np.arange(len(strokes))
    axes = rotation_matrices(strokes.quats)
    u, v = axes[rows, :, order[:, 0]], axes[rows, :, order[:, 1]]
    is_mirrored = (np.cross(u, v) * (means - camera.position)).sum(axis=1) < 0
    v = np.where(is_mirrored[:, None], -v, v)
    sigmas = coat.options.projection_of(len(strokes), strokes.brushes).num_sigmas
    half = np.broadcast_to(sigmas, len(strokes))[:, None] * np.take_along_axis(scales, order[:, :2], axis=1)
    brush_set = BrushSet.of(coat.texture)
    brushes = brush_set.rows_of("quads", strokes.brushes)
    own = np.zeros(len(strokes), np.intp) if brushes is None else brushes.astype(np.intp)
    colors, forward = base_colors(strokes.sh), camera.viewmat[2, :3]
    normals = np.cross(v, u)  # toward the camera
    if is_lit:
        normals = _form(strokes, camera)
    quads = Quads(_spanned(means, half[:, :1] * u, half[:, 1:] * v), colors, _alphas(opacities), own, normals)
    depths = means @ forward
    underpaint = coat.options.underpaint
    if underpaint is not None and brush_set.kind == "image":
        reach = per_row("quads", tuple(np.atleast_1d(underpaint.reach)), brushes, len(strokes))
        wide = half * reach[:, None]
        sizes = np.sqrt(np.take_along_axis(scales, order[:, :2], axis=1).prod(axis=1))
        behind = means + (SETBACK * sizes)[:, None] * np.cross(u, v)
        below = Quads(
            _spanned(behind, wide[:, :1] * u, wide[:, 1:] * v),
            colors,
            _alphas(underpaint.opacity * opacities),
            np.full(len(strokes), len(brush_set)),
            normals,
        )
        quads, depths = Quads.joined([quads, below]), np.concatenate([depths, behind @ forward])
    quads = quads.take(np.argsort(depths, kind="stable")[::-1])
    return quads.take((quads.alphas >= MIN_ALPHA) & _have_area(quads))


def _form(strokes: Gaussians, camera: Camera) -> F64:
    """[M, 3] normals of the surface below strokes, smoothed.

    They point toward the camera: programs reverse normals of rectangles that are seen from behind.
    """
    facing = find_facing(strokes, [camera])
    normals = facing.normals
    for _ in range(SMOOTHINGS):
        normals = facing.wide.means(normals)
        normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    is_behind = (normals * (camera.position - strokes.means)).sum(axis=1, keepdims=True) < 0
    return np.asarray(np.where(is_behind, -normals, normals))


def _spanned(centers: F64, along: F64, across: F64) -> F64:
    """[M, 4, 3] corners of rectangles around centers, [M, 3] each, from half sides."""
    return np.asarray(centers[:, None] + CORNERS[:, :1] * along[:, None] + CORNERS[:, 1:] * across[:, None])


def _alphas(opacities: F64) -> F64:
    return np.asarray(np.minimum(opacities, MAX_ALPHA))


def _have_area(quads: Quads) -> NDArray[np.bool_]:
    """[M] whether both sides are longer than 0, and all corners fit float32."""
    along = np.abs(quads.corners[:, 1] - quads.corners[:, 0]).max(axis=1)
    across = np.abs(quads.corners[:, 3] - quads.corners[:, 0]).max(axis=1)
    size = np.abs(quads.corners).max(axis=(1, 2))
    return np.asarray((along > 0) & (across > 0) & (size < float(np.finfo(np.float32).max)))
