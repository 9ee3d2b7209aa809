"""`brushgs painter`: write a page that paints scene files dropped on it.

The page is that of `brushgs export` with a module in place of strokes. What its worker makes of a scene is
in Python, with k strokes,

    cleaned = bg.clean(bg.load(scene))
    kept = bg.prune(cleaned.take(~find_crumbs(cleaned, find_first_view(cleaned))), at_least=k)
    merged = bg.cluster(kept, k)
    solid = bg.orient(bg.solidify(merged.take(worth_keeping(merged))), kept)
    strokes = bg.break_colors(use_pigments(grade(solid)), follows=1)  # plain: none of these
    strokes = bg.choose_brushes(strokes, kit, material=1)

with the numbers of a look and its brushes, one image of each, shown as by `bg.save(strokes, "page.html",
texture=kit.open(), underpaint=True)`, on the ground of the look, with a relief and a lamp, on a stage
(`brushgs/passes/add/stage.py`).
"""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.kit import BrushKit
from brushgs.brushes.texture import without_number
from brushgs.cameras.framing import DEFAULT_FOV_Y
from brushgs.first_view.up import SURE
from brushgs.formats.files import replacing
from brushgs.options.look import Look
from brushgs.options.look_parts import USUAL_LAMP, BrushesConfig
from brushgs.options.page import PAGE_SUFFIXES
from brushgs.options.painting import DEFAULT_KEEP, PaintConfig
from brushgs.options.stroke_target import UsualCount
from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import PageContents, page_contents
from brushgs.outlets.page.html import page_html
from brushgs.outlets.page.view import PageView
from brushgs.outlets.painter.build import painter_module
from brushgs.passes.color.broken_color import CHROMA, LIGHTNESS
from brushgs.passes.color.color_space import XYZ_OVER_WHITE
from brushgs.passes.finest import DISTANCE, usual_finest
from brushgs.passes.form.choose_brushes import GROUPS
from brushgs.passes.form.solid import STRENGTH
from brushgs.passes.reduce.features import COLOR_WEIGHT
from brushgs.passes.reduce.lloyd import GAIN, NUM_STEPS
from brushgs.passes.reduce.merge import OVERLAP
from brushgs.pipeline.lamp import open_lamp
from brushgs.pipeline.look import open_relief
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.media.paint import QUIET
from brushgs.pipeline.outputs import check_output
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.relief import Relief
from brushgs.rendering.surface import Recipe
from brushgs.rendering.underpaint import STROKE_REACH
from brushgs.values.camera import Camera
from brushgs.values.colors import CONES_FROM_RGB, OKLAB_FROM_ROOTS, rgb_of
from brushgs.values.gaussians import Gaussians

LOOKS = ("oil", "impressionist", "gouache", "plain")  # of opaque paint
BRUSHES = ("flat", "filbert", "dab", "dry_brush", "palette_knife", "impasto", "fan", "swirl")
STROKES = 6000  # of looks that do not say how many
MOST_BYTES = (
    300_000_000  # of a scene file: with its columns it takes a gigabyte, as much as a phone gives a page
)
TITLE = "brushgs painter"
WIDTH, HEIGHT = 1280, 720
NUM_DRAWS = 64  # random numbers of k-means: it takes 40 at most


def write_painter(output: str | Path) -> int:
    """Write the page; the file appears when it is complete.

    Args:
        output: .html file.

    Returns:
        Its bytes.

    Raises:
        SceneError: if the file cannot be written.
        ValueError: if the name has another suffix, or the module cannot be compiled.
    """
    output = Path(output)
    check_output(output, PAGE_SUFFIXES)
    text = page_html(write_container(painter_contents(painter_module())), title=TITLE, drop=True)
    with replacing(output) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return output.stat().st_size


def painter_contents(module: bytes) -> PageContents:
    """Brushes, ground and module; the strokes are specks, one for each brush, until a scene is dropped."""
    brushes = BrushSet.open(",".join(BRUSHES))
    pages = {name: _page_of(Look.open(name).config, brushes) for name in LOOKS}
    contents = pages[LOOKS[0]]
    looks = {
        name: {
            "numbers": _numbers(Look.open(name).config),
            "header": {key: page.header[key] for key in ("surface", "background", "lamp")}
            | {"coats": page.header["coats"][-1:]},
            "stage": _stage(Look.open(name).config, page),
            "strokes": _count(Look.open(name).config),
            "isToned": Look.open(name).config.ground.ground == "toned",
        }
        for name, page in pages.items()
    }
    painter = {
        "looks": looks,
        "lamp": [degrees(angle) for angle in USUAL_LAMP],
        "sure": SURE,
        "strokeReach": STROKE_REACH,
        "mostBytes": MOST_BYTES,
    }
    arrays = {**contents.arrays, "module": np.frombuffer(module, np.uint8)}
    header = {**contents.header, "painter": painter, "coats": contents.header["coats"][-1:]}
    return PageContents(header, arrays, contents.rows, contents.omitted)


