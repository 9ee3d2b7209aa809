"""The backdrop around the strokes of a scene, loose strokes or a stage: a coat that is laid first."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from brushgs.options.choices import StageTone
from brushgs.options.look_parts import GroundConfig
from brushgs.options.painting import PaintConfig
from brushgs.pipeline.color_changes import Changes
from brushgs.pipeline.media.materials import ACCENTS, BACKDROP, CUT_IN, Materials
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.stroke_changes import style_brush_passes
from brushgs.pipeline.styling import Styles, manner_of
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.colors import rgb_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.add.backdrop import Backdrop
    from brushgs.passes.add.stage import Site
    from brushgs.passes.add.stage import Stage as Scenery
    from brushgs.passes.add.stage_ground import Ground
    from brushgs.passes.add.stage_map import Manner
    from brushgs.passes.form.edges import Edges
    from brushgs.rendering.plain import PlainViews

LOOKED_AT = 160  # pixels, longer side of the picture that shows whether a scene fills it
LEAST_NEAR = 0.05  # nearness to an outline above which a stroke is at it
THIN = 0.4  # height of the paint along an outline, relative to the stage
MOST_CHROMA = 0.075  # of a stage in the hues of a style, OKLab: it stays behind its subject


@dataclass(frozen=True, eq=False)
class Setting:
    """Inputs of a backdrop besides the materials of a painting.

    Attributes:
        gaussians: the scene, pruned.
        first_view: of the scene; None if not needed.
        site: where it stands and how it is lit; None without a stage.
        suns: [K, 3] toward the lamp during a day, world axes; None for a fixed light.
        cameras: of the job.
        views: plain pictures of some of them; None without.
        kit: which strokes each brush suits.
        colors: color changes that the backdrop follows.
        styles: of the painting, or None.
    """

    gaussians: Gaussians
    first_view: FirstView | None
    site: "Site | None"
    suns: F64 | None
    cameras: Sequence[Camera]
    views: "PlainViews | None"
    kit: "BrushKit"
    colors: Changes
    styles: Styles | None


def needs_place(ground: GroundConfig, gaussians: Gaussians, camera: Camera) -> bool:
    """Whether a stage depends on how the scene stands: not if it fills the picture of a given camera.

    Args:
        ground: the options.
        gaussians: the scene.
        camera: the given camera.
    """
    if not ground.stage or ground.backdrop_always:
        return ground.stage
    from brushgs.passes.add.backdrop import FULL_BORDER, border_alpha
    from brushgs.rendering.plain import plain_views

    return border_alpha(plain_views(gaussians, [camera.in_side(LOOKED_AT)]).frames[0]) < FULL_BORDER


def open_backdrop(
    config: PaintConfig, setting: Setting, materials: Materials, report: Report
) -> tuple[list[Coat], Materials, F32 | None]:
    """The coat of the backdrop, if look and scene have one, and the materials on it.

    The third is what each sun of a day adds to the colors of that coat, RGB [K, n, 3], or None.
    """
    ground, first_view = config.ground, setting.first_view
    has_one = ground.stage or ground.backdrop > 0
    if not has_one or first_view is None or not setting.cameras or len(materials.strokes) == 0:
        return [], materials, None
    with report.stage("backdrop") as stage:
        from brushgs.passes.add.backdrop import is_land, reason_for_none, reason_of_border

        frames = [] if setting.views is None else setting.views.frames[:1]
        manner = _manner_in(config, setting)
        on_land = manner is not None and not ground.backdrop_always and is_land(first_view)
        reason = None if ground.backdrop_always else reason_for_none(first_view, frames)
        if on_land:
            reason = reason_of_border(frames)
        if reason is not None:
            stage.did, stage.counts = "nothing", {"strokes": 0}
            stage.skipped.append(f"backdrop: {reason}")
            return [], materials, None
        shifts = None
        if on_land and manner is not None:
            coat, materials = _around_land(config, setting, manner, first_view, materials)
            stage.did = f"{len(coat.strokes):,} strokes around the land, in the manner of its style"
        elif ground.stage:
            assert setting.site is not None, "it was found for the stage"
            coat, materials, shifts = _stage(config, setting, setting.site, materials, stage)
        else:
            coat = _loose(config, setting, first_view, materials)
            stage.did = f"{len(coat.strokes):,} strokes around the scene"
        stage.counts["strokes"] = len(coat.strokes)
    return [coat], materials, shifts


def _manner_in(config: PaintConfig, setting: Setting) -> "Manner | None":
    """How styles paint what surrounds the subject; None if they do not."""
    is_paint = config.media.kind == "paint" and config.ground.stage_colors is None
    return manner_of(setting.styles) if is_paint else None


def _around_land(
    config: PaintConfig, setting: Setting, manner: "Manner", first_view: FirstView, materials: Materials
) -> tuple[Coat, Materials]:
    """The surroundings of land seen from the air, and the land set off against them."""
    from brushgs.passes.add.around_land import around_land

    seed = config.cluster.seed
    strokes = around_land(manner, setting.gaussians, first_view, setting.cameras, seed=seed)
    strokes = _finished(strokes, setting=setting, has_colors=True, seed=seed)
    coat = Coat(BACKDROP, strokes, materials.texture, materials.options.for_marks(materials.texture))
    return _set_off(coat, materials, setting)


def _set_off(
    coat: Coat, materials: Materials, setting: Setting, ground: "Ground | None" = None
) -> tuple[Coat, Materials]:
    """Surroundings in the manner of paintings and their subject, told apart by lightness."""
    from brushgs.passes.add.set_off import set_off

    brushes = materials.texture, materials.options.as_still()
    scene, cameras = setting.gaussians, setting.cameras
    behind, strokes = set_off(coat.strokes, materials.strokes, scene, cameras, ground, brushes)
    return replace(coat, strokes=behind), replace(materials, strokes=strokes)


def _loose(config: PaintConfig, setting: Setting, first_view: FirstView, materials: Materials) -> Coat:
    from brushgs.passes.add.backdrop import backdrop

    ground, seed = config.ground, config.cluster.seed
    strokes = backdrop(setting.gaussians, first_view, setting.cameras, _backdrop_of(ground), seed=seed)
    texture = materials.texture
    if ground.backdrop_brushes:
        strokes, texture = _with_brushes(strokes, ground.backdrop_brushes, setting, materials, seed)
    options = materials.options.for_marks(texture)
    if setting.colors.are_any:
        strokes = setting.colors.backdrop(strokes)
    return Coat(BACKDROP, strokes, texture, options, dry=ground.backdrop_dry, border=ground.backdrop_border)


def _stage(
    config: PaintConfig, setting: Setting, site: "Site", materials: Materials, report: Stage
) -> tuple[Coat, Materials, F32 | None]:
    from brushgs.passes.add.stage import open_stage
    from brushgs.passes.add.stage_ground import dissolved
    from brushgs.passes.add.stage_paint import Brushwork, size_beside
    from brushgs.pipeline.media.media import stage_of
    from brushgs.pipeline.media.staging import Staging

    ground, strokes, seed = config.ground, materials.strokes, config.cluster.seed
    suns = [] if setting.suns is None else list(setting.suns[1:])
    tone, values = _tone_of(ground), config.color.values
    manner = _manner_in(config, setting)
    stage = open_stage(site, strokes, setting.cameras, tone, suns, values=values)
    size = size_beside(len(strokes)) * ground.stage_size
    brushwork = Brushwork(size, ground.stage_aspect, ground.stage_jitter, ground.shadow, manner)
    has_colors = ground.stage_colors is not None or manner is not None
    finished = partial(_finished, setting=setting, has_colors=has_colors, seed=seed)
    coat = stage_of(materials, Staging(stage, brushwork, setting.cameras, finished, seed))
    shifts = None
    if stage.others and config.media.kind == "paint":  # marks of a drawing would have to move
        others = (stage.at(shadow) for shadow in stage.others)
        laid = [
            stage_of(materials, Staging(one, brushwork, setting.cameras, finished, seed)) for one in others
        ]
        colors = [base_colors(one.strokes.sh) for one in (coat, *laid)]
        shifts = (np.stack(colors) - colors[0]).astype(np.float32)
    if manner is not None:
        coat, materials = _set_off(coat, materials, setting, stage.ground)
    coat = replace(coat, normals=stage.normals_of(coat.strokes), is_one_sided=True)
    _describe(report, stage, len(coat.strokes))
    if stage.ground is not None:
        table = stage.tones.table if config.media.kind == "paint" else None
        if manner is not None:
            table = stage.table_color(coat.strokes)
        materials = replace(materials, strokes=dissolved(materials.strokes, stage.ground, table))
    return coat, materials, shifts


def _finished(strokes: Gaussians, *, setting: Setting, has_colors: bool, seed: int) -> Gaussians:
    """Strokes of a stage in changed colors if they have none, and with the brushes of the subject."""
    from brushgs.passes.form.choose_brushes import choose_brushes

    if manner_of(setting.styles) is not None:
        strokes = setting.colors.adjusted(strokes)
    elif setting.colors.are_any and not has_colors:
        strokes = _recolored(strokes, setting.colors)
    if len(setting.kit.images) > 1:
        strokes = choose_brushes(strokes, setting.kit, seed=seed)
        for change in style_brush_passes(setting.styles, setting.kit, seed=seed, is_stage=True):
            strokes = change(strokes)
    return strokes


def with_cut_edges(painting: Painting, camera: Camera, edges: "Edges | None" = None) -> Painting:
    """A painting whose stage slightly overlaps the outline of its subject in one view.

    Only in opaque paint: drawn stages have no paint to cut in with. With `edges`, only along found edges.
    """
    backdrop, *coats = painting.coats
    is_cut = backdrop.name == BACKDROP and backdrop.is_one_sided and backdrop.texture.is_directed
    paint = [coat for coat in coats if coat.name != ACCENTS]
    if not is_cut or len(paint) != 1 or paint[0].plain is not None:
        return painting
    from brushgs.passes.add.cut_in import cut_in

    found = None if edges is None else np.clip(edges.found / np.maximum(edges.near, LEAST_NEAR), 0, 1)
    strokes = cut_in(paint[0].strokes, backdrop.strokes, camera, found=found).astype(np.float32)
    brushes = backdrop.strokes.brushes
    if brushes is not None and len(strokes):
        strokes = replace(strokes, brushes=np.resize(brushes, len(strokes)))
    options, relief = backdrop.options, backdrop.options.relief
    if relief is not None:  # or their ends would form a ring around the subject
        options = replace(options, relief=replace(relief, thickness=0.0, gain=THIN * relief.gain))
    coat = replace(backdrop, name=CUT_IN, strokes=strokes, options=options, normals=None)
    coat = replace(coat, is_one_sided=False)
    return replace(painting, coats=(backdrop, paint[0], coat, *coats[1:])) if len(strokes) else painting


def for_film(painting: Painting, config: PaintConfig, cameras: Sequence[Camera]) -> Painting:
    """A painting whose surroundings have one order in all views of a path, see `in_one_order`.

    Unchanged where layers need their depths, or the film must match pictures.
    """
    draw, output = config.draw, config.output
    if draw.order is not None or draw.lock == "canonical" or output.all_layers or output.deep:
        return painting
    return replace(painting, coats=tuple(in_one_order(coat, cameras) for coat in painting.coats))


def in_one_order(coat: Coat, cameras: Sequence[Camera]) -> Coat:
    """The coat; if it is that of the surroundings, its strokes have one order in all views.

    In soft order, with underpaint, they take 3.5 to 4 times as long.
    """
    is_plain = coat.blend == "cover" and coat.tolerance is None and not coat.needs_depth
    if coat.name != BACKDROP or not is_plain or coat.options.order != "soft":
        return coat
    from brushgs.rendering.fixed_order import mean_distances

    return replace(coat, distances=mean_distances(coat.strokes.means, cameras))


def _describe(report: Stage, scenery: "Scenery", count: int) -> None:
    report.did = f"a stage of {count:,} strokes"
    report.counts = {
        "reads": round(scenery.tones.reads, 3),
        "own_ground": scenery.ground is not None,
        "follows_light": scenery.follows_light,
        "table": [round(float(x), 3) for x in scenery.tones.table],
        "wall": [round(float(x), 3) for x in scenery.tones.wall],
    }
    report.details.append(f"{scenery.tones.reads:.0%} of the outline reads against it")
    if scenery.ground is not None:
        report.did += ", whose table continues the ground of the scene"
    if scenery.follows_light:
        report.did += ", lit as shadows on that show"


def _tone_of(ground: GroundConfig) -> "StageTone | tuple[np.ndarray, np.ndarray]":
    if ground.stage_colors is None:
        return ground.stage_tone  # type: ignore[return-value]  # checked by GroundConfig
    from brushgs.values.colors import oklab_of

    table, wall = oklab_of(np.array([rgb_of(code) for code in ground.stage_colors]))
    return table, wall


def _with_brushes(
    strokes: Gaussians, names: tuple[str, ...], setting: Setting, materials: Materials, seed: int
) -> "tuple[Gaussians, BrushSet]":
    """Strokes with brushes of their own."""
    from brushgs.brushes.brush_set import BrushSet, size_for
    from brushgs.brushes.kit import BrushKit
    from brushgs.passes.form.choose_brushes import choose_brushes

    camera = setting.cameras[0]
    # A single stroke has no row in its kit.
    known = dict(zip(setting.kit.images, BrushSet.of(materials.texture).textures, strict=False))
    kit = BrushKit(other=names)
    texture = kit.open(size=size_for(camera.width, camera.height), known=known)
    return choose_brushes(strokes, kit, seed=seed), texture


def _recolored(strokes: Gaussians, colors: Changes) -> Gaussians:
    """Strokes of a stage in the hues of changed colors: their lightness was chosen against these."""
    from brushgs.values.colors import oklab_of, rgb_of_oklab

    lightness = oklab_of(base_colors(strokes.sh).astype(np.float64))[:, 0]
    lab = oklab_of(base_colors(colors.backdrop(strokes).sh).astype(np.float64))
    lab[:, 0] = lightness
    chroma = np.linalg.norm(lab[:, 1:], axis=1, keepdims=True)
    lab[:, 1:] *= np.minimum(MOST_CHROMA / np.maximum(chroma, 1e-9), 1)
    return in_colors(strokes, np.clip(rgb_of_oklab(lab), 0, 1))


def _backdrop_of(ground: GroundConfig) -> "Backdrop":
    from brushgs.passes.add.backdrop import Backdrop, Tone

    tones = zip(
        ground.backdrop_lightness,
        ground.backdrop_complement,
        (ground.backdrop_above, ground.backdrop_below),
        strict=True,
    )
    above, below = (Tone(*tone) for tone in tones)
    lightness, chroma = ground.backdrop_jitter
    return Backdrop(
        strokes=ground.backdrop,
        above=above,
        below=below,
        aspect=ground.backdrop_aspect,
        size=ground.backdrop_size,
        lightness=lightness,
        chroma=chroma,
    )
