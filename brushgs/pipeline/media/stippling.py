"""Stippling: evenly spaced dots by tone, and lines by weight."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.media import Stippling
from brushgs.passes.add.stage_marks import Marking
from brushgs.passes.add.tonal_marks import Manner
from brushgs.pipeline.media import hatching
from brushgs.pipeline.media.materials import BACKDROP, Materials, numbers_of
from brushgs.pipeline.media.tonal import ground_coat, keyed_tones, marks_coat, views_of, weighed_lines
from brushgs.rendering.coat import Coat
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

DARKEST = 0.05  # tone from which on spacing grows
POWER = 2.6  # of its growth: the area per dot then goes about as one over the darkness
# The ground of a shadow, on which its dots lie; tone of full shade, below the lightest with dots; and the
# shade of the edge of a table.
PATCH, SHADE, EDGE = Marking(length=0.02, aspect=1.0, spacing=0.4, lightest=0.05), 0.5, 0.5


def stippling(materials: Materials) -> list[Coat]:
    """The coats of a drawing in dots."""
    tones = keyed_tones(materials)
    views = views_of(materials, tones)
    manner = _manner(materials)
    coats = [ground_coat(materials, tones, None), *marks_coat("dots", materials, views, manner, seed=3)]
    return coats + weighed_lines(materials, tones)


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A shadow and the edge of a table in dots."""
    if materials.sight is None:
        return hatching.stage(materials, staging)
    shadow, edge = staging.shadow(PATCH), staging.table_edge()
    shades = np.concatenate([shadow.opacities - 1 / 3, np.full(len(edge), EDGE)])
    ground = Gaussians.joined([shadow, edge])
    ground = replace(ground, opacities=np.ones_like(ground.opacities), brushes=None)
    manner, on_ground = _manner(materials), replace(materials, strokes=ground)
    views = views_of(on_ground, manner.lightest - SHADE * np.clip(shades, 0, 1))
    for coat in marks_coat(BACKDROP, on_ground, views, manner, seed=4):
        dots = coat.strokes  # with the normal of the ground as their third axis, as all that lies on a stage
        level = replace(dots, quats=np.resize(ground.quats[0], dots.quats.shape).astype(dots.quats.dtype))
        return replace(coat, strokes=level, tolerance=None)
    return hatching.stage(materials, staging)


def _manner(materials: Materials) -> Manner:
    media = numbers_of(Stippling, materials)
    darkest = min(DARKEST, media.lightest - 0.01)
    return Manner(darkest, media.lightest, media.spacing, media.width, power=POWER)
