"""Stippling: evenly spaced dots by tone, and lines by weight."""

from brushgs.options.media import Stippling
from brushgs.passes.add.tonal_marks import Manner
from brushgs.pipeline.media.hatching import stage
from brushgs.pipeline.media.materials import Materials, numbers_of
from brushgs.pipeline.media.tonal import ground_coat, keyed_tones, marks_coat, views_of, weighed_lines
from brushgs.rendering.coat import Coat

DARKEST = 0.05  # tone from which on spacing grows
POWER = 2.6  # of its growth: the area per dot then goes about as one over the darkness

__all__ = ["stage", "stippling"]


def stippling(materials: Materials) -> list[Coat]:
    """The coats of a drawing in dots."""
    media = numbers_of(Stippling, materials)
    tones = keyed_tones(materials)
    views = views_of(materials, tones)
    darkest = min(DARKEST, media.lightest - 0.01)
    manner = Manner(darkest, media.lightest, media.spacing, media.width, power=POWER)
    coats = [ground_coat(materials, tones, None), *marks_coat("dots", materials, views, manner, seed=3)]
    return coats + weighed_lines(materials, tones)
