"""The one preparation of every command: from a scene and options to the strokes, the views and how to draw.

    stroke (-> style, palette) -> load -> clean (-> first view) -> camera or path (-> crumbs) (-> regions,
        background, ground, plain) -> plain views (-> seen, lines) (-> slabs) -> prune (-> focus, count)
        -> cluster -> solid -> direction -> repaint (-> recolor) (-> colour) -> broken colour (-> style
        colours, adjust) (-> brushes) (-> key) (-> backdrop) (-> edges) (-> values) -> coats (-> accents)

Cameras are framed on the cleaned scene, so that paintings of one scene with different counts line up.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from brushgs.arrays import Array
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.options.sequence import GrowConfig, PathConfig, SequenceConfig
from brushgs.options.where import WhereConfig
from brushgs.painting.backdrop import Setting, needs_place, open_backdrop
from brushgs.painting.background import Background, check_background
from brushgs.painting.clean import clean_scene, drop_crumbs, select_seen
from brushgs.painting.clip import Clip
from brushgs.painting.coats.materials import BACKDROP, Materials
from brushgs.painting.coats.media import coats_of
from brushgs.painting.count import open_view_model
from brushgs.painting.drawing import open_picture_background, render_options
from brushgs.painting.finishing import NEAR_VIEWS, in_own_lights, with_accents, with_edges, with_values
from brushgs.painting.guidance import Guidance, open_guidance
from brushgs.painting.lamp import Key, check_sun, day_of, open_lamp, open_site, suns_of
from brushgs.painting.look import (
    open_lines,
    open_relief,
    open_surface,
    recolored_ground,
    shown_ground,
)
from brushgs.painting.make_strokes import (
    ALREADY_STROKES,
    StrokeMaker,
)
from brushgs.painting.memory import Memory, NoMemory
from brushgs.painting.moving import (
    Moving,
    attached,
    features_of,
    follow_strokes,
    load_clip,
    seen_at,
    with_rows,
)
from brushgs.painting.named import Named, open_named
from brushgs.painting.plan import plan_cameras
from brushgs.painting.report import Report
from brushgs.painting.stroke_changes import changes_of
from brushgs.painting.strokes import cluster_scene, cut_scene, load_scene, prune_scene
from brushgs.painting.where import Rest, part, split_where, with_ids
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.scene import Camera, FirstView, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.cameras.paths import CameraPath
    from brushgs.io.scenes.notes import LoadNotes
    from brushgs.passes.edges import Edges
    from brushgs.passes.recolor import Palette
    from brushgs.rendering.growing import GrowingPainting
    from brushgs.rendering.options import RenderOptions


@dataclass(frozen=True, eq=False)
class Prepared:
    """Everything that pictures are painted from.

    Attributes:
        strokes: the strokes in space.
        texture: the stroke images, or a kernel.
        kit: which strokes each of several images suits; its names are rows of the strokes' brushes.
        options: how strokes become a frame, of a still or along a path.
        cameras: the views, one per frame; empty if no view is needed.
        path: the path that the cameras belong to; None for a still.
        background: what lies behind the strokes; None for transparent, and if none is needed.
        palette: the colours that the strokes took; None if they kept their own.
        notes: what the scene file holds beside its Gaussians; None for Gaussians in memory.
        first_view: how the scene is seen; None if neither a view nor an output needs it.
        painting: the coats that strokes are laid in, on what, and in which light.
        scene: the Gaussians as loaded, without floaters; None unless they are kept.
        maker: makes other numbers of strokes; None unless the caller clusters.
        growth: how the painting comes into being; None unless the caller shows it.
        moving: how the strokes move; None for a still scene.
        rest: what no strokes were made of, since it lies outside of the part of the scene that was asked for;
            None where strokes are of all.
        region_names: of the parts that are painted otherwise, from label 1 on.
        plain: Gaussians that are shown as they are among the strokes; None where all is painted.
        edges: what the strokes are to lost and found edges; None where there are none.
        ground_changes: what was done to the colours of the ground, in this order.
    """

    strokes: Gaussians
    texture: "BrushSet"
    kit: "BrushKit"
    options: "RenderOptions"
    cameras: Sequence[Camera]
    path: "CameraPath | None"
    background: Background
    palette: "Palette | None"
    notes: "LoadNotes | None"
    first_view: FirstView | None
    painting: Painting
    scene: Gaussians | None
    maker: StrokeMaker | None = None
    growth: "GrowingPainting | None" = None
    moving: "Moving | None" = None
    rest: Rest | None = None
    region_names: Sequence[str] = ()
    plain: Gaussians | None = None
    edges: "Edges | None" = None
    ground_changes: Sequence[Callable[[Array], Array]] = ()

    @property
    def camera(self) -> Camera:
        """The first view, of a still the only one."""
        return self.cameras[0]

    @property
    def known_view(self) -> FirstView:
        """How the scene is seen, which `prepare` finds with `needs_first_view`."""
        assert self.first_view is not None, "prepare with needs_first_view=True"
        return self.first_view

    @property
    def whole_scene(self) -> Gaussians:
        """The Gaussians as loaded, without floaters, which `prepare` keeps with `keeps_scene`."""
        assert self.scene is not None, "prepare with keeps_scene=True"
        return self.scene

    @property
    def stroke_maker(self) -> StrokeMaker:
        """What makes strokes of the pruned scene, which `prepare` keeps with `merges_later`."""
        assert self.maker is not None, "prepare with merges_later=True"
        return self.maker


def prepare(
    source: SceneFiles | Gaussians | Clip,
    config: PaintConfig,
    report: Report,
    *,
    views: Camera | PathConfig | GrowConfig | None = None,
    check_path: Callable[["CameraPath"], None] | None = None,
    needs_view: bool = True,
    needs_background: bool = True,
    needs_first_view: bool = False,
    keeps_scene: bool = False,
    merges_later: bool = False,
    grows: bool = False,
    memory: Memory | None = None,
    where: WhereConfig | None = None,
    workers: SequenceConfig | None = None,
) -> Prepared:
    """Make strokes of a scene, and everything else that is needed before the first picture.

    Peak memory: a scene is freed as soon as the next one is made of it, unless the caller holds it.

    Args:
        source: the files of a scene; Gaussians in memory, which count as a scene and not as strokes; or a
            moving scene, of which a film is painted: then `Prepared.cameras` are one per frame of it, and
            `keeps_scene` keeps the Gaussians that strokes were made of.
        config: see `PaintConfig`.
        report: gets one stage per step.
        views: one camera, or a path; None for the one camera that `config.view` describes, and a painting
            that grows is seen by it too.
        check_path: refuses a path before the long work, by raising.
        needs_view: False chooses a view, and opens the background, only where the number of strokes is
            chosen for one.
        needs_background: False opens the background only where the number of strokes is chosen for a view.
        needs_first_view: whether the first view is found also where the cameras do not depend on it.
        keeps_scene: whether the Gaussians as loaded are kept beside the strokes.
        merges_later: whether the caller will make strokes by `Prepared.stroke_maker`: then a scene is pruned
            also where `config` asks for every Gaussian, and `Prepared.strokes` is the pruned scene.
        grows: whether the caller will show how the painting comes into being, without a `GrowConfig`.
        memory: of earlier calls for the same source: steps whose inputs are as they were are not made again,
            and have no stage. None makes all of them.
        where: the part of the scene that strokes are made of; `Prepared.rest` is all else. None for all.
        workers: that read a scene larger than memory; None for this machine.

    Raises:
        SceneError: if a file cannot be read.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    memory = memory or NoMemory()
    recall = memory.of
    clip = source if isinstance(source, Clip) else None
    along_path = clip is not None or isinstance(views, PathConfig)
    check_sun(config.light, is_film=isinstance(views, PathConfig), is_moving=clip is not None)
    if needs_background or config.cluster.target is not None:
        check_background(config.draw.background)
    named = open_named(config, report, recall)
    rows = None  # of a moving scene: how they move
    if clip is not None:
        clip = with_rows(clip, report)
        gaussians, notes, rows = load_clip(clip, report)
    else:
        gaussians, notes = recall("load", (source,), lambda: _load(source, report, workers))
        if gaussians.brushes is not None:  # chosen anew where they are those of other brushes
            of_file = gaussians, source, config.brushes, config.view.fixed_size, named.has_more
            gaussians, stored = recall(
                "brushes", of_file, partial(_stored_brushes, gaussians, notes, source, config, named, report)
            )
            named = named.painted_with(stored)
    texture, kit, regions = named.texture, named.kit, named.regions
    options = render_options(config.draw, texture, along_path=along_path, relief=open_relief(config.light))
    is_strokes = notes is not None and notes.is_strokes
    loaded = gaussians = gaussians if where is None else with_ids(gaussians)
    gaussians = recall(
        "clean",
        (gaussians, config.clean),
        lambda: clean_scene(gaussians, config.clean, report, is_strokes=is_strokes),
    )
    cluster = config.cluster.of_film if along_path else config.cluster
    if is_strokes and cluster.keeps_strokes:
        cluster = replace(cluster, strokes=None)
    is_counted, is_for_view = cluster.target is not None, cluster.strokes_for == "view" and not is_strokes
    if clip is not None and not clip.scene.has_rows:
        is_for_view = False  # what the first moment does not show, another may
    passes, skip = config.strokes, ALREADY_STROKES if is_strokes else None
    if len(gaussians) == 0:
        skip = "there are no Gaussians"
    sees = passes.needs_camera or named.needs_camera
    needs_view = needs_view or is_counted or is_for_view or (sees and skip is None)
    needs_background = needs_background or is_counted
    needs_stage = needs_view and needs_background and not merges_later
    needs_first_view = (
        needs_first_view
        or named.needs_first_view
        or (config.painted is not None and config.painted.needs_first_view)
        or (needs_stage and needs_place(config, gaussians, views if isinstance(views, Camera) else None))
    )
    plan = plan_cameras(
        gaussians,
        notes,
        config,
        views,
        clip,
        report,
        memory,
        check_path=check_path,
        needs_view=needs_view,
        needs_first_view=needs_first_view or (needs_stage and config.light.is_in_scene),
    )
    cameras, film, first_view = plan.cameras, plan.film, plan.first_view
    config = replace(config, view=plan.view)
    if clip is None:  # of one that moves the rows are those of all moments
        gaussians = recall(
            "crumbs",
            (gaussians, first_view, config.clean),
            partial(drop_crumbs, gaussians, first_view, config.clean, report, is_strokes=is_strokes),
        )
    whole, plain = gaussians, None
    if config.painted is not None:
        parted = partial(part, gaussians, config.painted, first_view, report, num_threads=config.draw.threads)
        gaussians, plain = recall("where", (gaussians, config.painted, first_view), parted)
    if regions is not None:
        place = partial(regions.place, gaussians, first_view, report, num_threads=config.draw.threads)
        gaussians = recall("regions", (gaussians, regions, first_view), place)
    background, surface, view_model = None, None, None
    if cameras and needs_background:
        background = open_picture_background(config.draw, cameras[0], report)
    if cameras and not merges_later:
        laid_on = config.ground, config.light.canvas, config.light.canvas_strength, config.draw.background
        surface = recall(
            "ground",
            (whole, *laid_on, cameras[0]),
            partial(open_surface, config, whole, cameras[0], report),
        )
    rest = None
    if where is not None:
        gaussians, rest = split_where(loaded, gaussians, where, first_view, report, clip)
    del loaded
    if is_counted:
        # Strokes are counted for a still with the default lock and order, whatever is painted of them.
        still = render_options(replace(config.draw, lock=None, order=None), texture, along_path=False)
        behind = background if surface is None or background is None else surface.rgb
        view_model = open_view_model(gaussians, cameras[0], texture, still, behind, report)

    num_loaded, scene = len(gaussians), whole if keeps_scene else None
    if notes is not None:  # of a scene that was merged while it was read
        num_loaded = round(num_loaded * notes.rows_each)
    del whole
    guidance = Guidance()
    if skip is None:
        seen_by = passes.see, passes.focus, passes.direction
        has_lines, threads = config.media.draws_lines, config.draw.threads
        guidance = recall(
            "guidance",
            (
                gaussians,
                tuple(cameras),
                *seen_by,
                named.styles if passes.direction.kind == "style" else None,
                config.view,
                has_lines,
                threads,
                notes,
                first_view,
            ),
            lambda: open_guidance(
                gaussians,
                cameras,
                config,
                named.styles,
                notes,
                report,
                first_view=first_view,
                is_path=plan.is_path,
                is_framed=plan.is_framed,
                with_ring=not is_for_view,
            ),
        )
    gaussians = recall("finest", (gaussians, guidance.views), partial(guidance.with_finest, gaussians))
    lines, line_brushes = None, None
    if cameras and skip is None and not merges_later:
        lines, line_brushes = recall(
            "lines",
            (gaussians, guidance.views, tuple(cameras), config.media.draws_lines, config.media.line_width),
            lambda: open_lines(config, gaussians, guidance.views, cameras, report),
        )
    if is_for_view:
        at = None if clip is None or film is None else seen_at(clip, film, gaussians)
        gaussians = recall(
            "seen",
            (gaussians, tuple(cameras)),
            lambda: select_seen(gaussians, cameras if film is None else plan.shown, report, at=at),
        )
    is_economical = passes.economy > 0 and skip is None
    may_cut = cluster.strokes is not None and (clip is None or rows is not None)  # else each is a stroke
    if is_economical and cameras and may_cut:
        gaussians = recall(
            "slabs", (gaussians, tuple(cameras)), partial(cut_scene, gaussians, cameras, report)
        )
    gaussians = recall(
        "prune",
        (gaussians, config.prune, cluster, is_for_view),
        lambda: prune_scene(
            gaussians,
            config.prune,
            report,
            is_strokes=is_strokes,
            is_seen=is_for_view,
            is_merged=notes is not None and notes.rows_each > 1,
            cluster=None if merges_later else cluster,
        ),
    )
    focus = recall(
        "focus",
        (gaussians, guidance, passes.focus, skip),
        lambda: (
            None if skip else guidance.focus(gaussians, passes.focus, report, num_threads=config.draw.threads)
        ),
    )
    if regions is not None:
        focus = recall("shares", (gaussians, focus, regions), partial(regions.shares, gaussians, focus))
    site = None
    if not merges_later:
        of_site = config.ground.stage, config.light.key, config.light.lamp, config.light.sun
        site = recall(
            "site",
            (gaussians, first_view, tuple(cameras[:1]), *of_site),
            partial(open_site, config, gaussians, first_view, cameras[0] if cameras else None),
        )
    seen_from = cameras if guidance.views is None else guidance.views.cameras
    key = recall(
        "key",
        (config.light.key, site, tuple(seen_from), first_view),
        partial(Key.of, config.light, site, seen_from, first_view),
    )
    changes = changes_of(
        config,
        named,
        gaussians,
        guidance,
        first_view,
        key,
        skip=skip,
        keeps_brushes=is_strokes and gaussians.brushes is not None,
        memory=memory,
    )
    finish = changes.finish
    is_still = clip is None and not merges_later and guidance.views is not None
    lays_accents = is_economical and is_still and config.media.kind == "paint"
    maker = StrokeMaker(
        gaussians,
        cluster,
        guidance.views,
        focus,
        is_solid=passes.solid and skip is None,
        economy=0.0 if skip else passes.economy,
        cameras=cameras if is_economical else (),
        has_accents=lays_accents,
        passes=list(changes.making),
        memory=memory,
        motion=None if clip is None else features_of(rows, gaussians),
    )
    lamp = open_lamp(config.light, site)
    everything = partial(
        Prepared,
        texture=texture,
        kit=kit,
        options=options,
        cameras=plan.shown,
        path=plan.frames,
        background=background,
        notes=notes,
        first_view=first_view,
        scene=scene,
        rest=rest,
        region_names=() if regions is None else regions.names,
    )
    if merges_later:
        return everything(strokes=gaussians, palette=None, painting=Painting((), surface, lamp), maker=maker)
    strokes, grouping = cluster_scene(maker, report, num_loaded=num_loaded, view_model=view_model)
    made = strokes
    strokes = finish(strokes, report)
    ground_changes: list[Callable[[Array], Array]] = []
    if changes.colors.are_any:
        ground_changes.append(changes.colors.ground)
        surface = recolored_ground(surface, changes.colors.ground)
    motion = None
    if clip is not None and film is not None:
        strokes, plain, motion = follow_strokes(
            clip,
            film,
            strokes,
            grouping,
            maker.gaussians,
            changes.later(),
            report,
            found=rows,
            plain=plain,
            asked=cluster.asked_count,
        )
    materials = Materials(
        strokes,
        texture,
        options,
        config.media,
        config.color,
        shown_ground(surface, background),
        lines,
        line_brushes,
    )
    backdrop: list[Coat] = []
    suns, of_backdrop = suns_of(config.light, first_view), None
    if plain is None or config.ground.backdrop_always:  # what is not painted is as the scene has it
        seen_as = first_view if needs_first_view or plan.is_framed else None  # known for the light alone
        setting = Setting(
            gaussians, seen_as, site, suns, cameras, guidance.views, kit, changes.colors, named.styles
        )
        backdrop, materials, of_backdrop = open_backdrop(config, setting, materials, report)
    materials, edges = with_edges(
        config,
        cameras if guidance.views is None or plan.is_path else guidance.views.cameras[:NEAR_VIEWS],
        backdrop,
        materials,
        report,
        gaussians=gaussians,
        focus=focus,
        ground=None if site is None else site.ground,
    )
    has_own = "the palette" if named.palette is not None else None if named.styles is None else "the style"
    backdrop, materials, values = with_values(
        config, cameras, backdrop, materials, report, has_own=has_own, views=guidance.views
    )
    backdrop, materials = in_own_lights(backdrop, materials)
    if values is not None:
        ground_changes.append(values.without_warmth.picture)
        surface = recolored_ground(surface, values.without_warmth.picture)
        finish = finish.then("values", values.strokes)
    first, *others = coats_of(materials)
    coats = [*backdrop, first if plain is None else first.showing(plain), *others]
    if lays_accents and guidance.views is not None:
        coats += with_accents(config, guidance.views, gaussians, focus, made, materials, report)
    moving = None
    if clip is not None and film is not None and motion is not None:
        coats = attached(coats, strokes, resting=(BACKDROP,))
        moving = Moving.of(clip.scene, film, motion, takes_light=not config.media.has_own_color)
    painting = Painting(
        tuple(coats),
        surface,
        lamp,
        is_transparent=background is None and config.ground.ground == "none",
        is_moving=along_path,
        region_names=() if regions is None else tuple(regions.names),
        day=None if suns is None else day_of(suns, key, made, coats, of_backdrop),
    )
    growth = None
    if grows or isinstance(views, GrowConfig):
        from brushgs.painting.growth.grow import grow

        growth = grow(painting, materials.strokes, grouping, maker, finish, cameras[0], report)
    return everything(
        strokes=strokes,
        options=materials.options,
        palette=named.palette,
        edges=edges,
        ground_changes=ground_changes,
        painting=painting,
        growth=growth,
        moving=moving,
        plain=plain,
    )


def _load(
    source: SceneFiles | Gaussians | Clip, report: Report, workers: SequenceConfig | None
) -> "tuple[Gaussians, LoadNotes | None]":
    assert not isinstance(source, Clip), "those of a clip are rows of it"
    if isinstance(source, Gaussians):
        return source, None
    return load_scene(source, report, makes_strokes=True, workers=workers)


def _stored_brushes(
    gaussians: Gaussians,
    notes: "LoadNotes | None",
    source: SceneFiles | Gaussians | Clip,
    config: PaintConfig,
    named: Named,
    report: Report,
) -> "tuple[Gaussians, tuple[BrushSet, BrushKit] | None]":
    """Strokes with the brushes that their file names, and these; or without, where others are asked for."""
    from brushgs.painting.stored_brushes import open_stored_brushes

    stored = None
    if not named.has_more and not isinstance(source, Gaussians | Clip):
        stored = open_stored_brushes(gaussians, notes, source, config, report)
    return (gaussians if stored else replace(gaussians, brushes=None)), stored
