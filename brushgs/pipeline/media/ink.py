"""Brush and ink on white paper: a wash in two greys, solid black, a dry brush between, lines along edges."""

from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Ink
from brushgs.pipeline.media.materials import BACKDROP, Materials, mixed, numbers_of, scaled
from brushgs.rendering.coat import Coat
from brushgs.values.colors import rgb_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

WASHES = ((0.30, 0.45), (0.55, 0.18))  # tone below which a wash is laid, and its share of ink on paper
REACH = 1.15  # of the wash, relative to the strokes


def ink(materials: Materials) -> list[Coat]:
    """The coats of a drawing in ink."""
    media, strokes, tones = numbers_of(Ink, materials), materials.strokes, materials.tones
    black = rgb_of(media.color)
    shares = np.zeros(len(tones))
    for below, share in reversed(WASHES):
        shares[tones < below] = share * media.wash
    soft = in_colors(strokes, mixed(materials.paper, black, shares))
    coats = [materials.smudge("wash", scaled(soft, REACH, REACH, opacities=2 * strokes.opacities))]
    solid = np.flatnonzero(tones < media.dark)
    marks = in_colors(scaled(strokes, 1.0, 0.95, opacities=np.full(len(tones), media.marks)), black)
    coats.append(materials.marks("ink", marks.take(solid), dry=0.0))
    between = np.flatnonzero((tones >= media.dark) & (tones < media.middle))
    if len(between):
        fading = (tones - media.dark) / (media.middle - media.dark)
        opacities = media.marks * (1 - 0.6 * np.clip(fading, 0, 1)) * materials.solidity
        brushed = in_colors(scaled(strokes, 1.0, 0.6, opacities=opacities), black).take(between)
        coats.append(materials.marks("dry brush", brushed, dry=media.dry))
    return coats + materials.line_coat(rgb_of(media.line_color), opacity=media.lines, dry=media.line_dry)


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A stage in a few lines of the edge of the table, and a hatched shadow."""
    from brushgs.passes.add.stage_marks import HATCHING

    strokes = Gaussians.joined([staging.shadow(HATCHING), staging.table_edge()])
    strokes = in_colors(strokes, rgb_of(numbers_of(Ink, materials).color))
    texture = materials.line_texture or materials.texture
    options = materials.options.for_marks(texture)
    return Coat(BACKDROP, strokes, texture, options)
