"""Steps that open files: those of options, and the scene."""

from dataclasses import replace
from typing import TYPE_CHECKING

from brushgs.options.choices import StrokeColor
from brushgs.options.direction import Direction
from brushgs.options.focus import Focus
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.maps import Map
from brushgs.options.overpaint import OverpaintConfig
from brushgs.options.painting import (
    CleanConfig,
    ClusterConfig,
    DrawConfig,
    PaletteConfig,
    StrokesConfig,
    ViewConfig,
)
from brushgs.options.rules import Rules
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.options.styling import StyleConfig
from brushgs.pipeline.clean import clean_scene
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.drawing import open_brushes
from brushgs.pipeline.moving import load_clip, with_rows
from brushgs.pipeline.overpaint import Overpainted, open_overpaint
from brushgs.pipeline.regions import Regions, open_regions
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory, costly, makes, unless
from brushgs.pipeline.strokes import load_scene, open_palette
from brushgs.pipeline.styling import Styles, open_styles
from brushgs.pipeline.where import with_ids
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.color.recolor import Palette
    from brushgs.passes.motion.canonical import Canonical
    from brushgs.values.notes import LoadNotes

Views = Camera | PathConfig | GrowConfig | None


@makes("sees", "focused_on", "maps", "direction", "is_solid", "economy")
def of_strokes(
    strokes_config: StrokesConfig,
) -> tuple[bool, Focus | None, tuple[Map, ...], Direction, bool, float]:
    """The options of strokes, separately: different steps depend on each."""
    config = strokes_config
    return config.see == "views", config.focus, config.maps, config.direction, config.solid, config.economy


@makes("stroke", "stroke_color", "background_name", "threads")
def of_draw(draw_config: DrawConfig) -> tuple[str, StrokeColor | None, str, int | None]:
    """The options of drawing that decide about other steps."""
    draw = draw_config
    return draw.stroke, draw.stroke_color, draw.background, draw.threads


def asked_size(view_config: ViewConfig) -> tuple[int, int] | None:
    """The requested size of the picture."""
    return view_config.fixed_size


def along_path(source: SceneFiles | Gaussians | Clip, views: Views) -> bool:
    """Whether many frames are painted."""
    return isinstance(source, Clip) or isinstance(views, PathConfig)


@unless(lambda style_config: "no --style" if style_config is None else None)
def styles(style_config: StyleConfig, report: Report) -> Styles | None:
    """The styles of `--style`."""
    return open_styles(style_config, report)


@unless(lambda rules_config: "no --rules" if rules_config is None else None)
def regions(rules_config: Rules, report: Report) -> Regions | None:
    """The parts of `--rules`."""
    return open_regions(rules_config, report)


def more_brushes(styles: Styles | None, regions: Regions | None) -> tuple[str, ...]:
    """Names of the brushes of styles and parts."""
    of_styles = [] if styles is None else [name for names in styles.brushes for name in names]
    return (*of_styles, *([] if regions is None else regions.brushes))


def own_brushes(
    brushes_config: BrushesConfig,
    stroke: str,
    stroke_color: StrokeColor | None,
    asked_size: tuple[int, int] | None,
    economy: float,
    more_brushes: tuple[str, ...],
    report: Report,
    memory: Memory,
) -> "tuple[BrushSet, BrushKit]":
    """The brushes that options name, and which strokes each suits."""
    return open_brushes(
        brushes_config,
        stroke,
        asked_size,
        more_brushes,
        report,
        by_material=economy > 0,
        stroke_color=stroke_color,
        memory=memory,
    )


@costly
@unless(lambda palette_config: "no --palette" if palette_config is None else None)
def palette(palette_config: PaletteConfig, report: Report) -> "Palette | None":
    """The colors of `--palette`."""
    return open_palette(palette_config, report)


@unless(lambda overpaint_config: None if overpaint_config.files else "no --marks")
def overpaint(overpaint_config: OverpaintConfig, source: SceneFiles | Gaussians | Clip) -> Overpainted | None:
    """What is painted over the scene by hand."""
    return open_overpaint(overpaint_config, source)


@costly
@makes("loaded", "notes", "rows", "clip")
def read(
    source: SceneFiles | Gaussians | Clip, workers: SequenceConfig | None, report: Report
) -> "tuple[Gaussians, LoadNotes | None, Canonical | None, Clip | None]":
    """The Gaussians of a scene, notes on its files, and how they move."""
    if isinstance(source, Clip):
        clip = with_rows(source, report)
        return *load_clip(clip, report), clip
    if isinstance(source, Gaussians):
        return source, None, None, None
    return *load_scene(source, report, makes_strokes=True, workers=workers), None, None


def is_strokes(notes: "LoadNotes | None") -> bool:
    """Whether the scene is strokes."""
    return notes is not None and notes.is_strokes


@makes("brushed", "texture", "kit")
def stored_brushes(
    loaded: Gaussians,
    notes: "LoadNotes | None",
    source: SceneFiles | Gaussians | Clip,
    own_brushes: "tuple[BrushSet, BrushKit]",
    more_brushes: tuple[str, ...],
    brushes_config: BrushesConfig,
    asked_size: tuple[int, int] | None,
    report: Report,
) -> "tuple[Gaussians, BrushSet, BrushKit]":
    """Strokes with the brushes of their file, and these; without, if others are requested."""
    if loaded.brushes is None:
        return loaded, *own_brushes
    from brushgs.pipeline.stored_brushes import open_stored_brushes

    stored = None
    if not more_brushes and not isinstance(source, Gaussians | Clip):
        stored = open_stored_brushes(loaded, notes, source, brushes_config, asked_size, report)
    return loaded if stored else replace(loaded, brushes=None), *(stored or own_brushes)


@unless(lambda where: "no --where" if where is None else None, "brushed")
def numbered(brushed: Gaussians) -> Gaussians:
    """The Gaussians with row numbers as ids, if only a part of them becomes strokes."""
    return with_ids(brushed)


@costly
def cleaned(numbered: Gaussians, clean_config: CleanConfig, is_strokes: bool, report: Report) -> Gaussians:
    """The Gaussians without floaters."""
    return clean_scene(numbered, clean_config, report, is_strokes=is_strokes)


def clustering(cluster_config: ClusterConfig, along_path: bool, is_strokes: bool) -> ClusterConfig:
    """The options of clustering."""
    config = cluster_config.of_film if along_path else cluster_config
    return replace(config, strokes=None) if is_strokes and config.keeps_strokes else config
