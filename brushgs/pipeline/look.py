"""The stages between strokes and a painting: ground, relief and lines."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.choices import Canvas
from brushgs.options.look_parts import GroundConfig, LightConfig
from brushgs.pipeline.background import Background, open_background
from brushgs.pipeline.report import Report
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.colors import code_of
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.rendering.plain import PlainViews
    from brushgs.rendering.relief import Relief
    from brushgs.rendering.surface import Surface
    from brushgs.values.lines import Lines

BOUGHT = {"canvas": "#dccfb8", "paper": "#f7f3ea"}  # untoned grounds
BY_LIGHT = 2.0  # ratio of `Relief.by_light` to the strength of the key light
LINE_BRUSH = "line"
MOST_PIXELS = 1 << 24  # of a picture in one piece: 5120 x 2880 and a little more, some 2 GB
PROOF_SIDE = 1024  # pixels, of the ground of a larger picture, for its mean color


def open_relief(
    config: LightConfig, dpi: float | None = None, by_place: "Callable[[Gaussians], F64] | None" = None
) -> "Relief | None":
    """The relief of a look's paint; None if it is not visible. `dpi` and `by_place` are those of `Relief`."""
    if config.relief == 0 or config.gain == config.base == 0:
        return None
    from brushgs.rendering.relief import Relief

    by_light = min(BY_LIGHT * config.key, 1.0)
    return Relief(config.base, config.gain, by_light=by_light, dpi=dpi, by_place=by_place)


def open_surface(
    ground: GroundConfig,
    canvas: tuple[Canvas, float],
    background: str,
    gaussians: Gaussians,
    camera: Camera,
    report: Report,
    *,
    dpi: float | None = None,
) -> "Surface | None":
    """The ground and canvas of a look, in the size of the picture; None for a plain background.

    Of a picture of more than `MOST_PIXELS` it is a proof: parts of the ground are made as they are painted.

    Args:
        ground: its options.
        canvas: below the ground, and the strength of its grain.
        background: shown without a ground, as `open_background` takes it.
        gaussians: the scene, whose colors a toned ground matches.
        camera: gives the size.
        report: gets the stage, only if there is a surface.
        dpi: pixels per inch on paper; None without a physical size.

    Raises:
        SceneError: if the ground is an image that cannot be read.
    """
    kind, strength = canvas
    if ground.ground == "none" and kind == "none":
        return None
    with report.stage("ground") as stage:
        from brushgs.rendering.surface import Recipe

        color = _ground_color(ground, background, gaussians, camera)
        shown = np.asarray((1.0, 1.0, 1.0) if color is None else color, np.float32)
        recipe = Recipe("flat" if kind == "none" else kind, shown, strength, 0, dpi)
        if shown.ndim == 1 and camera.width * camera.height > MOST_PIXELS:
            camera = camera.in_side(PROOF_SIDE)
        surface = recipe.surface(height=camera.height, width=camera.width)
        of_color = "transparent" if color is None else "a picture" if np.ndim(color) == 3 else code_of(color)
        stage.did = f"{background if ground.ground == 'none' else ground.ground}, {of_color}"
        if kind != "none":
            stage.did += f", on {kind}"
        stage.counts = {"ground": ground.ground, "canvas": kind}
    return surface


def recolored_ground(surface: "Surface | None", change: Callable[[Array], Array]) -> "Surface | None":
    """A surface with recolored ground; `change` takes the ground, [3] or [H, W, 3]."""
    if surface is None:
        return None
    from brushgs.rendering.surface import in_color

    assert surface.recipe is not None, "open_surface makes it of a recipe"
    return in_color(surface, change(surface.recipe.color))


def shown_ground(surface: "Surface | None", background: Background) -> Background:
    """The color of unpainted pixels: RGB [3] or [H, W, 3]; None if transparent."""
    return background if surface is None or background is None else surface.rgb


def _ground_color(ground: GroundConfig, background: str, gaussians: Gaussians, camera: Camera) -> Background:
    if ground.ground == "none":
        return open_background(background, camera.width, camera.height)
    if ground.ground == "toned":
        from brushgs.passes.add.backdrop import Tone, ground_color

        return ground_color(gaussians, Tone(ground.lightness, ground.complement, ground.warmth))
    return open_background(BOUGHT.get(ground.ground, ground.ground), camera.width, camera.height)


def open_lines(
    width: float,
    gaussians: Gaussians,
    views: "PlainViews | None",
    cameras: Sequence[Camera],
    threads: int | None,
    report: Report,
) -> "tuple[Lines, BrushSet] | tuple[None, None]":
    """The lines of a drawing medium, from the views of the job, and their brushes; or None.

    `width` is that of `find_lines`.
    """
    if len(gaussians) == 0:
        return None, None
    with report.stage("lines") as stage:
        from brushgs.brushes.brush_set import size_for
        from brushgs.brushes.kit import BrushKit
        from brushgs.passes.add.lines import find_lines

        camera = cameras[0]
        brushes = BrushKit(other=(LINE_BRUSH,)).open(size=size_for(camera.width, camera.height))
        lines = find_lines(
            gaussians,
            views or cameras[:1],
            width=width,
            num_threads=threads,
        )
        # All pieces of a line have one brush, or it would not read as one.
        of_line = (lines.chains % len(brushes)).astype(np.uint8)
        lines = replace(lines, strokes=replace(lines.strokes, brushes=of_line))
        num_lines = len(np.unique(lines.chains))
        stage.did = f"{num_lines:,} lines in {len(lines):,} pieces"
        stage.counts = {"lines": num_lines, "pieces": len(lines)}
    return lines, brushes
