"""Finishing of a whole picture: lost and found edges, values, and accents.

All are decided once per job, on small pictures in a few of its views, before paint and canvas are lit, so
they are the same in every frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from brushgs.options.painting import PaintConfig
from brushgs.pipeline.media.materials import ACCENTS, BACKDROP, Materials
from brushgs.pipeline.media.media import coats_of
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.stroke_pass import nearest_regions, nearest_rows
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.plain import PlainViews
from brushgs.values.arrays import F64, Array
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors, in_colors, shift_base_colors

if TYPE_CHECKING:
    from brushgs.passes.add.stage_ground import Ground
    from brushgs.passes.color.values import Values
    from brushgs.passes.form.defocus import Lens
    from brushgs.passes.form.edges import Edges

SIDE = 480  # pixels, longer side of the pictures; in smaller ones leaves widen and their darks count more
TOLD = 5  # stride in pixels of the samples for the report
MOST_VIEWS = 3  # of a path
NEAR_VIEWS = 4  # of the guide views: the view of a still and those near it
STANDING_OUT = 3.0  # factor on the worth of an accent in the focus


class Seen(NamedTuple):
    """Small unlit pictures of a painting in a few views of its job.

    Attributes:
        pictures: [H, W, 3] of each view, opaque.
        coverages: [H, W] of each, coverage by the strokes of the scene.
    """

    pictures: list[Array]
    coverages: list[Array]


def seen_small(cameras: Sequence[Camera], backdrop: Sequence[Coat], materials: Materials) -> Seen:
    """Paint small pictures of a painting.

    Args:
        cameras: of the job, at least one; of many, an evenly spread sample.
        backdrop: the coat of the backdrop, or none.
        materials: of the strokes.
    """
    from brushgs.passes.seen import some_small

    subject, behind, seen = Painting.alone(coats_of(materials)), Painting.alone(backdrop), Seen([], [])
    for camera in some_small(cameras, MOST_VIEWS, SIDE):
        picture = np.asarray(materials.paper, np.float32)
        frame = subject.frame(camera)
        for one in (behind.frame(camera), frame):
            picture = one.rgb + (1 - one.alpha[..., None]) * picture
        seen.pictures.append(picture)
        seen.coverages.append(frame.alpha)
    return seen


def with_values(
    config: PaintConfig,
    cameras: Sequence[Camera],
    backdrop: Sequence[Coat],
    materials: Materials,
    report: Report,
    *,
    has_own: str | None,
    views: PlainViews | None = None,
) -> "tuple[list[Coat], Materials, Values | None]":
    """The backdrop and the strokes in graded colors, and the grading or None.

    Args:
        config: the options.
        cameras: of the job.
        backdrop: the coat of the backdrop, or none.
        materials: of the strokes.
        report: gets the stage, only if values are requested.
        has_own: what has its own values, such as "the palette"; or None.
        views: plain pictures of the scene, the first in the view of the job; or None.
    """
    strength = config.color.values
    if strength == 0 or not cameras or len(materials.strokes) == 0:
        return list(backdrop), materials, None
    with report.stage("values") as stage:
        if config.media.kind != "paint":
            has_own = config.media.kind
        if has_own is not None:
            stage.did = "nothing"
            stage.skipped.append(f"values: {has_own} has its own")
            return list(backdrop), materials, None
        from brushgs.passes.color.values import fit_values

        seen = seen_small(cameras, backdrop, materials)
        before = () if views is None else views.frames[:1]
        values = fit_values(seen.pictures, seen.coverages, strength=strength, before=before)
        values = values.without_warmth if config.color.gray else values
        _describe(stage, values, seen)
    laid = [replace(coat, strokes=values.strokes(coat.strokes)) for coat in backdrop]
    return laid, replace(materials, strokes=values.strokes(materials.strokes)), values


def with_edges(
    config: PaintConfig,
    cameras: Sequence[Camera],
    backdrop: Sequence[Coat],
    materials: Materials,
    report: Report,
    *,
    focus: Callable[[Gaussians], F64] | None,
    ground: "Ground | None",
    losing: Callable[[Gaussians], F64] | None = None,
) -> "tuple[Materials, Edges | None]":
    """The strokes with lost and found edges, and the role of each stroke in them; or None.

    Args:
        config: the options.
        cameras: of the job, or a few small ones.
        backdrop: the coat of the backdrop, or none.
        materials: of the strokes.
        report: gets the stage, only if edges are requested.
        focus: factors of k strokes, [k]; or None.
        ground: the scene's own ground, which has no outline to lose; or None.
        losing: how far strokes may be lost, [k] 0 to 1; None for 1.
    """
    strength, strokes = config.strokes.edges, materials.strokes
    if strength == 0 or not cameras or len(strokes) == 0:
        return materials, None
    with report.stage("edges") as stage:
        reason = None if backdrop else "the scene fills its pictures"
        if config.media.kind != "paint":
            reason = f"{config.media.kind} has its own"
        if reason is not None:
            stage.did = "nothing"
            stage.skipped.append(f"edges: {reason}")
            return materials, None
        from brushgs.passes.form.edges import Around, find_edges, soften_edges

        around = Around(backdrop[0].strokes, materials.paper)
        subject = None if ground is None else ~ground.is_on(ground.place.local(strokes.means))
        of_strokes = None if focus is None else focus(strokes)
        edges = find_edges(strokes, cameras, around, focus=of_strokes, subject=subject)
        if edges is not None and losing is not None:
            edges = replace(edges, lost=edges.lost * losing(strokes))
        softened = soften_edges(strokes, edges, strength)
        num = 0 if edges is None else int(np.count_nonzero(edges.lost > 0.5 * edges.near.max()))
        stage.did = f"{num:,} of {len(strokes):,} strokes lie at lost edges"
        stage.counts = {"strokes": len(strokes), "lost": num, "strength": strength}
    return replace(materials, strokes=softened), edges


def with_accents(
    config: PaintConfig,
    views: "PlainViews",
    gaussians: Gaussians,
    focus: F64 | None,
    lens: "Lens | None",
    made: Gaussians,
    materials: Materials,
    report: Report,
    memory: Memory,
) -> list[Coat]:
    """The coat of accents, pure lights and darks that are laid last; none if nothing is missing.

    Args:
        config: the options.
        views: plain pictures of the scene, the first in the view of the job.
        gaussians: the scene, pruned.
        focus: [N] factors of its Gaussians; or None.
        lens: what is sharp, where the others get fewer accents; None for all.
        made: the strokes as made, in the light of the scene, which lack the accents.
        materials: of the strokes as painted.
        report: gets the stage.
        memory: of the accents as the scene has them.
    """
    from brushgs.passes.add.accents import accents, num_accents

    count = num_accents(len(made), config.strokes.economy)
    if count == 0:
        return []
    with report.stage("accents") as stage:
        from brushgs.passes.color.repaint import repaint

        near = PlainViews(views.cameras[:NEAR_VIEWS], views.frames[:NEAR_VIEWS])
        if config.color.grades or config.color.pigments:  # what grading removed is not missing
            made = repaint(made, gaussians, near)
        weights = (
            None if focus is None else 1 + STANDING_OUT * (focus - 1) / max(float(focus.max()) - 1, 1e-9)
        )
        if lens is not None:
            sharp = lens.growth(gaussians.means, config.strokes.depth_of_field) ** -2
            weights = sharp if weights is None else weights * sharp
        made = replace(made, brushes=None)
        depends = made, gaussians, views, count, focus, lens, config.strokes.depth_of_field
        found = memory.of(
            "missing accents", depends, lambda: accents(made, gaussians, near, count=count, focus=weights)
        )
        stage.did = f"{len(found):,} of pure light and dark"
        stage.counts = {"strokes": len(found)}
        if len(found) == 0:
            return []
        # Lit and graded like the stroke below each, and with its brush.
        rows = nearest_rows(made, found)
        shifts = base_colors(materials.strokes.sh) - base_colors(made.sh)
        found = shift_base_colors(found, shifts[rows])
        if config.color.gray:
            from brushgs.passes.color.adjust import Gray

            found = in_colors(found, Gray().colors(base_colors(found.sh)))
        if materials.strokes.brushes is not None:
            found = replace(found, brushes=materials.strokes.brushes[rows])
        return [materials.marks(ACCENTS, nearest_regions(materials.strokes, found), dry=0.0)]


def with_fields(coats: list[Coat], report: Report, memory: Memory) -> list[Coat]:
    """Coats with the fields of directions of their strokes, where the lock is "canonical".

    Lines always lie along their axes, and a backdrop along its walls, where a field follows the axes of 97 %
    of the strokes: they keep "anchor". A memory keeps the fields.
    """

    def keeps_axes(coat: Coat) -> bool:
        return coat.chains is not None or coat.nested is not None or coat.name == BACKDROP

    coats = [
        replace(coat, options=replace(coat.options, lock="anchor"))
        if coat.options.lock == "canonical" and keeps_axes(coat)
        else coat
        for coat in coats
    ]
    fitted = {
        id(coat.strokes): coat for coat in coats if coat.options.lock == "canonical" and len(coat.strokes)
    }
    if not fitted:
        return coats
    with report.stage("fields") as stage:
        from brushgs.rendering.canonical import fit_canonical

        fields = {}
        for key, coat in fitted.items():
            strokes, threads = coat.strokes, coat.options.num_threads
            shapes = replace(strokes, sh=np.zeros_like(strokes.sh[:, :1]), brushes=None, regions=None)
            fields[key] = memory.of(
                f"fields of {coat.name}", (shapes,), partial(fit_canonical, shapes, num_threads=threads)
            )
        num = sum(len(coat.strokes) for coat in fitted.values())
        stage.did = f"fields of directions of {num:,} strokes"
        stage.counts = {"strokes": num}
    return [
        replace(coat, fields=fields.get(id(coat.strokes))) if coat.options.lock == "canonical" else coat
        for coat in coats
    ]


def in_own_lights(backdrop: Sequence[Coat], materials: Materials) -> tuple[list[Coat], Materials]:
    """The backdrop and the strokes with thickness by lightness, see `Relief.by_light`.

    The range of lightness is that of the strokes of the scene, for all coats.
    """

    def lit(options: RenderOptions) -> RenderOptions:
        relief = options.relief
        return options if relief is None else replace(options, relief=relief.in_lights_of(materials.strokes))

    laid = [replace(coat, options=lit(coat.options)) for coat in backdrop]
    return laid, replace(materials, options=lit(materials.options))


def _describe(stage: Stage, values: "Values", seen: Seen) -> None:
    """Report the effect of the grading on the first view."""
    from brushgs.passes.color.squint import Squint

    picture, coverage = (one[::TOLD, ::TOLD] for one in (seen.pictures[0], seen.coverages[0]))
    before, after = Squint.of(picture, coverage), Squint.of(values.picture(picture), coverage)
    three = after.three_values._asdict()
    stage.did = f"a range of values of {after.range:.0f} of 100, from {before.range:.0f}"
    stage.counts = {"range_before": round(before.range, 1), "range": round(after.range, 1)}
    stage.counts |= {name: None if value is None else round(value, 1) for name, value in three.items()}
    stage.counts["warmth"] = round(values.warmth, 2)
