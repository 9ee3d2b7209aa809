"""The media by name, and their coats."""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from brushgs.pipeline.media.materials import Materials
from brushgs.rendering.coat import Coat

if TYPE_CHECKING:
    from brushgs.pipeline.media.staging import Staging


def coats_of(materials: Materials) -> list[Coat]:
    """The coats of a painting in its medium, the first laid first.

    A medium is a function in the module of its name beside this one, where `stage` makes its stage.
    """
    make: Callable[[Materials], list[Coat]] = getattr(_module_of(materials), materials.media.kind)
    return make(materials)


def stage_of(materials: Materials, staging: "Staging") -> Coat:
    """The coat of a stage in the medium of a painting."""
    make: Callable[[Materials, Staging], Coat] = _module_of(materials).stage
    return make(materials, staging)


def cleared(materials: Materials, behind: list[Coat], drawn: list[Coat]) -> tuple[list[Coat], list[Coat]]:
    """The coats behind and of a painting in a medium, after a look at them: `cleared` of its module."""
    clear: Callable[..., tuple[list[Coat], list[Coat]]] | None
    clear = getattr(_module_of(materials), "cleared", None)
    return (behind, drawn) if clear is None else clear(materials, behind, drawn)


def _module_of(materials: Materials) -> ModuleType:
    return import_module(f"brushgs.pipeline.media.{materials.media.kind}")
