"""Strokes that are pictures on flat pieces of a surface.

Boxes are rectangles on the picture, but a flat picture in space appears sheared and in perspective. So in
each view it is resampled into the box around its outline.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.brush_set import BrushSet, Sigmas, per_row
from brushgs.brushes.texture import CANVAS, TINT_ZERO, StrokeTexture
from brushgs.values.arrays import F32, F64, Array, Rows
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.columns import RowChoice
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

MARGIN = 1.0  # px around an outline, for soft edges
MOST_TEXELS = 256  # per side of a resampled picture
EDGE_ON = 1e-9  # projected area over the product of the sides; below, a rectangle is invisible
REACH = 2.0  # standard deviations, half of a side
BEFORE = 1 - 1e-5  # factor to a depth just in front of another
CORNERS = np.array([[-1.0, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]])


@dataclass(frozen=True, eq=False)
class Planes:
    """M flat rectangles in a view.

    Attributes:
        to_picture: [M, 3, 3] homography from (s, t, 1), with s and t -1 to 1 over the rectangle, to
            (x z, y z, z), with x and y in pixels and camera z. Its columns are the projected half sides and
            center.
    """

    to_picture: F64

    @classmethod
    def of(cls, camera: Camera, centers: Array, alongs: F64, acrosses: F64) -> "Planes":
        """From centers [M, 3] and half sides [M, 3], world axes."""
        turn = camera.viewmat[:3, :3]
        center = centers.astype(np.float64) @ turn.T + camera.viewmat[:3, 3]
        return cls(camera.K @ np.stack([alongs @ turn.T, acrosses @ turn.T, center], axis=2))

    def take(self, rows: RowChoice) -> "Planes":
        """The rows chosen by an index array, a mask, a list of either or a slice."""
        return Planes(self.to_picture[rows])

    def seen(self, places: F64) -> F64:
        """[M, ..., 3] x, y in pixels and camera z of positions [M, ..., 3] = (s, t, 1)."""
        x, y, z = np.moveaxis(np.einsum("mij,m...j->m...i", self.to_picture, places), -1, 0)
        inverse = 1 / np.where(z > 0, z, np.inf)
        return np.stack([x * inverse, y * inverse, z], axis=-1)

    @property
    def sides(self) -> F64:
        """[M, 2, 2] half sides (x, y) in pixels, linearised at the center: along, then across."""
        center = self.to_picture[:, :, 2]
        z = np.maximum(center[:, 2], 1e-300)[:, None, None]
        sides = self.to_picture[:, :, :2]
        across = sides[:, :2] - (center[:, :2] / z[..., 0])[..., None] * sides[:, 2:]
        return np.asarray((across / z).transpose(0, 2, 1))


def planes_of(strokes: Gaussians, rows: NDArray[np.integer[Any]], camera: Camera, sigmas: Sigmas) -> Planes:
    """The rectangles of some strokes: u along the longest axis, the shortest axis away from the viewer."""
    strokes = strokes.take(rows)
    every = np.arange(len(strokes))
    axes, scales = rotation_matrices(strokes.quats.astype(np.float64)), strokes.scales.astype(np.float64)
    order = np.argsort(-scales, axis=1, kind="stable")
    along, away = axes[every, :, order[:, 0]], axes[every, :, order[:, 2]]
    half = np.take_along_axis(scales, order[:, :2], axis=1)
    half *= np.broadcast_to(
        per_row("flat", sigmas, strokes.brushes, len(strokes)) if isinstance(sigmas, tuple) else sigmas,
        len(strokes),
    )[:, None]
    across = np.cross(away, along)
    return Planes.of(camera, strokes.means, half[:, :1] * along, half[:, 1:] * across)


def around_outlines(boxes: Boxes, planes: Planes) -> Boxes:
    """Boxes around the outlines of the rectangles, along u; transparent if a rectangle is invisible.

    Args:
        boxes: M boxes; give the other columns.
        planes: of their strokes.
    """
    corners = planes.seen(np.broadcast_to(CORNERS, (len(boxes), 4, 3)))
    u, v = np.moveaxis(planes.sides, 1, 0)
    lengths = np.hypot(*u.T), np.hypot(*v.T)
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    is_seen = (corners[..., 2] > 0).all(axis=1) & (area > EDGE_ON * lengths[0] * lengths[1])
    angles = np.where(is_seen, np.arctan2(u[:, 1], u[:, 0]), boxes.angles)
    turn = np.stack([np.cos(angles), np.sin(angles), -np.sin(angles), np.cos(angles)], axis=1)
    turn = turn.reshape(-1, 2, 2)  # rows are u and v
    places = np.einsum("mij,mkj->mki", turn, corners[..., :2] - boxes.centers[:, None])
    low, high = places.min(axis=1), places.max(axis=1)
    middle = boxes.centers + np.einsum("mij,mi->mj", turn, (low + high) / 2)
    found: dict[str, Any] = {
        "centers": np.where(is_seen[:, None], middle, boxes.centers),
        "half_extents": np.where(is_seen[:, None], (high - low) / 2 + MARGIN, boxes.half_extents),
        "angles": angles,
        "opacities": np.where(is_seen, boxes.opacities, 0),
    }
    dtype = boxes.depths.dtype
    return replace(boxes, **{name: column.astype(dtype) for name, column in found.items()})


def in_order(boxes: Boxes, strokes: Gaussians, layers: Rows) -> Boxes:
    """Sort boxes by layer where strokes overlap in space, else by depth.

    A stroke that overlaps strokes of lower layers in space gets a depth just in front of them.

    Args:
        boxes: M boxes of these strokes.
        strokes: N strokes.
        layers: [N] layers of the strokes; higher ones are laid later.
    """
    of_box, depths = layers[boxes.ids], boxes.depths.astype(np.float64)
    later = np.unique(of_box)[1:]
    if not len(later):
        return boxes
    means, scales = (column[boxes.ids].astype(np.float64) for column in (strokes.means, strokes.scales))
    reaches = REACH * np.linalg.norm(scales, axis=1)
    apart = np.linalg.norm(means[:, None] - means, axis=2)
    is_near = apart < reaches[:, None] + reaches
    for layer in later:
        rows = of_box == layer
        below = np.where(is_near[rows] & (of_box < layer), depths, np.inf).min(axis=1)
        depths[rows] = np.minimum(depths[rows], BEFORE * below)
    order = np.argsort(depths, kind="stable")
    columns = boxes.columns_of(order) | {"depths": depths[order].astype(boxes.depths.dtype)}
    return Boxes(**columns)


def drawn_in(boxes: Boxes, planes: Planes, brush_set: BrushSet) -> tuple[Boxes, BrushSet]:
    """Give each box a brush of its own: its picture, resampled to the view.

    Args:
        boxes: M boxes of `around_outlines`, at most 256; those moved by `Hand` keep their shift.
        planes: of their strokes.
        brush_set: the pictures in their planes.
    """
    moved, boxes = boxes, around_outlines(boxes, planes)
    rows = np.zeros(len(boxes), np.uint8) if boxes.brushes is None else boxes.brushes
    seen = [row for row in range(len(boxes)) if boxes.opacities[row] > 0]
    inverse = np.linalg.inv(planes.to_picture[seen])
    textures = [
        _drawn(brush_set.textures[rows[row]], boxes, row, planes.sides[row], to_plane)
        for row, to_plane in zip(seen, inverse, strict=True)
    ]
    brushes = np.zeros(len(boxes), np.uint8)
    brushes[seen] = np.arange(len(seen))
    return replace(moved, brushes=brushes), BrushSet(tuple(textures or brush_set.textures), brush_set.name)


def _drawn(texture: StrokeTexture, boxes: Boxes, row: int, sides: F64, to_plane: F64) -> StrokeTexture:
    """Resample a picture to a box, at its own resolution."""
    half, angle = boxes.half_extents[row].astype(np.float64), float(boxes.angles[row])
    u = np.array([np.cos(angle), np.sin(angle)])
    v = np.array([-u[1], u[0]])
    height, width = texture.coverage.shape
    scale = half / np.maximum([np.abs(sides[0] @ u), np.abs(sides[1] @ v)], 1e-9)
    columns, lines = np.clip(np.ceil(scale * (width, height)), 2, MOST_TEXELS).astype(int)
    s = ((np.arange(columns) + 0.5) / columns * 2 - 1) * half[0]
    t = ((np.arange(lines) + 0.5) / lines * 2 - 1) * half[1]
    x, y = np.moveaxis(boxes.centers[row] + s[None, :, None] * u + t[:, None, None] * v, -1, 0)
    place = np.stack([x, y, np.ones_like(x)], axis=-1) @ to_plane.T
    place = place[..., :2] / np.where(place[..., 2:] > 0, place[..., 2:], np.nan)
    coverage = texture.coverage[..., None].astype(np.float32)
    tint, relief = texture.tint, texture.height
    layers = coverage if tint is None else np.concatenate([coverage, coverage * tint.texels], axis=2)
    if relief is not None:  # relative to the canvas, so that it is 0 outside the picture
        layers = np.concatenate([layers, relief[..., None] - CANVAS], axis=2, dtype=np.float32)
    found = _sampled(layers, (place[..., 0] + 1) * width / 2 - 0.5, (place[..., 1] + 1) * height / 2 - 0.5)
    drawn = np.rint(found[..., 0]).astype(np.uint8)
    if tint is not None:
        texels = found[..., 1:4] / np.maximum(found[..., :1], 1e-3)
        texels[drawn == 0] = TINT_ZERO
        tint = replace(tint, texels=np.rint(np.clip(texels, 0, 255)).astype(np.uint8))
    if relief is not None:
        relief = np.ascontiguousarray(found[..., -1] + CANVAS, np.float32)
    return replace(texture, coverage=drawn, tint=tint, height=relief)


def _sampled(layers: F32, x: F64, y: F64) -> F32:
    """[h, w, n] bilinear samples of layers [H, W, n] at x, y in texels; 0 outside, and where x is NaN."""
    height, width = layers.shape[:2]
    padded = np.pad(layers, ((1, 1), (1, 1), (0, 0)))
    x, y = (np.clip(np.nan_to_num(one, nan=-1) + 1, 0, most + 1) for one, most in ((x, width), (y, height)))
    left, top = np.minimum(x.astype(int), width), np.minimum(y.astype(int), height)
    right, down = ((one - low).astype(np.float32)[..., None] for one, low in ((x, left), (y, top)))
    upper = padded[top, left] * (1 - right) + padded[top, left + 1] * right
    lower = padded[top + 1, left] * (1 - right) + padded[top + 1, left + 1] * right
    return np.asarray(upper * (1 - down) + lower * down)
