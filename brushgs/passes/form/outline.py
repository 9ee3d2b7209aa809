"""The outline of strokes against the background, in one view.

The outline is where the picture of the strokes ends, so that the stage shows, or where the depth increases
strongly. There is no outline where a subject stands on its ground, since the depth is continuous.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.neighbours import nearest
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

SIDE = 240  # pixels, longer side of a view in which the outline is found
FALLS = 0.35  # minimum drop of inverse depth at an outline: 0.2 outlines the jaw of a skull before its neck
SOLID = 0.5  # minimum alpha of a pixel that shows a surface
NEAREST = 0.05  # of the depth of the subject; smaller depths are clipped to this
SMOOTH = 2.0  # pixels over which directions of an outline are smoothed
BESIDE = 3.0  # pixels from an outline at which colors are read
BORDER = 3  # pixels of a view without outline
WIDEST = 28  # pixels, maximum measured width of a subject
NUM_ALONG = 24  # points of an outline over which its data are averaged: some 24 pixels
ACROSS = np.arange(-4.0, 5.0)  # pixels from an outline, outward, at which its drop is measured
# An outline is already lost where the color difference across it is smaller (OKLab; 6 of CIELAB), where it
# falls over more pixels (8 of 1000, plus the blur of a small picture), and where the subject is a line of at
# most this width.
FAINT, WIDE, THIN = 0.055, 2.8, 3


@dataclass(frozen=True, eq=False)
class Around:
    """The background of strokes.

    Attributes:
        stage: strokes that are laid first, or None.
        ground: [3] RGB of the ground, where the stage leaves it open.
    """

    stage: Gaussians | None = None
    ground: Array | tuple[float, float, float] = (0.5, 0.5, 0.5)


class Outline(NamedTuple):
    """Points of the outline in one view.

    Attributes:
        places: [n, 2] (x, y), pixels of the view.
        outward: [n, 2] unit vectors away from the subject; 0 if undefined.
        behind: [n, 3] OKLab of the background.
        contrast: [n] OKLab distance between both sides.
        says: [n, c] mean of the data of the strokes inside, 0 to 1.
        middle: [n] inverse depth between both sides, relative to the subject.
        width: [n] of the subject across the outline, pixels, at most `WIDEST`.
    """

    places: F64
    outward: F64
    behind: F64
    contrast: F64
    says: F64
    middle: F64
    width: F64


@dataclass(frozen=True, eq=False)
class View:
    """One small view of strokes, and their outline in it.

    Attributes:
        camera: of the view.
        depth: median depth of the strokes, world units.
        outline: n >= 1 points.
        behind: [h, w, 3] RGB of the background.
    """

    camera: Camera
    depth: float
    outline: Outline
    behind: Array

    def is_lost_in(self, strokes: Gaussians) -> Mask:
        """[n] whether the outline is lost, drawn with flat dabs, whose rims are as hard as those of paint."""
        places = self.outline.places + ACROSS[:, None, None] * self.outline.outward
        seen = _render(replace(strokes, brushes=None), self.camera, "ellipse").over(self.behind)
        one, other = (_lab(_at(rgb, places.reshape(-1, 2))) for rgb in (seen, self.behind))
        falls = np.linalg.norm(one - other, axis=1).reshape(len(ACROSS), -1)
        step = falls[:3].mean(axis=0) - falls[-2:].mean(axis=0)
        steepest = (falls[:-2] - falls[2:]).max(axis=0) / 2
        is_thin = self.outline.width < THIN
        return np.asarray((step < FAINT) | (step > WIDE * steepest) | is_thin)


def _render(strokes: Gaussians, camera: Camera, kernel_name: str = "gaussian") -> Frame:
    kernel = StrokeTexture.open(kernel_name)
    return render_with(strokes, camera, kernel, RenderOptions.of(kernel))


class _Pictures(NamedTuple):
    """Pictures of a view: [h, w, 3] all paint, colors of the strokes, and their data; [h, w] their inverse
    depth, 0 without strokes.
    """

    seen: Array
    colors: Array
    says: Array
    inverse: F64


def view_of(strokes: Gaussians, camera: Camera, around: Around, says: F64) -> View | None:
    """The outline of strokes in a view, or None.

    Args:
        strokes: k strokes, in their painted colors.
        camera: the view, of any size.
        around: the background.
        says: [k, 3] data of each stroke, 0 to 1, to be transferred to points of the outline.
    """
    small = camera.in_side(SIDE)
    if min(small.width, small.height) <= 2 * BORDER + 4:
        return None
    frame = _render(strokes, small)
    assert frame.depth is not None, "options of a frame have a depth unless they are told otherwise"
    is_solid = frame.alpha > SOLID
    if not is_solid.any():
        return None
    depth = float(np.median(frame.depth[is_solid]))
    near = np.maximum(frame.depth.astype(np.float64), NEAREST * depth)
    inverse = np.where(is_solid, depth / near, 0.0)
    places, middle = _falls(inverse)
    if len(places) == 0:
        return None
    behind: Array = np.broadcast_to(np.asarray(around.ground, np.float64), frame.rgb.shape)
    if around.stage is not None:
        behind = _render(around.stage, small).over(behind)
    heard = _render(in_colors(strokes, says), small)
    pictures = _Pictures(frame.over(behind), _own(frame), _own(heard), inverse)
    return View(small, depth, _described(places, middle, pictures), behind)


def _own(frame: Frame) -> Array:
    """[h, w, 3] colors of the paint, also where it is faint."""
    return np.asarray(frame.rgb / np.maximum(frame.alpha[..., None], 1e-6))


def _falls(inverse: F64) -> tuple[F64, F64]:
    """[n, 2] pixels (x, y) inside the outline, and [n] inverse depth in the middle of its drop."""
    found, middles = np.zeros(inverse.shape, bool), np.zeros(inverse.shape)
    for axis in (0, 1):
        for step in (1, -1):
            inner, beside, beyond = (np.roll(inverse, step * shift, axis) for shift in (1, -1, -2))
            middle = 0.5 * (inner + beyond)  # a blurred outline drops over three pixels
            falls = (inner - beyond > FALLS * inner) & (inverse > middle) & (beside <= middle)
            middles = np.where(falls & ~found, middle, middles)
            found |= falls
    inside = np.zeros(inverse.shape, bool)
    inside[BORDER:-BORDER, BORDER:-BORDER] = found[BORDER:-BORDER, BORDER:-BORDER]
    rows, columns = np.nonzero(inside)
    return np.asarray(np.stack([columns, rows], axis=1) + 0.5, np.float64), middles[rows, columns]


def _described(places: F64, middle: F64, pictures: _Pictures) -> Outline:
    smooth = _smoothed(pictures.inverse)
    down, right = np.gradient(smooth, axis=0), np.gradient(smooth, axis=1)
    slopes = -np.stack([_at(right, places), _at(down, places)], axis=1)
    lengths = np.linalg.norm(slopes, axis=1, keepdims=True)
    outward = np.asarray(slopes / np.where(lengths > 0, lengths, 1.0), np.float64)
    behind = _lab(_at(pictures.seen, places + BESIDE * outward))
    inside = _lab(_at(pictures.colors, places - BESIDE * outward))
    says = np.clip(_at(pictures.says, places - BESIDE * outward), 0, 1).astype(np.float64)
    contrast = np.linalg.norm(inside - behind, axis=1)
    width = np.zeros(len(places))
    for step in range(1, WIDEST + 1):
        width += (width == step - 1) & (_at(pictures.inverse, places - step * outward) > middle)
    along = nearest(places, places, min(NUM_ALONG, len(places)))[1]
    behind, inside = behind[along].mean(axis=1), contrast[along].mean(axis=1)
    says, width = says[along].mean(axis=1), width[along].mean(axis=1)
    return Outline(places, outward, behind, inside, says, middle, width)


def _smoothed(values: F64) -> F64:
    """A map [h, w] blurred by a Gaussian of `SMOOTH`. In slices: a matrix product would start threads."""
    reach = round(3 * SMOOTH)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTH) ** 2)
    weights /= weights.sum()
    for _ in range(2):
        padded = np.pad(values, ((reach, reach), (0, 0)))
        values = sum(weight * padded[row : row + len(values)] for row, weight in enumerate(weights)).T
    return values


def _at(picture: Array, places: F64) -> Array:
    """The pixels of a picture [h, w, ...] at positions [n, 2], clamped to its border."""
    height, width = picture.shape[:2]
    columns, rows = np.clip(places, 0, (width - 1, height - 1)).astype(np.int64).T
    return np.asarray(picture[rows, columns])


def _lab(colors: Array) -> F64:
    return oklab_of(np.clip(colors.astype(np.float64), 0, 1))
