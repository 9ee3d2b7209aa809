"""Steps that make strokes: guide views, selection of Gaussians, and clusters."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from brushgs.options.focus import Focus
from brushgs.options.look_parts import GroundConfig, LightConfig
from brushgs.options.maps import Map
from brushgs.options.media import Medium
from brushgs.options.overpaint import Balls, OverpaintConfig
from brushgs.options.painting import ClusterConfig, PruneConfig, StrokesConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from brushgs.options.rules import Rules
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.clean import select_seen
from brushgs.pipeline.clip import Clip, Film
from brushgs.pipeline.focus import open_lens, place_focus
from brushgs.pipeline.job_views import draw_job_views
from brushgs.pipeline.lamp import Key, towards_lamp
from brushgs.pipeline.look import open_lines
from brushgs.pipeline.make_strokes import StrokeMaker
from brushgs.pipeline.maps import Mapped, Property, density_of, of_rules, place_maps
from brushgs.pipeline.moving import features_of, seen_at
from brushgs.pipeline.overpaint import Overpainted, balls_of, painted_factors
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Later, Memory, anew, costly, makes, unless
from brushgs.pipeline.steps.opening import Views
from brushgs.pipeline.stroke_changes import StrokeChanges
from brushgs.pipeline.stroke_pass import ALREADY_STROKES
from brushgs.pipeline.strokes import cluster_scene, cut_scene, least_kept, prune_scene
from brushgs.pipeline.styling import Contour, Styles, contour_of
from brushgs.pipeline.views import choose_first_view
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.passes.add.stage import Site
    from brushgs.passes.form.defocus import Lens
    from brushgs.passes.motion.canonical import Canonical
    from brushgs.passes.reduce.cluster import Grouping
    from brushgs.rendering.plain import PlainViews
    from brushgs.stroke_count.view_model import ViewModel
    from brushgs.values.arrays import F64
    from brushgs.values.lines import Lines
    from brushgs.values.notes import LoadNotes


def is_empty(cleaned: Gaussians) -> bool:
    """Whether there are no Gaussians."""
    return len(cleaned) == 0


def skip(is_empty: bool, is_strokes: bool) -> str | None:
    """Why no pass changes strokes; None if passes run."""
    if is_empty:
        return "there are no Gaussians"
    return ALREADY_STROKES if is_strokes else None


def is_for_view(clustering: ClusterConfig, is_strokes: bool, is_moving: bool, clip: Later[Clip]) -> bool:
    """Whether strokes are made only of visible Gaussians; not if later moments may show others."""
    if clustering.strokes_for != "view" or is_strokes:
        return False
    return not is_moving or clip().scene.has_rows


def num_loaded(subject: Gaussians, notes: "LoadNotes | None") -> int:
    """The number of Gaussians in the files, before any merging while reading."""
    return len(subject) if notes is None else round(len(subject) * notes.rows_each)


def _no_guide(skip: str | None, sees: bool, focused_on: Focus | None, maps: tuple[Map, ...]) -> str | None:
    return skip or (None if sees or maps or focused_on is not None else "strokes are made by the scene alone")


@unless(_no_guide)
def guide(
    stance: FirstView | None, subject: Gaussians, standing_config: ViewConfig, notes: "LoadNotes | None"
) -> FirstView:
    """The first view while strokes are made.

    If nothing else depends on it there is no stage, and no warning of doubt.
    """
    return stance or choose_first_view(subject, standing_config, notes, Report())


@makes("has_lines", "has_paint")
def of_media(media_config: Medium, contour: Contour | None) -> tuple[bool, bool]:
    """Whether the medium draws lines, or a style has contours in it, and whether it is opaque paint."""
    return media_config.draws_lines or contour is not None, media_config.kind == "paint"


def _no_contour(media_config: Medium, styles: "Styles | None") -> str | None:
    return None if styles is not None and media_config.kind == "paint" else "no style of opaque paint"


@unless(_no_contour)
def contour(styles: Styles) -> Contour | None:
    """The contours of styles; None if they have none."""
    return contour_of(styles)


def is_path(views: Views, projection_config: ProjectionConfig) -> bool:
    """Whether strokes are made for several cameras: the camera moves, or shows a sphere."""
    return isinstance(views, PathConfig) or projection_config.is_spherical


@costly
@unless(lambda skip, sees: skip or (None if sees else "--see off"))
def plain_views(
    subject: Gaussians,
    cameras: Sequence[Camera],
    view: ViewConfig,
    guide: FirstView,
    is_path: bool,
    is_framed: bool,
    is_for_view: bool,
    has_lines: bool,
    threads: int | None,
    report: Report,
) -> "PlainViews":
    """Small plain pictures that guide strokes."""
    return draw_job_views(
        subject,
        cameras,
        view,
        report,
        first_view=guide,
        is_path=is_path,
        is_framed=is_framed,
        with_ring=not is_for_view,
        depth=has_lines,
        num_threads=threads,
    )


@costly
@unless(lambda skip, sees: skip or (None if sees else "--see off"), "subject")
def finest(subject: Gaussians, plain_views: "PlainViews") -> Gaussians:
    """The Gaussians with the finest line width that the views resolve."""
    from brushgs.passes.finest import finest_of

    return replace(subject, finest=finest_of(subject, plain_views.cameras))


@costly
@makes("lines", "line_brushes")
@unless(lambda skip, has_lines: skip or (None if has_lines else "the medium draws no lines"))
def drawn_lines(
    finest: Gaussians,
    media_config: Medium,
    contour: Contour | None,
    plain_views: "PlainViews | None",
    cameras: Sequence[Camera],
    threads: int | None,
    report: Report,
) -> "tuple[Lines, BrushSet] | tuple[None, None]":
    """The lines of a drawing, or the contours of a painting, and their brushes."""
    width = contour.width if contour is not None else media_config.line_width  # type: ignore[attr-defined]
    return open_lines(width, finest, plain_views, cameras, threads, report)


@costly
@unless(lambda is_for_view: None if is_for_view else "strokes are for the whole scene", "finest")
def seen(
    finest: Gaussians,
    clip: Clip | None,
    film: Later[Film],
    shown: Later[Sequence[Camera]],
    cameras: Later[Sequence[Camera]],
    report: Report,
) -> Gaussians:
    """The Gaussians that the views show."""
    if clip is None:
        return select_seen(finest, cameras(), report)
    return select_seen(finest, shown(), report, at=seen_at(clip, film(), finest))


def is_economical(economy: float, skip: str | None) -> bool:
    """Whether few large strokes cover flat areas, and accents the rest."""
    return economy > 0 and skip is None


def lays_accents(is_economical: bool, is_moving: bool, sees: bool, has_paint: bool) -> bool:
    """Whether pure lights and darks are laid last."""
    return is_economical and not is_moving and sees and has_paint


def _no_slabs(is_economical: bool, clustering: ClusterConfig) -> str | None:
    if not is_economical:
        return "--economy 0"
    return "each Gaussian is to be a stroke" if clustering.strokes is None else None


@costly
@unless(_no_slabs, "seen")
def cut(
    seen: Gaussians, cameras: Sequence[Camera], clip: Clip | None, rows: "Canonical | None", report: Report
) -> Gaussians:
    """Gaussians cut so that none covers much of a picture; a clip needs corresponding rows."""
    return seen if clip is not None and rows is None else cut_scene(seen, cameras, report)


@makes("at_least", "why_all")
def pruning(
    cut: Gaussians,
    prune_config: PruneConfig,
    clustering: ClusterConfig,
    is_strokes: bool,
    is_for_view: bool,
    notes: "LoadNotes | None",
) -> tuple[int, str | None]:
    """The least number of Gaussians to keep, and why all are kept; most numbers of strokes change neither."""
    is_merged = notes is not None and notes.rows_each > 1
    kinds = {"is_strokes": is_strokes, "is_seen": is_for_view, "is_merged": is_merged}
    return least_kept(len(cut), prune_config, clustering, **kinds)


@costly
def pruned(
    cut: Gaussians, prune_config: PruneConfig, at_least: int, why_all: str | None, report: Report
) -> Gaussians:
    """The Gaussians that strokes are made of."""
    return prune_scene(cut, prune_config, report, at_least=at_least, why_all=why_all)


@unless(lambda maps, skip: skip or (None if maps else "no --map"), ())
def by_maps(
    pruned: Gaussians,
    maps: tuple[Map, ...],
    source: SceneFiles | Gaussians | Clip,
    guide: FirstView | None,
    cameras: Later[Sequence[Camera]],
    threads: int | None,
    report: Report,
) -> Sequence[Mapped]:
    """[N] factors of the properties that maps change."""
    return place_maps(pruned, maps, source, cameras, guide, report, num_threads=threads)


def mapped(by_maps: Sequence[Mapped], rules_config: Rules | None) -> Sequence[Property]:
    """All properties that differ by place, but for density by focus and by hand."""
    return [*by_maps, *of_rules(rules_config)]


def balls(overpaint_config: OverpaintConfig, overpaint: Overpainted | None) -> Balls:
    """Where more or fewer strokes were painted for."""
    return overpaint_config.balls + (() if overpaint is None else balls_of(overpaint.joined))


def _no_focus(
    focused_on: Focus | None,
    skip: str | None,
    rules_config: Rules | None,
    maps: tuple[Map, ...],
    balls: Balls,
) -> str | None:
    if rules_config is not None:
        return None  # parts may need more strokes
    if (maps or balls) and skip is None:
        return None  # of density
    return skip or ("--focus off" if focused_on is None else None)


@costly
@unless(_no_focus)
def focus(
    pruned: Gaussians,
    focused_on: Focus | None,
    skip: str | None,
    guide: FirstView | None,
    cameras: Later[Sequence[Camera]],
    mapped: Sequence[Property],
    balls: Balls,
    threads: int | None,
    report: Report,
) -> "F64 | None":
    """[N] factors on the strokes per area; None for 1."""
    found: list[Property] = []
    if skip is None and focused_on is not None:
        camera = None if focused_on.mask is None else cameras()[0]
        factors = place_focus(pruned, focused_on, camera, guide, report, num_threads=threads)
        found += [] if factors is None else [Mapped("density", factors)]
    if balls and skip is None:
        found.append(Mapped("density", painted_factors(pruned, balls)))
    return density_of([*found, *mapped], pruned)


def _no_lens(strokes_config: StrokesConfig, skip: str | None) -> str | None:
    return skip or (None if strokes_config.depth_of_field else "--depth-of-field 0")


@unless(_no_lens)
def lens(
    pruned: Gaussians,
    focus: "F64 | None",
    guide: FirstView | None,
    cameras: Sequence[Camera],
    threads: int | None,
    report: Report,
) -> "Lens":
    """What is in focus in some views of the job."""
    return open_lens(pruned, focus, guide, cameras, report, num_threads=threads)


@unless(lambda lens: "--depth-of-field 0" if lens is None else None, "focus")
def density(focus: "F64 | None", lens: "Lens", pruned: Gaussians, strokes_config: StrokesConfig) -> "F64":
    """[N] factors on the strokes per area, with fewer strokes out of focus."""
    fewer = 1 / lens.growth(pruned.means, strokes_config.depth_of_field)
    return fewer if focus is None else focus * fewer


@makes("lighting", "has_stage")
def of_light(light_config: LightConfig, ground_config: GroundConfig) -> tuple[LightConfig, bool]:
    """The options of the lamp without those of paint and canvas; and whether it lights a stage."""
    light = light_config
    return LightConfig(lamp=light.lamp, key=light.key, sun=light.sun), ground_config.stage


def _no_site(lighting: LightConfig, has_stage: bool) -> str | None:
    return None if has_stage or lighting.is_in_scene else "neither a stage nor the light of a lamp is painted"


@unless(_no_site)
def site(
    lighting: LightConfig, pruned: Gaussians, stance: FirstView | None, cameras: Sequence[Camera]
) -> "Site | None":
    """Where the scene stands and how it is lit; None if not known."""
    if stance is None or len(pruned) == 0:
        return None
    from brushgs.passes.add.stage import find_site

    return find_site(pruned, stance, towards_lamp(lighting, stance, cameras[0].viewmat[:3, :3]))


@unless(lambda lighting: "--key 0" if lighting.key == 0 else None)
def key(
    lighting: LightConfig,
    site: "Site | None",
    plain_views: "PlainViews | None",
    stance: FirstView | None,
    cameras: Sequence[Camera],
) -> Key | None:
    """The light of a lamp on the strokes; None if the first view is not known."""
    seen_from = cameras if plain_views is None else plain_views.cameras
    return Key.of(lighting, site, seen_from, stance)


@anew
def maker(
    pruned: Gaussians,
    clustering: ClusterConfig,
    plain_views: "PlainViews | None",
    density: "F64 | None",
    is_solid: bool,
    economy: float,
    is_economical: bool,
    lays_accents: bool,
    skip: str | None,
    changes: StrokeChanges,
    clip: Clip | None,
    rows: "Canonical | None",
    cameras: Later[Sequence[Camera]],
    memory: Memory,
) -> StrokeMaker:
    """The maker of strokes of the scene, for any number."""
    return StrokeMaker(
        pruned,
        clustering,
        plain_views,
        density,
        is_solid=is_solid and skip is None,
        economy=economy if skip is None else 0.0,
        cameras=cameras() if is_economical else (),
        has_accents=lays_accents,
        passes=list(changes.making),
        memory=memory,
        motion=None if clip is None else features_of(rows, pruned),
    )


@anew
@makes("made", "grouping")
def clustered(
    view_model: "ViewModel | None", maker: StrokeMaker, num_loaded: int, report: Report
) -> "tuple[Gaussians, Grouping | None]":
    """The strokes as made, and the grouping of the Gaussians."""
    return cluster_scene(maker, report, num_loaded=num_loaded, view_model=view_model)


@anew
def finished(made: Gaussians, changes: StrokeChanges, report: Report) -> Gaussians:
    """The strokes after all passes."""
    return changes.finish(made, report)
