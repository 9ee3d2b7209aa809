"""Correct the values of a drawing by looking at it and its motif through half-closed eyes, as painters do."""

from collections.abc import Sequence

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.color.squint import HIGH, LOW, lab_of, squinted
from brushgs.passes.groups import add_rows
from brushgs.passes.seen import some_small
from brushgs.pipeline.media.materials import MOST_VIEWS, SIDE, Materials
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.rendering.visibility import painted_sums
from brushgs.values.arrays import F64, Array
from brushgs.values.frame import Frame

MOST_OPENED = 1.5  # how far a drawing of too few values is opened at once
SOLID = 0.5  # coverage of the pixels whose lights stay
LEAST_SPREAD = 1e-3  # of squinted lightness: a scene of one value has nothing to correct


def value_errors(materials: Materials, coats: Sequence[Coat], least: float) -> tuple[F64, float]:
    """How much too dark a drawing is at each stroke, for the half-closed eye.

    Both the strokes as soft paint and the drawing are blurred as by `Squint`, over the strokes alone. The
    values to reach are a linear function of those of the strokes: mean and contrast stay those of the
    drawing, the order of its masses becomes that of the scene. Where the drawing on its paper has less than a
    range, its darks get darker, at most `MOST_OPENED` times as far from its lights. What a lamp made of the
    strokes keeps some of the values of the motif, see `Motif.held`.

    Args:
        materials: N strokes, and the views of the job.
        coats: of the drawing.
        least: range of values, L*, that it is to have.

    Returns:
        [N] L* / 100 that is missing, mean over small views by what they show of a stroke, 0 if none does; and
        the mean range of the drawing in these.
    """
    strokes, kernel, painting = materials.shown, StrokeTexture.open("gaussian"), Painting.alone(tuple(coats))
    options, paper = RenderOptions.of(kernel), np.asarray(materials.paper)
    missing, areas = np.zeros(len(strokes)), np.zeros(len(strokes))
    ranges: list[float] = []
    motif = materials.motif
    cameras = materials.cameras if motif is None else motif.views.cameras
    for row, camera in enumerate(some_small(cameras, MOST_VIEWS, SIDE)):
        boxes, _ = project_with(strokes, camera, options)
        plain, drawn = rasterize_with(boxes, camera, kernel, options), painting.frame(camera)
        opaque = drawn.rgb + (1 - drawn.alpha)[..., None] * paper
        light = _light(opaque)
        low, high = np.percentile(squinted(light), (LOW, HIGH))
        ranges.append(100 * float(high - low))
        opened = float(np.clip(least / max(ranges[-1], 1e-7), 1, MOST_OPENED))
        alpha = plain.alpha.astype(np.float64)
        aim, found = (_values(alpha, own) for own in (_light(plain.straight_colors()), light))
        if motif is not None:
            aim = motif.held(aim, _values(alpha, _sampled(motif.views.frames[row], light.shape)), alpha)
        away = _away(alpha, aim, found, opened)
        sums, shares = painted_sums(boxes, kernel, np.repeat(away[..., None], 3, axis=2), np.ones_like(away))
        add_rows(missing, boxes.ids, sums[:, 0].astype(np.float64))
        add_rows(areas, boxes.ids, shares.astype(np.float64))
    return np.divide(missing, areas, out=missing, where=areas > 0), float(np.mean(ranges or least))


def _light(rgb: Array) -> F64:
    """[H, W] L* / 100 of a picture."""
    inside = np.clip(np.asarray(rgb, np.float64), 0, 1)
    return np.asarray(lab_of(inside.reshape(-1, 3))[:, 0].reshape(inside.shape[:2]) / 100)


def _sampled(frame: Frame, shape: tuple[int, ...]) -> F64:
    """[h, w] L* / 100 of a picture of another size."""
    sizes = zip(shape, frame.alpha.shape, strict=True)
    places = (((np.arange(few) + 0.5) * many / few).astype(int) for few, many in sizes)
    return _light(frame.straight_colors()[np.ix_(*places)])


def _values(alpha: F64, light: F64) -> F64:
    """[H, W] squinted lightness, over what is covered alone."""
    return np.asarray(squinted(alpha * light) / np.maximum(squinted(alpha), 1e-9))


def _away(alpha: F64, aim: F64, found: F64, opened: float) -> F64:
    """[H, W] what squinted values of the drawing lack to the line of those to reach, opened."""
    total = max(float(alpha.sum()), 1e-9)
    own, mean = (float((alpha * values).sum()) / total for values in (aim, found))
    spread = float((alpha * (aim - own) ** 2).sum()) / total
    if spread < LEAST_SPREAD**2:
        return np.zeros_like(aim)
    contrast = np.sqrt(float((alpha * (found - mean) ** 2).sum()) / total / spread)
    aim = mean + contrast * (aim - own)
    lightest = float(np.percentile(aim[alpha > SOLID], HIGH)) if (alpha > SOLID).any() else mean
    return np.asarray(lightest + opened * (aim - lightest) - found)
