"""brushgs: trained 3D Gaussian Splatting scenes, painted with brush strokes, on the CPU.

Public names are imported at first use, so that `import brushgs` (and with it `brushgs --help`) costs nothing.
`_MODULES` maps names to modules; the imports repeat it for type checkers, and a test compares the two.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from brushgs.version import __version__ as __version__

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet as BrushSet
    from brushgs.brushes.kit import BrushKit as BrushKit
    from brushgs.brushes.texture import StrokeTexture as StrokeTexture
    from brushgs.by_keywords import paint as paint
    from brushgs.by_keywords import paint_film as paint_film
    from brushgs.doctor import Finding as Finding
    from brushgs.doctor import examine as examine
    from brushgs.errors import SceneError as SceneError
    from brushgs.errors import SceneWarning as SceneWarning
    from brushgs.formats import load as load
    from brushgs.formats import load_cameras as load_cameras
    from brushgs.formats.moving import load_moving as load_moving
    from brushgs.formats.pictures.video import save_video as save_video
    from brushgs.formats.scenes.columns import Encoding as Encoding
    from brushgs.formats.scenes.columns import Reading as Reading
    from brushgs.formats.styles import load_style as load_style
    from brushgs.formats.styles import save_style as save_style
    from brushgs.options.clip import ClipConfig as ClipConfig
    from brushgs.options.look import Look as Look
    from brushgs.options.moment import Moment as Moment
    from brushgs.outlets.learn_style import learn_style as learn_style
    from brushgs.outlets.page.save import save as save
    from brushgs.passes.color.broken_color import break_colors as break_colors
    from brushgs.passes.color.recolor import Palette as Palette
    from brushgs.passes.color.recolor import recolor as recolor
    from brushgs.passes.color.repaint import repaint as repaint
    from brushgs.passes.form.choose_brushes import choose_brushes as choose_brushes
    from brushgs.passes.form.orient import orient as orient
    from brushgs.passes.form.solid import solidify as solidify
    from brushgs.passes.reduce.clean import clean as clean
    from brushgs.passes.reduce.prune import prune as prune
    from brushgs.pipeline.cameras import frame_scene as frame_scene
    from brushgs.pipeline.cameras import orbit as orbit
    from brushgs.pipeline.cluster import cluster as cluster
    from brushgs.pipeline.styling import styled as styled
    from brushgs.rendering.light import Lamp as Lamp
    from brushgs.rendering.light import light as light
    from brushgs.rendering.plain import plain_views as plain_views
    from brushgs.rendering.project import project as project
    from brushgs.rendering.rasterize import rasterize as rasterize
    from brushgs.rendering.render import render as render
    from brushgs.rendering.render import render_sequence as render_sequence
    from brushgs.rendering.track import track as track
    from brushgs.stroke_count.choose import choose_strokes as choose_strokes
    from brushgs.values.boxes import Boxes as Boxes
    from brushgs.values.camera import Camera as Camera
    from brushgs.values.frame import Frame as Frame
    from brushgs.values.gaussians import Gaussians as Gaussians
    from brushgs.values.moving import MovingScene as MovingScene
    from brushgs.values.style import Style as Style

_MODULES = {
    "brushes.brush_set": "BrushSet",
    "brushes.kit": "BrushKit",
    "brushes.texture": "StrokeTexture",
    "by_keywords": "paint paint_film",
    "doctor": "Finding examine",
    "errors": "SceneError SceneWarning",
    "formats": "load load_cameras",
    "formats.moving": "load_moving",
    "formats.pictures.video": "save_video",
    "formats.scenes.columns": "Encoding Reading",
    "formats.styles": "load_style save_style",
    "options.clip": "ClipConfig",
    "options.look": "Look",
    "options.moment": "Moment",
    "outlets.learn_style": "learn_style",
    "outlets.page.save": "save",
    "passes.color.broken_color": "break_colors",
    "passes.color.recolor": "Palette recolor",
    "passes.color.repaint": "repaint",
    "passes.form.choose_brushes": "choose_brushes",
    "passes.form.orient": "orient",
    "passes.form.solid": "solidify",
    "passes.reduce.clean": "clean",
    "passes.reduce.prune": "prune",
    "pipeline.cameras": "frame_scene orbit",
    "pipeline.cluster": "cluster",
    "pipeline.styling": "styled",
    "rendering.light": "Lamp light",
    "rendering.plain": "plain_views",
    "rendering.project": "project",
    "rendering.rasterize": "rasterize",
    "rendering.render": "render render_sequence",
    "rendering.track": "track",
    "stroke_count.choose": "choose_strokes",
    "values.boxes": "Boxes",
    "values.camera": "Camera",
    "values.frame": "Frame",
    "values.gaussians": "Gaussians",
    "values.moving": "MovingScene",
    "values.style": "Style",
}
_MODULE_OF = {name: module for module, names in _MODULES.items() for name in names.split()}
if not TYPE_CHECKING:  # type checkers take the imports above: they read only a literal list
    __all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> object:
    """Import a public name from its module at first use (PEP 562)."""
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'brushgs' has no attribute {name!r}")
    value = getattr(import_module(f"brushgs.{_MODULE_OF[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(_MODULE_OF)
