"""Steps for the passes on strokes: directions, colors, light, brushes; also in parts of a scene."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from brushgs.options.direction import Direction
from brushgs.options.look_parts import ColorConfig
from brushgs.options.media import Medium
from brushgs.options.painting import ClusterConfig, PaletteConfig, StrokesConfig
from brushgs.options.styling import AdjustConfig
from brushgs.pipeline.color_changes import Changes, palette_passes
from brushgs.pipeline.lamp import Key
from brushgs.pipeline.maps import Property
from brushgs.pipeline.media.materials import Materials
from brushgs.pipeline.overpaint import Overpainted, marks_continued
from brushgs.pipeline.regions import Region, Regions
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Later, Memory, anew, unless
from brushgs.pipeline.stroke_changes import (
    Field,
    StrokeChanges,
    broken_color_pass,
    brush_color_pass,
    brush_passes,
    defocus_pass,
    direction_pass,
    grading_passes,
    in_parts,
    open_fields,
    part_brush_passes,
    repaint_pass,
    solid_pass,
    style_brush_passes,
)
from brushgs.pipeline.stroke_pass import ALREADY_STROKES, Finish, StrokePass
from brushgs.pipeline.styling import Styles
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.color.recolor import Palette
    from brushgs.passes.form.defocus import Lens
    from brushgs.rendering.plain import PlainViews


def parts(regions: Regions | None) -> Sequence[Region]:
    """The parts of the scene with their own rules."""
    return () if regions is None else regions.regions


def _no_fields(skip: str | None, direction: Direction, parts: Sequence[Region]) -> str | None:
    is_own = direction.kind == "own" and all(part.direction is None for part in parts)
    return skip or ("--direction own" if is_own else None)


@unless(_no_fields, ())
def fields(
    direction: Direction,
    styles: Styles | None,
    parts: Sequence[Region],
    cameras: Later[Sequence[Camera]],
) -> Sequence[Field]:
    """The directions of strokes, as `orient` takes them, in the painting and in its parts."""
    named = direction, *(part.direction for part in parts)
    is_laid_over = any(one is not None and one.needs_camera for one in named)
    return open_fields(direction, styles, parts, cameras()[0] if is_laid_over else None)


@anew
def making(
    pruned: Gaussians,
    strokes_config: StrokesConfig,
    plain_views: "PlainViews | None",
    fields: Sequence[Field],
    parts: Sequence[Region],
    mapped: Sequence[Property],
    lens: "Lens | None",
    skip: str | None,
    memory: Memory,
) -> list[StrokePass]:
    """The passes that make strokes of clusters."""
    direction = strokes_config.direction
    return [
        solid_pass(strokes_config, skip, memory),
        *(one.stroke_pass(pruned, skip) for one in mapped if one.name in ("size", "opacity")),
        direction_pass(pruned, direction, fields, skip, memory),
        repaint_pass(pruned, plain_views, skip, memory),
        *([] if lens is None else [defocus_pass(lens, strokes_config, skip, memory)]),
    ]


@anew
def colors(
    styles: Styles | None,
    regions: Regions | None,
    adjust_config: AdjustConfig,
    color_config: ColorConfig,
    media_config: Medium,
    stance: Later[FirstView | None],
    plain_views: "PlainViews | None",
) -> Changes:
    """The color changes that do not come from the scene, fitted to the first strokes."""
    seen = stance() if styles is not None or regions is not None else None
    cameras = () if plain_views is None else plain_views.cameras
    is_gray = color_config.gray and not media_config.has_own_color  # such media have no other colors
    return Changes(styles, adjust_config, seen, cameras, is_gray)


@anew
def coloring(
    palette: "Palette | None",
    palette_config: PaletteConfig | None,
    colors: Changes,
    color_config: ColorConfig,
    strokes_config: StrokesConfig,
    clustering: ClusterConfig,
    pruned: Gaussians,
    parts: Sequence[Region],
    mapped: Sequence[Property],
    skip: str | None,
) -> list[StrokePass]:
    """The passes that change colors, except light."""
    palettes, restyling, adjusting = (
        palette_passes(palette, palette_config),
        colors.style_passes(),
        colors.adjust_passes(),
    )
    return [
        *in_parts(
            palettes,
            parts,
            lambda part: part.palette is not None,
            lambda part: palette_passes(part.palette, part.palette_config),
        ),
        *grading_passes(color_config, seed=clustering.seed),
        broken_color_pass(strokes_config, seed=clustering.seed, skip=skip),
        *in_parts(  # after it, so that broken colors are colors of the style too
            restyling,
            parts,
            lambda part: part.rule.style is not None,
            lambda part: replace(colors, styles=part.styles).style_passes(),
        ),
        *in_parts(
            adjusting,
            parts,
            lambda part: part.rule.adjust is not None,
            lambda part: replace(
                colors, styles=None, adjust=part.rule.adjust or colors.adjust
            ).adjust_passes(),
        ),
        *(one.stroke_pass(pruned, skip) for one in mapped if one.name == "chroma"),
    ]


@unless(lambda stroke_color: None if stroke_color == "own" else "strokes have their own colors")
def colors_of_brushes(texture: "BrushSet") -> "BrushSet":
    """The brushes whose colors strokes take."""
    return texture


@anew
def choosing(
    kit: "BrushKit",
    strokes_config: StrokesConfig,
    styles: Styles | None,
    parts: Sequence[Region],
    pruned: Gaussians,
    clustering: ClusterConfig,
    colors_of_brushes: "BrushSet | None",
    skip: str | None,
) -> list[StrokePass]:
    """What chooses a brush for each stroke, and gives strokes the colors of their brushes."""
    seed, row_of = clustering.seed, {image: row for row, image in enumerate(kit.images)}
    has_brushes = skip == ALREADY_STROKES and pruned.brushes is not None  # strokes keep them
    return [
        *in_parts(
            [] if has_brushes else brush_passes(kit, strokes_config, seed=seed),
            parts,
            lambda part: part.kit is not None,
            lambda part: [] if part.kit is None else part_brush_passes(part.kit, row_of, seed=seed),
        ),
        *in_parts(
            [] if has_brushes else style_brush_passes(styles, kit, seed=seed),
            parts,
            lambda part: part.kit is not None or part.rule.style is not None,
            lambda part: style_brush_passes(part.styles, kit, seed=seed),
        ),
        *([] if colors_of_brushes is None else [brush_color_pass(colors_of_brushes)]),
    ]


@anew
def is_recolored(colors: Changes, palette: "Palette | None", regions: Regions | None) -> bool:
    """Whether strokes get other colors than the scene has."""
    return palette is not None or colors.are_any or (regions is not None and regions.recolors)


@anew
def changes(
    making: list[StrokePass],
    coloring: list[StrokePass],
    choosing: list[StrokePass],
    colors: Changes,
    is_recolored: bool,
    key: Key | None,
    skip: str | None,
    memory: Memory,
) -> StrokeChanges:
    """All passes on strokes, while they are made and after."""
    lit = [] if key is None else [key.stroke_pass(skip=skip, memory=memory)]
    if not is_recolored:
        # A budget compares with the scene, so it must include them; but the scene has another light.
        return StrokeChanges([*making, *coloring, *choosing], Finish(lit), colors)
    # Lit first, so that light and shade take colors of the palette and the style.
    return StrokeChanges(making, Finish([*lit, *coloring, *choosing]), colors)


@anew
@unless(lambda overpaint_config: None if overpaint_config.continues else "--continue off", "graded")
def continued(
    graded: Materials, overpaint: Overpainted | None, first_view: FirstView, report: Report
) -> Materials:
    """The strokes, painted as marks paint those that are like them."""
    strokes = (
        graded.strokes
        if overpaint is None
        else marks_continued(graded.strokes, overpaint, first_view, report)
    )
    return replace(graded, strokes=strokes)
