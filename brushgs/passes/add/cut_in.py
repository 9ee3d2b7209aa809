"""Cutting in: strokes of the stage along the outline of its subject, with a small overlap.

A painter draws an edge from outside, with the paint of the background. The strokes belong to one view.
"""

from typing import NamedTuple

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.add.ground_maps import blurred
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F64, Array, Mask, Rows
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0, in_colors

SIDE = 360  # pixels, longer side of the picture in which the outline is found
SMOOTH = 2.0  # pixels of it over which the outline is smoothed
STRAIGHT, AROUND = 0.9, 4.0  # length of the mean unit normal around a straight point; pixels around it
OVERLAP = (3.0, 6.0)  # pixels of a picture of 1000 x 750
LENGTH, ASPECT = 0.075, 2.6  # of strokes, in widths of the picture; length over width
APART = 0.45  # distance between strokes, in lengths
SIGMAS = 3.6  # length of a stroke in standard deviations
THICKNESS, OPACITY = 0.01, 0.95
FOUND = 0.3  # found share of an edge, above which it is cut in
DIFFERS = 0.10  # minimum OKLab distance across an outline that is cut in: a lost edge stays lost
# Maximum width in pixels of a hard outline: fur and leaves are not trimmed.
HARD, SOLID = 3.0, 0.8
IN_FRONT = 0.98  # depth of the strokes, relative to the outline


class _Points(NamedTuple):
    """Points of an outline: [n] rows and columns, [n, 2] unit normals inward as x and y, [n] depths."""

    rows: F64
    columns: F64
    normals: F64
    depths: F64

    def take(self, chosen: Mask | Rows) -> "_Points":
        return _Points(*(column[chosen] for column in self))


def cut_in(subject: Gaussians, stage: Gaussians, camera: Camera, *, found: Array | None = None) -> Gaussians:
    """Strokes along the outline of a subject, in the colors of the stage beside it; float64.

    Args:
        subject: its strokes, in their painted colors.
        stage: the strokes of its stage.
        camera: the view.
        found: [k] 0 to 1, how far each stroke is at a found edge; None for all.
    """
    small = camera.in_side(SIDE)
    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    over, behind = (render_with(one, small, kernel, options) for one in (subject, stage))
    length = LENGTH * small.width
    share = SIDE / max(camera.width, camera.height)
    overlap = float(np.mean(OVERLAP)) * share * canvas_scale(camera.width, camera.height)
    points = _spread(_outline(over), APART * length, np.random.default_rng([0, 17]))
    outside = 0.5 * length / ASPECT - overlap
    colors, differs = _outside_colors(points, over, behind, outside)
    if found is not None:
        shown = render_with(in_colors(subject, np.repeat(found[:, None], 3, axis=1)), small, kernel, options)
        differs = differs & (_seen(points, shown, HARD)[0][:, 0] > FOUND)
    points = points.take(differs)
    return _strokes(points, colors[differs], small, outside, length)


def _outline(frame: Frame) -> _Points:
    """The straight points of an outline."""
    mask = (frame.alpha > 0.5).astype(np.float64)
    smooth = blurred(mask, SMOOTH)
    down, across = np.gradient(smooth)
    steep = np.hypot(across, down)
    unit = np.stack([across, down], axis=2) / np.maximum(steep, 1e-9)[..., None]
    on_edge = (np.abs(smooth - 0.5) < 0.5 * steep) & (frame.alpha > 0.3)
    edge_share = on_edge.astype(np.float64)
    weight = blurred(edge_share, AROUND)
    means = np.stack([blurred(edge_share * unit[..., k], AROUND) for k in (0, 1)], axis=2)
    straight = np.hypot(*np.moveaxis(means, 2, 0)) > STRAIGHT * weight
    border = int(2 * SMOOTH)
    inner = np.zeros(mask.shape, bool)
    inner[border:-border, border:-border] = True
    rows, columns = np.nonzero(on_edge & straight & inner)
    normals = means[rows, columns]
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    assert frame.depth is not None, "options of a frame have a depth unless they are told otherwise"
    return _Points(
        np.asarray(rows + 0.5),
        np.asarray(columns + 0.5),
        normals,
        frame.depth[rows, columns].astype(np.float64),
    )


def _spread(points: _Points, apart: float, g: np.random.Generator) -> _Points:
    """Points at least `apart` pixels from each other, chosen greedily in random order."""
    at = np.stack([points.columns, points.rows], axis=1)
    kept: list[int] = []
    for row in g.permutation(len(at)):
        if not kept or (((at[kept] - at[row]) ** 2).sum(axis=1) >= apart**2).all():
            kept.append(int(row))
    return points.take(np.array(kept, np.int64))


def _outside_colors(points: _Points, over: Frame, behind: Frame, outside: float) -> tuple[F64, Mask]:
    """[n, 3] colors of the stage beside the points, and whether the subject differs from them."""
    colors, covered = _seen(points, behind, -outside)
    inside, solid = _seen(points, over, HARD)
    _, beyond = _seen(points, over, -2 * outside)
    is_hard = (solid > SOLID) & (_seen(points, over, -HARD)[1] < 1 - SOLID)
    distance = np.linalg.norm(oklab_of(np.clip(inside, 0, 1)) - oklab_of(np.clip(colors, 0, 1)), axis=1)
    differs = (distance > DIFFERS) & (covered > 0.8) & (beyond < 0.3)
    return np.clip(colors, 0, 1), differs & is_hard


def _seen(points: _Points, frame: Frame, steps: float) -> tuple[F64, F64]:
    """[n, 3] colors and [n] alphas of a frame, `steps` pixels inward from points."""
    height, width = frame.alpha.shape
    rows = np.clip((points.rows + steps * points.normals[:, 1]).astype(np.int64), 0, height - 1)
    columns = np.clip((points.columns + steps * points.normals[:, 0]).astype(np.int64), 0, width - 1)
    alpha = frame.alpha[rows, columns].astype(np.float64)
    return frame.rgb[rows, columns] / np.maximum(alpha, 1e-6)[:, None], alpha


def _strokes(points: _Points, colors: F64, camera: Camera, outside: float, length: float) -> Gaussians:
    """Strokes in space that lie along the outline in the picture."""
    count = len(points.rows)
    depths = IN_FRONT * points.depths
    x = (points.columns - outside * points.normals[:, 0] - camera.K[0, 2]) / camera.K[0, 0]
    y = (points.rows - outside * points.normals[:, 1] - camera.K[1, 2]) / camera.K[1, 1]
    seen = np.stack([x * depths, y * depths, depths], axis=1)
    zero, one = np.zeros(count), np.ones(count)
    along = np.stack([-points.normals[:, 1], points.normals[:, 0], zero], axis=1)
    forward = np.stack([zero, zero, one], axis=1)
    frames = np.stack([along, np.cross(forward, along), forward], axis=2)
    turn, shift = camera.viewmat[:3, :3], camera.viewmat[:3, 3]
    sizes = length * depths / camera.K[0, 0] / SIGMAS
    scales = np.stack([sizes, sizes / ASPECT, THICKNESS * sizes], axis=1)
    sh = ((colors - 0.5) / C0)[:, None]
    return Gaussians((seen - shift) @ turn, quats_of(turn.T @ frames), scales, np.full(count, OPACITY), sh)
