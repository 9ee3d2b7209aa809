"""Small paintings, made up, for the tests of the page."""

import numpy as np

import brushgs as bg
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.view import PageView
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions

CAMERA = bg.Camera.look_at((0.3, -0.4, -5), (0.1, 0, 0), width=64, height=48)
VIEW = PageView(np.array([0.0, -1.0, 0.0]), np.array([0.1, 0.2, -0.3]), 2.0, False)


def some_strokes(count, *, degree=0, brushes=1, seed=0, dtype=np.float32):
    """Strokes of all sizes around the origin."""
    draw = np.random.default_rng(seed)
    return bg.Gaussians(
        draw.normal(0, 1, (count, 3)).astype(dtype),
        draw.normal(0, 1, (count, 4)).astype(dtype),
        np.exp(draw.normal(-2, 0.7, (count, 3))).astype(dtype),
        draw.uniform(0.02, 1, count).astype(dtype),
        draw.normal(0, 0.5, (count, (degree + 1) ** 2, 3)).astype(dtype),
        brushes=None if brushes == 1 else draw.integers(0, brushes, count).astype(np.uint8),
    )


def some_coat(strokes, texture="flat", name="strokes", **options):
    """A coat; options that a coat itself has are told from those of rendering."""
    of_coat = {
        key: options.pop(key) for key in ("dry", "border", "tolerance", "normals", "blend") if key in options
    }
    brush_set = bg.BrushSet.of(texture)
    return Coat(name, strokes, brush_set, RenderOptions.of(brush_set, **options), **of_coat)


def contents_of(*coats, **facts):
    """The contents of a painting of these coats; facts are those of `Painting` and `page_contents`."""
    of_page = {key: facts.pop(key) for key in ("title", "background", "view", "regions") if key in facts}
    arguments = {"view": VIEW, "title": "a title", "command": ("a.ply", ["--look", "oil"])} | of_page
    return page_contents(Painting(coats, **facts), CAMERA, **arguments)
