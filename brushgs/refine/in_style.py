"""Lay the strokes of a scene as marks of a style, with its brushes: one stage of a report.

    strokes (-> at the middle moment) -> marks, see `lay` (-> at their own moments) -> broken color -> brushes

The brushes are images in the style file, which is written beside the strokes and named in them, so that
painting the stroke file uses them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.kit import BrushKit
from brushgs.brushes.texture import StrokeTexture
from brushgs.cameras.first_view import framed_camera
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.choices import STYLE_SUFFIX
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.passes.color.broken_color import MOST, break_colors
from brushgs.passes.reduce.equal_rows import chances
from brushgs.pipeline.drawing import render_options
from brushgs.pipeline.prepare import Prepared
from brushgs.pipeline.report import Report
from brushgs.refine.lay import Seen, lay_marks
from brushgs.refine.views import views_around
from brushgs.rendering.motion import SHIFT, SIZE, TURN, Pose, match
from brushgs.values.arrays import Mask
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quat_products, rotation_matrices
from brushgs.values.style import StyleMarks

FIRST_SIZE = 480, 270  # pixels: the shape of the picture that `render` paints
AROUND, AROUND_SIZE = 12, (192, 144)  # views, and their pixels
BROKEN = 0.7  # share of the painting's color variation: later steps add to it
_BRUSH_DRAW = 9  # random stream for the choice of brushes


@dataclass(frozen=True, eq=False)
class Laid:
    """A prepared painting, and which of its N strokes or marks may change: a mask [N]."""

    prepared: Prepared
    moves: Mask


def style_beside(output: Path) -> Path:
    """The style file that belongs to an output, a scene file or a folder."""
    name = output.stem if output.suffix.lower() in SCENE_SUFFIXES else output.name
    return output.with_name(f"{name}{STYLE_SUFFIX}")


def brush_names(output: Path, number: int) -> tuple[str, ...]:
    """Names of the brushes in the style beside an output, relative to its folder."""
    path = style_beside(output)
    is_file = output.suffix.lower() in SCENE_SUFFIXES
    found = path.name if is_file else f"../{path.name}"
    return tuple(f"{found}:{row}" for row in range(1, number + 1))


def lay_in_style(
    painted: Laid,
    marks: StyleMarks,
    shown_at: Callable[[int | None], Gaussians],
    paint: PaintConfig,
    keeps: tuple[str, ...],
    output: Path,
    report: Report,
    *,
    most: int | None = None,
) -> Laid:
    """Lay the strokes that may change as the marks of a style; its brushes are appended.

    Args:
        painted: the painting in strokes.
        marks: of the style.
        shown_at: the scene in the colors of the style, at a moment of a clip or None.
        paint: options of the painting.
        keeps: options set by the user: "stroke", "direction" or "broken_color".
        output: file for the marks.
        report: collects the stage.
        most: maximum number of marks; None for that of `lay_marks`.
    """
    prepared, moves = painted.prepared, painted.moves
    strokes, moving, view = prepared.strokes, prepared.moving, prepared.known_view
    with report.stage("marks") as stage:
        moment = pose = None
        if moving is not None:
            moment = len(moving.motion.times) // 2
            pose = moving.motion.pose(moment)
        scene = shown_at(moment)
        first = framed_camera(view, ViewConfig(size=FIRST_SIZE))
        width, height = AROUND_SIZE
        cameras = [first, *views_around(view, AROUND, width=width, height=height)]
        views = [Seen.of(scene, camera) for camera in cameras]
        images = [] if "stroke" in keeps else _brush_images(marks, output)
        used = BrushSet(tuple(images)) if images else prepared.texture
        options = render_options(paint.draw, used, along_path=moving is not None)
        sigmas = float(np.mean(options.num_sigmas))
        inside = strokes.take(moves)
        now = inside if pose is None else pose.moved(inside, has_color=False)
        laid, parents = lay_marks(now, marks, views, sigmas, turns="direction" not in keeps, most=most)
        own = inside.take(parents)
        if pose is not None:
            laid = replace(at_reference(laid, pose), opacities=own.opacities)
        if "broken_color" not in keeps:
            laid = break_colors(
                laid,
                *(min(BROKEN * spread, MOST) for spread in (marks.broken_lightness, marks.broken_chroma)),
            )
        kit, texture = prepared.kit, prepared.texture
        rows = np.zeros(len(strokes), np.uint8) if strokes.brushes is None else strokes.brushes
        chosen = rows[moves][parents]
        if images:
            kit, texture, offset = _with_images(prepared, used, output, is_alone=bool(moves.all()))
            draws = chances(laid.means, paint.cluster.seed, _BRUSH_DRAW)
            chosen = (offset + np.minimum((draws * len(images)).astype(np.intp), len(images) - 1)).astype(
                np.uint8
            )
        laid = replace(laid, brushes=chosen)
        outside = replace(strokes, brushes=rows).take(~moves)
        # Other rows come first, so that they do not depend on the number of marks.
        joined = Gaussians.joined([outside, laid]) if len(outside) else laid
        marked = np.concatenate([np.zeros(len(outside), bool), np.ones(len(laid), bool)])
        options = render_options(paint.draw, texture, along_path=moving is not None)
        stage.did = (
            f"{int(moves.sum()):,} strokes became {len(laid):,} marks, {marks.aspect:.1f} times as long as "
            f"wide, of {len(images) or 'their own'} brush{'es' if len(images) != 1 else ''}"
        )
        stage.counts = {"before": len(strokes), "after": len(joined), "brushes": len(images)}
    return Laid(replace(prepared, strokes=joined, kit=kit, texture=texture, options=options), marked)


def _brush_images(marks: StyleMarks, output: Path) -> list[StrokeTexture]:
    name = style_beside(output).stem
    return [
        StrokeTexture.from_coverage(image, name=f"{name}_{row}") for row, image in enumerate(marks.brushes, 1)
    ]


def _with_images(
    prepared: Prepared, images: BrushSet, output: Path, *, is_alone: bool
) -> tuple[BrushKit, BrushSet, int]:
    """The kit and brushes with those of a style, replacing or following its own, and their first row."""
    names = brush_names(output, len(images))
    if is_alone:  # no stroke keeps its brush
        return BrushKit(other=names), images, 0
    brushes = BrushSet((*prepared.texture.textures, *images.textures))
    return replace(prepared.kit, styled=names), brushes, len(prepared.kit.images)


def at_reference(strokes: Gaussians, pose: Pose) -> Gaussians:
    """Move strokes from the moment of a pose to their reference moments; colors and opacities stay."""
    rows, found = match(strokes, pose.ids)
    if len(rows) == 0:
        return strokes
    numbers, pivots = pose.numbers[found].astype(np.float64), pose.pivots[found]
    columns = {name: column.copy() for name, column in strokes.columns().items()}
    size = np.exp(numbers[:, SIZE])[:, None]
    away = (strokes.means[rows] - pivots - numbers[:, SHIFT]) / size
    columns["means"][rows] = pivots + np.einsum("nji,nj->ni", rotation_matrices(numbers[:, TURN]), away)
    back = numbers[:, TURN] * (1, -1, -1, -1)
    columns["quats"][rows] = quat_products(back, strokes.quats[rows])
    columns["scales"][rows] /= size
    return replace(strokes, **columns)
