"""brushgs: trained 3D Gaussian Splatting scenes, painted with brush strokes, on the CPU.

The public names live in the modules listed in `_HOME` and are imported at first use, so that
`import brushgs` (and with it `brushgs --help`) costs nothing.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from brushgs.doctor import Finding, examine
    from brushgs.errors import SceneError, SceneWarning
    from brushgs.io import load, load_cameras, save
    from brushgs.io.reading import Reading
    from brushgs.io.video import save_video
    from brushgs.lock import track
    from brushgs.passes.cluster import cluster
    from brushgs.passes.prune import prune
    from brushgs.passes.recolor import Palette, recolor
    from brushgs.project import project
    from brushgs.raster.ops import rasterize, render, render_sequence
    from brushgs.scene import Boxes, Camera, Frame, Gaussians
    from brushgs.stroke_count import choose_strokes
    from brushgs.textures import StrokeTexture

__version__ = "0.1.0"

_HOME = {
    "Boxes": "scene",
    "Camera": "scene",
    "Finding": "doctor",
    "Frame": "scene",
    "Gaussians": "scene",
    "Palette": "passes.recolor",
    "Reading": "io.reading",
    "SceneError": "errors",
    "SceneWarning": "errors",
    "StrokeTexture": "textures",
    "choose_strokes": "stroke_count",
    "cluster": "passes.cluster",
    "examine": "doctor",
    "load": "io",
    "load_cameras": "io",
    "project": "project",
    "prune": "passes.prune",
    "rasterize": "raster.ops",
    "recolor": "passes.recolor",
    "render": "raster.ops",
    "render_sequence": "raster.ops",
    "save": "io",
    "save_video": "io.video",
    "track": "lock",
}

__all__ = [
    "Boxes",
    "Camera",
    "Finding",
    "Frame",
    "Gaussians",
    "Palette",
    "Reading",
    "SceneError",
    "SceneWarning",
    "StrokeTexture",
    "choose_strokes",
    "cluster",
    "examine",
    "load",
    "load_cameras",
    "project",
    "prune",
    "rasterize",
    "recolor",
    "render",
    "render_sequence",
    "save",
    "save_video",
    "track",
]


def __getattr__(name: str) -> object:
    """Import a public name from its home at first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module 'brushgs' has no attribute {name!r}")
    value = getattr(import_module(f"brushgs.{_HOME[name]}"), name)
    globals()[name] = value
    return value


class _Package(ModuleType):
    """This package. Importing a module sets it as an attribute here; a public name of the same name stays."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return sorted(__all__)
