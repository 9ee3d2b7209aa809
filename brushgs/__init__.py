"""brushgs: trained 3D Gaussian Splatting scenes, painted with brush strokes, on the CPU.

The public names live in the modules listed in `_HOME` and are imported at first use, so that
`import brushgs` (and with it `brushgs --help`) costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.doctor import Finding, examine
    from brushgs.errors import SceneError, SceneWarning
    from brushgs.io import load, load_cameras, save
    from brushgs.io.pictures.video import save_video
    from brushgs.io.scenes.encoding import Encoding, Reading
    from brushgs.passes.cluster import cluster
    from brushgs.passes.prune import prune
    from brushgs.passes.recolor import Palette, recolor
    from brushgs.rendering.project import project
    from brushgs.rendering.rasterize import rasterize
    from brushgs.rendering.render import render, render_sequence
    from brushgs.rendering.track import track
    from brushgs.scene import Boxes, Camera, Frame, Gaussians
    from brushgs.stroke_count.choose import choose_strokes

__version__ = "0.1.0"

_HOME = {
    "Boxes": "scene",
    "Camera": "scene",
    "Encoding": "io.scenes.encoding",
    "Finding": "doctor",
    "Frame": "scene",
    "Gaussians": "scene",
    "Palette": "passes.recolor",
    "Reading": "io.scenes.encoding",
    "SceneError": "errors",
    "SceneWarning": "errors",
    "StrokeTexture": "brushes.texture",
    "choose_strokes": "stroke_count.choose",
    "cluster": "passes.cluster",
    "examine": "doctor",
    "load": "io",
    "load_cameras": "io",
    "project": "rendering.project",
    "prune": "passes.prune",
    "rasterize": "rendering.rasterize",
    "recolor": "passes.recolor",
    "render": "rendering.render",
    "render_sequence": "rendering.render",
    "save": "io",
    "save_video": "io.pictures.video",
    "track": "rendering.track",
}

__all__ = [
    "Boxes",
    "Camera",
    "Encoding",
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


def __dir__() -> list[str]:
    return sorted(__all__)
