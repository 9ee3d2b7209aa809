"""Hatching in pen or pencil: evenly spaced lines along the form, crossed in the dark, and lines by weight."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.brushes.soft import pen_brush
from brushgs.options.media import Hatching, TonalMedium
from brushgs.passes.add.tonal_marks import Manner, seen_as_well
from brushgs.pipeline.media.materials import BACKDROP, Materials, numbers_of
from brushgs.pipeline.media.tonal import ground_coat, keyed_tones, marks_coat, views_of, weighed_lines
from brushgs.rendering.coat import Coat
from brushgs.values.colors import rgb_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

if TYPE_CHECKING:
    from brushgs.passes.add.tonal_view import TonalView
    from brushgs.pipeline.media.staging import Staging
    from brushgs.values.arrays import Mask

DARKEST = 0.15  # tone from which on spacing grows
INK_WIDTH = 1.6  # px of lines whose shadow is as dark as `HATCHING` says
CROSS_TURN = np.radians(68.0)
CROSS_SHORTEST = 22.0  # px of a picture of `PIXELS`: what crosses others never stands alone


def hatching(materials: Materials) -> list[Coat]:
    """The coats of a drawing in lines."""
    tones = keyed_tones(materials)
    views = views_of(materials, tones)
    coats = [ground_coat(materials, tones, None), *hatching_coats(materials, views)]
    return coats + weighed_lines(materials, tones)


def hatching_coats(
    materials: Materials, views: "list[TonalView]", masks: "list[Mask] | None" = None
) -> list[Coat]:
    """The coats of lines on surfaces, without those in masks of the views."""
    media, seen = numbers_of(Hatching, materials), seen_as_well(views)
    masks = seen if masks is None else [mask | own for mask, own in zip(masks, seen, strict=True)]
    darkest = min(DARKEST, media.lightest - 0.01)
    plain = Manner(darkest, media.lightest, media.spacing, media.width, media.length)
    coats = marks_coat("hatching", materials, views, plain, is_left_out=masks, dry=media.dry, seed=1)
    if media.crossed:
        darkest = min(darkest, media.crossed - 0.01)
        length = min(media.length[0], CROSS_SHORTEST), media.length[1]
        crossed = Manner(darkest, media.crossed, media.spacing, media.width, length, turn=CROSS_TURN)
        coats += marks_coat("crossed", materials, views, crossed, is_left_out=masks, dry=media.dry, seed=2)
    return coats


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A stage in a few lines of the edge of the table, and a hatched shadow, lighter where lines are thin."""
    from brushgs.passes.add.stage_marks import HATCHING

    media = numbers_of(TonalMedium, materials)
    thin = min(media.line_width / INK_WIDTH, 1.0)
    aspect, spacing = HATCHING.aspect / thin, HATCHING.spacing / thin**2  # in widths
    shadow = staging.shadow(replace(HATCHING, aspect=aspect, spacing=spacing))
    strokes = in_colors(Gaussians.joined([shadow, staging.table_edge()]), rgb_of(media.color))
    pen = pen_brush()
    least = (media.line_width / 4) ** 2  # px^2, a box has 4 sigmas: at a slant, lines are as wide as others
    options = replace(materials.options.for_marks(pen), low_pass=least)
    return Coat(BACKDROP, replace(strokes, brushes=None), pen, options, dry=media.line_dry)
