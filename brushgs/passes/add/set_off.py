"""Separate a subject from its surroundings by lightness, where both are alike in a view.

A dark painting has dark surroundings, and its darks in the subject: the two would merge. So along the outline
of the subject, in small pictures, its lightness is compared with that of the background, and the subject
moves until they differ enough. Surroundings keep the values of the painting unless the subject alone would
lose its form. The ground that the subject stands on keeps its values.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.add.stage_ground import Ground
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

SIDE, MOST_VIEWS = 160, 3  # pixels of the longer side of the small pictures; maximum number of views
NEAR = 4  # pixels on each side of an outline
GAP = 0.22  # target, OKLab lightness; 15 of CIE L* are 0.12 to 0.16, the rest is lost to contours and shade
CLEAR = 0.5  # share of the pixels along an outline that counts: those that show least of the other side
DARKEST, LIGHTEST = 0.08, 0.94  # limits of the new mean lightness of either
LEGIBLE = 0.38  # minimum mean lightness of a subject: below it, form is lost in black
DEAR = 2.0  # cost of moving the surroundings, relative to moving the subject away from the scene
CLOSE = 0.02  # tolerance of lightness
ROUNDS = 4  # near the ends of the range strokes move less than requested: the rest is requested again


class Lightness(NamedTuple):
    """Mean OKLab lightness along a subject's outline: behind it, inside, and inside in the plain picture."""

    stage: float
    subject: float
    scene: float


def set_off(
    stage: Gaussians,
    subject: Gaussians,
    scene: Gaussians,
    cameras: Sequence[Camera],
    ground: Ground | None = None,
    brushes: tuple[StrokeTexture | BrushSet, RenderOptions] | None = None,
) -> tuple[Gaussians, Gaussians]:
    """Separate a subject and its surroundings by lightness; hues stay.

    Args:
        stage: the strokes around it.
        subject: its strokes, and those of its ground.
        scene: the Gaussians of the subject and its ground, in the colors of the scene.
        cameras: of the job, at least one.
        ground: of the scene itself, which need not stand out; None for none.
        brushes: of the subject, between whose bristles some of the surroundings shows; None for a kernel.
    """
    is_own, own = np.ones(len(subject), bool), scene
    if ground is not None:
        is_own = ~ground.is_on(ground.place.local(subject.means))
        own = scene.take(~ground.is_on(ground.place.local(scene.means)))
    step = max(len(cameras) // MOST_VIEWS, 1)
    views = [camera.in_side(SIDE) for camera in list(cameras)[::step][:MOST_VIEWS]]
    plain = [(_drawn(scene, view), _drawn(own, view)) for view in views]
    for _ in range(ROUNDS):
        found = _lightness(stage, subject, views, plain, brushes)
        if found is None:
            break
        of_stage, of_subject = parted(found)
        if max(abs(of_stage), abs(of_subject)) < CLOSE:
            break
        stage, subject = lightened(stage, of_stage), lightened(subject, of_subject, is_own)
    return stage, subject


def parted(found: Lightness) -> tuple[float, float]:
    """Changes of lightness of stage and subject: of both ways the one closer to painting and scene."""
    ways = [_way(found, sign) for sign in (1.0, -1.0)]
    before = abs(found.subject - found.scene)
    costs = [
        DEAR * abs(of_stage) + abs(found.subject + of_subject - found.scene) - before
        for of_stage, of_subject in ways
    ]
    return ways[int(costs[1] < costs[0])]


def _way(found: Lightness, sign: float) -> tuple[float, float]:
    """The changes that make the subject lighter (sign 1) or darker (sign -1) than the stage."""
    stage, subject, _ = found
    need = max(GAP - sign * (subject - stage), 0.0)
    inside = float(np.clip(subject + sign * need, LEGIBLE, LIGHTEST))
    outside = min(stage, inside - GAP) if sign > 0 else max(stage, inside + GAP)
    outside = float(np.clip(outside, DARKEST, LIGHTEST))
    inside = max(inside, outside + GAP) if sign > 0 else min(inside, outside - GAP)
    return outside - stage, inside - subject


def lightened(strokes: Gaussians, step: float, rows: Mask | None = None) -> Gaussians:
    """Strokes, or some rows of them, changed by a step of OKLab lightness; hue and approximate purity stay.

    The step is that of the mean and shrinks toward black and white, which stay: a subject keeps its depths.
    """
    rgb = base_colors(strokes.sh).astype(np.float64)
    lab = oklab_of(np.clip(rgb, 0, 1))
    before = lab[:, :1].copy()
    mean = float(np.clip(before.mean() if rows is None else before[rows].mean(), 0.05, 0.95))
    room = np.minimum(before / mean, (1 - before) / (1 - mean))
    after = np.clip(before + step * room, 0, 1)
    lab[:, 1:] *= np.clip(after / np.maximum(before, 1e-3), 0.5, 1.5)
    lab[:, :1] = after
    shifts = np.clip(rgb_of_oklab(lab), 0, 1) - rgb
    return shift_base_colors(strokes, shifts if rows is None else shifts * rows[:, None])


def _drawn(
    strokes: Gaussians, view: Camera, brushes: tuple[StrokeTexture | BrushSet, RenderOptions] | None = None
) -> Frame:
    if brushes is not None:
        return render_with(strokes, view, *brushes)
    kernel = StrokeTexture.open("gaussian")
    return render_with(strokes, view, kernel, RenderOptions.of(kernel))


def _lightness(
    stage: Gaussians,
    subject: Gaussians,
    views: Sequence[Camera],
    plain: Sequence[tuple[Frame, Frame]],
    brushes: tuple[StrokeTexture | BrushSet, RenderOptions] | None,
) -> Lightness | None:
    """Lightness at the outlines of the subject; None if it has none. `plain`: scene and subject alone."""
    from scipy.ndimage import binary_dilation

    near = np.ones((2 * NEAR + 1, 2 * NEAR + 1), bool)
    found: tuple[list[F64], ...] = ([], [], [])
    for camera, (scene, own) in zip(views, plain, strict=True):
        around, within = _drawn(stage, camera), _drawn(subject, camera, brushes)
        is_own = own.alpha > 0.5
        ring = binary_dilation(is_own, near) & (scene.alpha < 0.3) & (around.alpha > 0.5)
        edge = is_own & binary_dilation(ring, near) & (around.alpha > 0.5)
        behind = around.rgb / np.maximum(around.alpha, 0.5)[..., None]
        subject_on_it = within.rgb + (1 - within.alpha[..., None]) * behind
        in_scene = scene.rgb / np.maximum(scene.alpha, 0.5)[..., None]
        ring, edge = _clearest(-scene.alpha, ring), _clearest(own.alpha, edge)
        pictures = (behind, ring), (subject_on_it, edge), (in_scene, edge)
        for (picture, rows), values in zip(pictures, found, strict=True):
            rgb = picture[rows]
            values.append(oklab_of(np.clip(rgb.astype(np.float64), 0, 1))[:, 0])
    if not all(any(map(len, values)) for values in found):
        return None
    return Lightness(*(float(np.concatenate(values).mean()) for values in found))


def _clearest(clarity: Array, rows: Mask) -> Mask:
    """The clearest pixels of a mask: on the outline both sides mix, and their difference looks small."""
    return rows & (clarity >= np.quantile(clarity[rows], 1 - CLEAR)) if rows.any() else rows