def _page_of(config: PaintConfig, brushes: BrushSet) -> PageContents:
    """The contents of a page in a look, with specks for strokes."""
    relief = open_relief(config.light)
    options = RenderOptions.of(brushes, underpaint=True, low_pass=0.3, relief=relief)
    is_plain, canvas = config.ground.ground == "none", config.light.canvas
    surface = None
    if not is_plain:
        # A toned ground takes its color from the scene.
        color = rgb_of(config.ground.ground) if config.ground.ground != "toned" else (0.5, 0.5, 0.5)
        recipe = Recipe(
            "flat" if canvas == "none" else canvas,
            np.array(color, np.float32),
            config.light.canvas_strength,
            0,
            None,
        )
        surface = recipe.surface(height=HEIGHT, width=WIDTH)
    specks = _specks(len(brushes))
    coats = [Coat("strokes", specks, brushes, options)]
    if config.ground.stage:
        quiet = relief and replace(relief, thickness=QUIET * relief.thickness, gain=QUIET * relief.gain)
        coats.insert(0, Coat(BACKDROP, specks, brushes, replace(options, relief=quiet), is_one_sided=True))
    painting = Painting(tuple(coats), surface=surface, lamp=open_lamp(config.light, None))
    camera = Camera.look_at(
        (0, 0, -DISTANCE), (0, 0, 0), up=(0, -1, 0), width=WIDTH, height=HEIGHT, fov_y=DEFAULT_FOV_Y
    )
    view = PageView(np.array([0.0, -1.0, 0.0]), np.zeros(3), 1.0, False)
    behind = (1.0, 1.0, 1.0) if is_plain else None
    return page_contents(
        painting, camera, view=view, title=TITLE, command=("scene.ply", []), background=behind
    )


def _stage(config: PaintConfig, page: PageContents) -> dict[str, Any] | None:
    """Of the stage of a look: its coat, and the numbers of `show` of the module; None without."""
    ground = config.ground
    if not ground.stage:
        return None
    jitter, matrices = ground.stage_jitter, np.stack([CONES_FROM_RGB, OKLAB_FROM_ROOTS])
    numbers = [
        *(ground.stage_size, ground.stage_aspect, *jitter, ground.shadow, config.color.values),
        *(*matrices.ravel().tolist(), QUIET),
    ]
    return {"coat": page.header["coats"][0], "numbers": numbers}


def _numbers(config: PaintConfig) -> list[float]:
    """Of `paint` of the module: `finest` is in radii of the scene."""
    shapes = [usual_finest(1.0), COLOR_WEIGHT, NUM_STEPS, GAIN, OVERLAP, DEFAULT_KEEP, STRENGTH]
    lightness, light, color = config.strokes.broken_color, config.light, config.color
    matrices = np.stack([CONES_FROM_RGB, OKLAB_FROM_ROOTS, XYZ_OVER_WHITE])
    relief = open_relief(light) or Relief(0, 0)
    return [
        *(*shapes, lightness, lightness / LIGHTNESS * CHROMA, *matrices.ravel().tolist()),
        *(config.strokes.economy, color.chroma, color.contrast, color.pivot, *color.shadows, *color.lights),
        *(color.pigments, color.pure, relief.thickness, relief.gain, relief.by_light),
        *(config.ground.lightness, config.ground.complement, *config.ground.warmth, config.strokes.economy),
        *_brush_rows(config.brushes),
        *np.random.default_rng(0).random(NUM_DRAWS).tolist(),
    ]


def _count(config: PaintConfig) -> int:
    """Strokes of a look."""
    target = config.cluster.strokes
    return target.count if isinstance(target, UsualCount) else STROKES


def _brush_rows(brushes: BrushesConfig) -> Iterator[int]:
    """Number and rows in `BRUSHES` of the brushes for each kind of stroke; without any all are the first."""
    names = {group: getattr(brushes, group) for group in GROUPS}
    kit = BrushKit(**names) if brushes.names else BrushKit(other=BRUSHES[:1])
    for group in GROUPS:
        rows = {BRUSHES.index(without_number(kit.images[row])) for row in kit.rows()[group]}
        yield len(rows)
        yield from sorted(rows)


def _specks(count: int) -> Gaussians:
    means = np.zeros((count, 3), np.float32)
    quats = np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1))
    scales = np.full((count, 3), 1e-6, np.float32)
    opacities = np.ones(count, np.float32)
    sh = np.zeros((count, 1, 3), np.float32)
    return Gaussians(means, quats, scales, opacities, sh, brushes=np.arange(count, dtype=np.uint8))
