"""A subject and what stands around it -> both, parted by lightness where they were alike in a view.

A painting in the dark has dark surroundings, and its darks for the subject: both would be one. So along the
outline of the subject, on small pictures, its lightness and that of what is behind are compared, and both
give way until they differ and the subject is not so dark that its form is lost.
"""

from collections.abc import Sequence

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.add.stage_ground import Ground
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, shift_base_colors

SIDE, MOST_VIEWS = 160, 3  # pixels of the longer side of the pictures; views
NEAR = 6  # pixels on both sides of an outline
GAP = 0.2  # OKLab lightness; 15 of CIE L* are 0.12 to 0.16, and shadow and relief take some
OF_STAGE = 0.5  # share of what lacks that the surroundings give; the subject gives the rest
DARKEST, LIGHTEST = 0.08, 0.94  # that either becomes for it, in the mean
LEGIBLE = 0.38  # the least mean lightness of a subject, below which its form is lost in black
DUSK = 0.5  # mean lightness of both, below which the subject is the lighter one: darker, it would be black
CLOSE = 0.02  # of a lightness: near enough
ROUNDS = 3  # darks cannot get much darker: what then lacks is asked for again


def set_off(
    stage: Gaussians, subject: Gaussians, cameras: Sequence[Camera], ground: Ground | None = None
) -> tuple[Gaussians, Gaussians]:
    """Part what stands around a subject and its strokes by lightness; hues stay.

    Args:
        stage: the strokes around it.
        subject: its strokes, and those of its ground.
        cameras: of the job, at least one.
        ground: that the scene brings, which need not stand out; None for none.
    """
    is_own = np.ones(len(subject), bool)
    if ground is not None:
        is_own = ~ground.is_on(ground.place.local(subject.means))
    step = max(len(cameras) // MOST_VIEWS, 1)
    views = [camera.in_side(SIDE) for camera in list(cameras)[::step][:MOST_VIEWS]]
    for _ in range(ROUNDS):
        found = _lightness(stage, subject, is_own, views)
        if found is None or (abs(found[0] - found[1]) >= GAP and found[1] >= LEGIBLE - CLOSE):
            break
        signs = (1.0,) if sum(found) < 2 * DUSK else (1.0, -1.0)
        ways = [parted(*found, sign) for sign in signs]
        of_stage, of_subject = min(ways, key=lambda way: abs(way[0]) + abs(way[1]))
        stage, subject = lightened(stage, of_stage), lightened(subject, of_subject)
    return stage, subject


def parted(stage: float, subject: float, sign: float) -> tuple[float, float]:
    """What is added to both so that the subject is lighter, with a sign of 1, or darker, with -1."""
    wanted = GAP + 0.01
    need = max(wanted - sign * (subject - stage), 0.0)
    inside = float(np.clip(subject + sign * (1 - OF_STAGE) * need, LEGIBLE, LIGHTEST))
    outside = min(stage, inside - wanted) if sign > 0 else max(stage, inside + wanted)
    outside = float(np.clip(outside, DARKEST, LIGHTEST))
    inside = max(inside, outside + wanted) if sign > 0 else min(inside, outside - wanted)
    return outside - stage, inside - subject


def lightened(strokes: Gaussians, step: float) -> Gaussians:
    """Strokes with a step of OKLab lightness, in their hue and about their purity."""
    rgb = base_colors(strokes.sh).astype(np.float64)
    lab = oklab_of(np.clip(rgb, 0, 1))
    after = np.clip(lab[:, :1] + step, 0, 1)
    lab[:, 1:] *= np.clip(after / np.maximum(lab[:, :1], 1e-3), 0.5, 1.5)
    lab[:, :1] = after
    return shift_base_colors(strokes, np.clip(rgb_of_oklab(lab), 0, 1) - rgb)


def _lightness(
    stage: Gaussians, subject: Gaussians, is_own: Mask, views: Sequence[Camera]
) -> tuple[float, float] | None:
    """The mean lightness behind the outline of a subject, and within; None where none is seen."""
    from scipy.ndimage import binary_dilation

    kernel = StrokeTexture.open("gaussian")
    options = RenderOptions.of(kernel)
    behind: list[F64] = []
    within: list[F64] = []
    for camera in views:
        around, whole, own = (
            render_with(strokes, camera, kernel, options)
            for strokes in (stage, subject, subject.take(is_own))
        )
        mask = own.alpha > 0.5
        near = np.ones((2 * NEAR + 1, 2 * NEAR + 1), bool)
        ring = binary_dilation(mask, near) & (whole.alpha < 0.3) & (around.alpha > 0.5)
        edge = mask & binary_dilation(ring, near)
        for frame, rows, found in ((around, ring, behind), (own, edge, within)):
            rgb = frame.rgb[rows] / frame.alpha[rows][:, None]
            found.append(oklab_of(np.clip(rgb.astype(np.float64), 0, 1))[:, 0])
    one, other = np.concatenate(behind), np.concatenate(within)
    return (float(one.mean()), float(other.mean())) if len(one) and len(other) else None
