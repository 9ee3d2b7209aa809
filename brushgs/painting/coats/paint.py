"""Opaque paint: strokes in their own colours, in one coat."""

from brushgs.painting.coats.materials import Materials
from brushgs.rendering.coat import Coat


def paint(materials: Materials) -> list[Coat]:
    """The coat of a painting."""
    return [Coat("strokes", materials.strokes, materials.texture, materials.options)]
