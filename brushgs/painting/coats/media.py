"""The media by name: what each makes of strokes."""

from collections.abc import Callable
from importlib import import_module

from brushgs.painting.coats.materials import Materials
from brushgs.rendering.coat import Coat


def coats_of(materials: Materials) -> list[Coat]:
    """The coats of a painting in its medium, the first laid first.

    A medium is a function in the module of its name beside this one.
    """
    name = materials.media.kind
    make: Callable[[Materials], list[Coat]] = getattr(import_module(f"brushgs.painting.coats.{name}"), name)
    return make(materials)
