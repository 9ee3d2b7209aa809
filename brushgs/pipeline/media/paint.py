"""Opaque paint: strokes in their own colors, in one coat, and the contours of styles."""

from dataclasses import replace
from typing import TYPE_CHECKING

from brushgs.pipeline.media.materials import BACKDROP, Materials
from brushgs.rendering.coat import Coat

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging

QUIET = 0.5  # height of the paint of a stage, relative to the subject


def paint(materials: Materials) -> list[Coat]:
    """The coat of a painting, and that of its contours if its styles have some."""
    strokes = Coat("strokes", materials.strokes, materials.texture, materials.options)
    return [strokes, *materials.contours()]


def stage(materials: Materials, staging: "Staging") -> Coat:
    """A stage in large quiet strokes of the same brushes."""
    strokes, relief = staging.finished(staging.painted()), materials.options.relief
    if relief is not None:
        relief = replace(relief, thickness=QUIET * relief.thickness, gain=QUIET * relief.gain)
    options = replace(materials.options, relief=relief, streaks=0.0)
    return Coat(BACKDROP, strokes, materials.texture, options)
