"""The media by name: what each makes of strokes."""

from collections.abc import Callable, Mapping
from importlib import import_module

from brushgs.options.choices import Medium
from brushgs.painting.coats.materials import Materials
from brushgs.rendering.coats import Coat

MEDIA: Mapping[Medium, str] = {  # a function of that name in the module of that name
    "paint": "paint",
    "charcoal": "charcoal",
    "ink": "ink",
    "watercolour": "watercolour",
}


def coats_of(materials: Materials) -> list[Coat]:
    """The coats of a painting in its medium, the first laid first."""
    name = MEDIA[materials.media.kind]
    make: Callable[[Materials], list[Coat]] = getattr(import_module(f"brushgs.painting.coats.{name}"), name)
    return make(materials)
