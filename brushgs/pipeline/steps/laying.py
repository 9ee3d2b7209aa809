"""Steps that lay strokes: motion, backdrop, and the coats of a painting.

None of their results is kept from one painting to the next: they change with almost any option of a look.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.direction import Direction
from brushgs.options.look_parts import GroundConfig, LightConfig
from brushgs.options.media import Medium
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from brushgs.options.where import WhereConfig
from brushgs.pipeline.backdrop import Setting, open_backdrop
from brushgs.pipeline.background import Background
from brushgs.pipeline.clip import Clip, Film
from brushgs.pipeline.drawing import render_options
from brushgs.pipeline.finishing import (
    NEAR_VIEWS,
    in_own_lights,
    with_accents,
    with_edges,
    with_fields,
    with_values,
)
from brushgs.pipeline.lamp import Key, day_of, open_lamp, suns_of
from brushgs.pipeline.look import open_relief, recolored_ground, shown_ground
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.maps import Property, reader_of, with_holds
from brushgs.pipeline.media.materials import BACKDROP, Materials
from brushgs.pipeline.media.media import cleared, coats_of
from brushgs.pipeline.media.motif import Motif
from brushgs.pipeline.media.sight import Sight
from brushgs.pipeline.moving import Moving, attached, follow_strokes
from brushgs.pipeline.overpaint import Overpainted, overpainted
from brushgs.pipeline.regions import Regions
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Later, Memory, anew, makes, unless
from brushgs.pipeline.stroke_changes import StrokeChanges
from brushgs.pipeline.stroke_pass import nearest_rows
from brushgs.pipeline.styling import Contour, Styles
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.motion import StrokeMotion
from brushgs.rendering.rigs import Rig
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.part import Part

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.add.stage import Site
    from brushgs.passes.color.recolor import Palette
    from brushgs.passes.color.values import Values
    from brushgs.passes.form.defocus import Lens
    from brushgs.passes.form.edges import Edges
    from brushgs.passes.motion.canonical import Canonical
    from brushgs.passes.reduce.cluster import Grouping
    from brushgs.rendering.growing import GrowingPainting
    from brushgs.rendering.light import Lamp
    from brushgs.rendering.options import RenderOptions
    from brushgs.rendering.plain import PlainViews
    from brushgs.rendering.surface import Surface
    from brushgs.values.lines import Lines

Change = Callable[[Array], Array]


@anew
def painted_with(config: PaintConfig, view: ViewConfig) -> PaintConfig:
    """All options, with the view of a composed picture."""
    return replace(config, view=view)


@anew
def options(
    draw_config: DrawConfig,
    texture: "BrushSet",
    along_path: bool,
    light_config: LightConfig,
    view_config: ViewConfig,
    projection_config: ProjectionConfig,
    mapped: Sequence[Property],
    pruned: Later[Gaussians],
) -> "RenderOptions":
    """The options for drawing strokes."""
    by_place = reader_of(mapped, "relief", pruned()) if mapped else None
    relief = open_relief(light_config, view_config.dpi, by_place)
    is_spherical = projection_config.is_spherical
    return render_options(
        draw_config, texture, along_path=along_path, is_spherical=is_spherical, relief=relief
    )


@anew
@makes("strokes", "shown_plain", "motion")
@unless(lambda is_moving: None if is_moving else "the scene does not move", "finished", "plain", None)
def followed(
    finished: Gaussians,
    plain: Gaussians | None,
    clip: Clip,
    film: Film,
    grouping: "Grouping | None",
    maker: StrokeMaker,
    changes: StrokeChanges,
    clustering: ClusterConfig,
    rows: "Canonical | None",
    report: Report,
    memory: Memory,
) -> tuple[Gaussians, Gaussians | None, StrokeMotion | None]:
    """The strokes, including those born later; the unpainted Gaussians; and the motion of both."""
    return follow_strokes(
        clip,
        film,
        finished,
        grouping,
        maker.gaussians,
        changes.later(),
        report,
        found=rows,
        plain=plain,
        asked=clustering.asked_count,
        memory=memory,
    )


@anew
def colored_ground(ground: "Surface | None", finished: Gaussians, changes: StrokeChanges) -> "Surface | None":
    """The ground, recolored by changes that are fitted to the finished strokes."""
    return recolored_ground(ground, changes.colors.ground) if changes.colors.are_any else ground


@anew
@unless(lambda media_config: None if media_config.draws_tones else "the medium does not look at the views")
def sight(
    cameras: Sequence[Camera],
    plain_views: "PlainViews | None",
    pruned: Gaussians,
    focus: F64 | None,
    direction: Direction,
    along_path: bool,
) -> Sight:
    """The data by which media place their marks in the views of the job."""
    return Sight.of(cameras, plain_views, pruned, focus, direction, is_film=along_path)


@anew
@unless(lambda media_config: None if media_config.kind == "charcoal" else "the medium keeps no values")
def motif(
    plain_views: "PlainViews | None",
    is_recolored: bool,
    is_path: bool,
    lighting: LightConfig,
    cameras: Sequence[Camera],
) -> Motif | None:
    """The pictures of the scene whose values a drawing keeps; None if it is not seen, or in other colors."""
    if plain_views is None or is_recolored:
        return None
    from brushgs.cameras.around import MOST_OF_PATH

    return Motif.of(plain_views, lighting.key, min(len(cameras), MOST_OF_PATH) if is_path else 1)


@anew
def materials(
    background: Background,
    strokes: Gaussians,
    texture: "BrushSet",
    options: "RenderOptions",
    painted_with: PaintConfig,
    colored_ground: "Surface | None",
    lines: "Lines | None",
    line_brushes: "BrushSet | None",
    contour: Contour | None,
    cameras: Sequence[Camera],
    sight: Sight | None,
    site: "Site | None",
    motif: Motif | None,
    along_path: bool,
) -> Materials:
    """The materials of the medium."""
    behind, config = shown_ground(colored_ground, background), painted_with
    return Materials(
        strokes,
        texture,
        options,
        config.media,
        config.color,
        behind,
        lines,
        line_brushes,
        contour,
        cameras,
        sight,
        None if site is None else site.towards,
        motif=motif,
        is_film=along_path,
        foot=None if site is None else site.place.above,
    )


@anew
@unless(lambda lighting: None if lighting.has_day else "the light stands still")
def suns(lighting: LightConfig, stance: FirstView | None) -> F64 | None:
    """[K, 3] toward the lamp during a day, world axes; None if the first view is not known."""
    return suns_of(lighting, stance)


def _no_backdrop(
    ground_config: GroundConfig, painted_config: WhereConfig | None, projection_config: ProjectionConfig
) -> str | None:
    if projection_config.is_spherical:
        return "a picture all around has no border and no wall"
    if not ground_config.stage and ground_config.backdrop == 0:
        return "no stage and no backdrop"
    is_part = painted_config is not None and not ground_config.backdrop_always
    return "what is not painted is as the scene has it" if is_part else None


@anew
@makes("backdrop", "standing", "of_backdrop")
@unless(_no_backdrop, (), "materials", None)
def staged(
    materials: Materials,
    painted_with: PaintConfig,
    pruned: Gaussians,
    is_placed: bool,
    stance: FirstView | None,
    site: "Site | None",
    suns: F64 | None,
    cameras: Sequence[Camera],
    plain_views: "PlainViews | None",
    kit: "BrushKit",
    changes: StrokeChanges,
    styles: Styles | None,
    report: Report,
) -> tuple[list[Coat], Materials, F32 | None]:
    """The coat of the backdrop, and the strokes on it; see `open_backdrop`."""
    seen_as = stance if is_placed else None  # known only for the light
    setting = Setting(pruned, seen_as, site, suns, cameras, plain_views, kit, changes.colors, styles)
    return open_backdrop(painted_with, setting, materials, report)


@anew
@makes("softened", "edges")
@unless(lambda strokes_config: None if strokes_config.edges else "--edges 0", "standing", None)
def edged(
    standing: Materials,
    backdrop: Sequence[Coat],
    painted_with: PaintConfig,
    cameras: Sequence[Camera],
    is_path: bool,
    plain_views: "PlainViews | None",
    pruned: Gaussians,
    focus: F64 | None,
    site: "Site | None",
    mapped: Sequence[Property],
    report: Report,
) -> "tuple[Materials, Edges | None]":
    """The strokes with lost and found edges, and the role of each in them."""
    near = cameras if plain_views is None or is_path else plain_views.cameras[:NEAR_VIEWS]
    ground = None if site is None else site.ground
    focus_of = None if focus is None else lambda strokes: focus[nearest_rows(pruned, strokes)]
    losing = reader_of(mapped, "edge", pruned)
    around = painted_with, near, backdrop, standing, report
    return with_edges(*around, focus=focus_of, ground=ground, losing=losing)


@anew
@makes("graded_backdrop", "graded", "values")
def graded_strokes(
    softened: Materials,
    backdrop: Sequence[Coat],
    painted_with: PaintConfig,
    cameras: Sequence[Camera],
    palette: "Palette | None",
    styles: Styles | None,
    plain_views: "PlainViews | None",
    report: Report,
) -> "tuple[list[Coat], Materials, Values | None]":
    """The strokes and the backdrop in graded colors, with thickness by lightness."""
    has_own = "the palette" if palette is not None else None if styles is None else "the style"
    laid, found, values = with_values(
        painted_with, cameras, backdrop, softened, report, has_own=has_own, views=plain_views
    )
    return *in_own_lights(laid, found), values


@anew
@makes("surface", "ground_changes")
def graded_ground(
    colored_ground: "Surface | None", changes: StrokeChanges, values: "Values | None"
) -> "tuple[Surface | None, list[Change]]":
    """The ground in graded colors, and its color changes in order."""
    done: list[Change] = [changes.colors.ground] if changes.colors.are_any else []
    if values is None:
        return colored_ground, done
    grade = values.without_warmth.picture
    return recolored_ground(colored_ground, grade), [*done, grade]


@anew
@unless(lambda lays_accents: None if lays_accents else "economy lays none", ())
def accents(
    continued: Materials,
    painted_with: PaintConfig,
    plain_views: "PlainViews",
    pruned: Gaussians,
    focus: F64 | None,
    lens: "Lens | None",
    made: Gaussians,
    report: Report,
    memory: Memory,
) -> list[Coat]:
    """The coat of accents, if any."""
    return with_accents(
        painted_with, plain_views, pruned, focus, lens, made, continued, report=report, memory=memory
    )


@anew
def coats(
    continued: Materials,
    graded_backdrop: list[Coat],
    shown_plain: Gaussians | None,
    strokes: Gaussians,
    accents: Sequence[Coat],
    mapped: Sequence[Property],
    pruned: Later[Gaussians],
    overpaint: Overpainted | None,
    is_moving: bool,
    motion: StrokeMotion | None,
    threads: int | None,
    report: Report,
    memory: Memory,
) -> list[Coat]:
    """The coats of the painting, the first laid first."""
    drawn = coats_of(replace(continued, is_bare=not graded_backdrop))
    behind, (first, *others) = cleared(continued, graded_backdrop, drawn)
    unpainted: list[Coat] = []
    if shown_plain is not None and first.effect is not None:  # which changes only what is painted
        nothing = first.strokes.take(np.zeros(0, np.intp))
        unpainted = [replace(first, name="unpainted", strokes=nothing, effect=None).showing(shown_plain)]
        first = replace(first, tolerance=continued.media.behind)
    elif shown_plain is not None:
        first = first.showing(shown_plain)
    laid = with_holds([*behind, *unpainted, first, *others, *accents], mapped, pruned)
    laid = with_fields(laid, report, memory)
    if is_moving:
        laid = attached(laid, strokes, resting=(BACKDROP,))
    return laid if overpaint is None else overpainted(laid, strokes, overpaint, threads, report, motion)


@anew
def lamp(light_config: LightConfig, site: "Site | None") -> "Lamp | None":
    """The lamp on paint and canvas; None if pictures stay flat."""
    return open_lamp(light_config, site)


def region_names(regions: Regions | None) -> tuple[str, ...]:
    """Names of the parts with their own rules, from label 1 on."""
    return () if regions is None else tuple(regions.names)


@anew
def painting(
    coats: list[Coat],
    surface: "Surface | None",
    lamp: "Lamp | None",
    background: Background,
    painted_with: PaintConfig,
    along_path: bool,
    region_names: tuple[str, ...],
    suns: F64 | None,
    key: Key | None,
    made: Gaussians,
    of_backdrop: F32 | None,
    rig: Rig | None,
) -> Painting:
    """The painting of a still, or of all frames of a film."""
    return Painting(
        tuple(coats),
        surface,
        lamp,
        is_transparent=background is None and painted_with.ground.ground == "none",
        is_moving=along_path,
        region_names=region_names,
        day=None if suns is None else day_of(suns, key, made, coats, of_backdrop),
        part=None if painted_with.output.crop is None else Part(*painted_with.output.crop),
        dpi=painted_with.view.dpi,
        rig=rig,
    )


@anew
@unless(lambda is_moving: None if is_moving else "the scene does not move")
def moving(clip: Clip, film: Film, motion: StrokeMotion, media_config: Medium) -> Moving:
    """The motion of the strokes."""
    return Moving.of(clip.scene, film, motion, takes_light=not media_config.has_own_color)


@anew
def growth(
    painting: Painting,
    graded: Materials,
    grouping: "Grouping | None",
    maker: StrokeMaker,
    changes: StrokeChanges,
    values: "Values | None",
    cameras: Sequence[Camera],
    report: Report,
) -> "GrowingPainting":
    """The growth of the painting."""
    from brushgs.pipeline.growth.grow import grow

    finish = changes.finish if values is None else changes.finish.then("values", values.strokes)
    return grow(painting, graded.strokes, grouping, maker, finish, cameras, report)
