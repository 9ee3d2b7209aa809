"""The stages that turn strokes into a picture: stroke image, background, project, rasterise and write."""

import warnings
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.painting import DrawConfig
from brushgs.painting.background import Background, open_background
from brushgs.painting.report import Report, Stage
from brushgs.painting.strokes import zero_degrees
from brushgs.scene import Boxes, Camera, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brushes, BrushSet
    from brushgs.rendering.options import RenderOptions

NOTHING_SEEN = "no stroke is in the picture; check that the camera and the scene belong together"
BLANK = 0.01  # mean alpha of a picture below which one sees next to nothing
FAINT = 0.1  # mean opacity, weighed by area; nine trained scenes have 0.28 to 0.99, each row counted once
CULLED = {  # field of ProjectCounts -> words
    "behind_near": "at or behind the near plane of the camera",
    "outside": "outside the picture",
    "faint": "with an opacity under 1/255",
    "not_finite": "too large for the arithmetic",
}


def open_stroke(config: DrawConfig, report: Report) -> "BrushSet":
    """Open the stroke image or kernel, or several stroke images."""
    with report.stage("stroke") as stage:
        from brushgs.brushes.brush_set import BrushSet

        brush_set = BrushSet.open(config.stroke)
        height, width = brush_set.textures[0].coverage.shape
        size = f"{width} x {height} texels" if brush_set.kind == "image" else "a kernel, no image"
        stage.did = f"{brush_set.name}: {size}"
        stage.counts = {"name": brush_set.name, "kind": brush_set.kind, "width": width, "height": height}
        if len(brush_set) > 1:
            stage.did = f"{brush_set.name}: {len(brush_set)} brushes"
            stage.counts["brushes"] = list(brush_set.names)
    return brush_set


def render_options(draw: DrawConfig, texture: "Brushes", *, along_path: bool) -> "RenderOptions":
    """Resolve the options for one picture, or for all frames along a path.

    Fields that `DrawConfig` and `RenderOptions` share are handed on by name, so that a new one needs no line
    here.

    Raises:
        ValueError: if the lock is "track" and there is no path.
    """
    from brushgs.rendering.options import RenderOptions

    shared = {field.name for field in fields(RenderOptions)} & {field.name for field in fields(draw)}
    resolved = {
        "lock": draw.lock_of(along_path=along_path),
        "order": draw.order_of(along_path=along_path),
        "num_sigmas": None if draw.extent == "fitted" else texture.num_sigmas,
        "num_threads": draw.threads,
    }
    return RenderOptions.of(texture, **{name: getattr(draw, name) for name in shared} | resolved)


def open_picture_background(config: DrawConfig, camera: Camera, report: Report) -> Background:
    """Open the background of a picture; a stage only where an image is read."""
    if not Path(config.background).is_file():
        return open_background(config.background, camera.width, camera.height)
    with report.stage("background") as stage:
        background = open_background(config.background, camera.width, camera.height)
        stage.did = f"{config.background}, scaled to fill the picture"
        stage.counts = {"path": config.background}
    return background


def project_scene(
    strokes: Gaussians,
    camera: Camera,
    texture: "Brushes",
    options: "RenderOptions",
    report: Report,
    *,
    advice: str = "",
) -> Boxes:
    """Project the strokes to boxes on the picture, nearest first.

    Args:
        strokes: strokes in space.
        camera: the view.
        texture: the stroke.
        options: how strokes become a frame.
        report: gets the stage.
        advice: what the report adds where most strokes lie outside the picture.
    """
    with report.stage("project") as stage:
        from brushgs.rendering.options import project_with
        from brushgs.sh import used_sh_degree

        boxes, culled = project_with(strokes, camera, options)
        stage.did = f"{len(boxes):,} of {len(strokes):,} strokes in the picture"
        stage.counts = {
            "before": len(strokes),
            "after": len(boxes),
            "sigmas": np.round(options.num_sigmas, 4).tolist(),
            "lock": options.lock,
            "order": options.order,
        }
        for reason, words in CULLED.items():
            count = getattr(culled, reason)
            stage.counts[reason] = count
            if count:
                stage.skipped.append(f"{count:,} strokes {words}")
        if advice and culled.outside > 0.5 * len(strokes):
            stage.did += f"; {advice}"
        if not texture.is_directed:
            stage.details.append("no lock, fading or soft order: a kernel fills the ellipse itself")
        if len(boxes) == 0:
            warnings.warn(SceneWarning(NOTHING_SEEN), stacklevel=2)
        degree = used_sh_degree(strokes)
        stage.counts["sh_degree"] = degree
        if degree < strokes.sh_degree:
            stage.details.append(zero_degrees(degree, strokes.sh_degree))
    return boxes


def rasterize_boxes(
    boxes: Boxes, camera: Camera, texture: "Brushes", options: "RenderOptions", report: Report
) -> Frame:
    """Draw the boxes."""
    with report.stage("rasterise") as stage:
        from brushgs.rendering.options import rasterize_with

        frame = rasterize_with(boxes, camera, texture, options)
        painted = float(np.mean(frame.alpha, dtype=np.float64))
        stage.did = f"{len(boxes):,} strokes cover {painted:.1%} of the picture"
        stage.counts = {"strokes": len(boxes), "painted": round(painted, 6), "filter": options.filter}
        if len(boxes) and painted < BLANK:
            warnings.warn(SceneWarning(_why_blank(boxes, camera, painted)), stacklevel=2)
        _describe_levels(boxes, texture, options.filter, stage)
        if not options.depth:
            stage.details.append("no depth: this file format does not hold it")
    return frame


def _why_blank(boxes: Boxes, camera: Camera, painted: float) -> str:
    """Why so little of a picture is painted, and what to do about it."""
    from brushgs.rendering.areas import seen_areas

    areas = seen_areas(boxes, camera.width, camera.height)
    opacity = float((areas @ boxes.opacities) / max(areas.sum(), 1e-300))
    fact = f"the picture is nearly blank: strokes cover {painted:.2%} of it"
    if opacity > FAINT:
        return f"{fact}, since few or small ones lie in view; take a larger --zoom or another view"
    return (
        f"{fact}, since they are faint: their mean opacity is {opacity:.2g}; run `brushgs doctor` on the "
        "scene, its file may encode opacities in another way"
    )


def _describe_levels(boxes: Boxes, texture: "Brushes", filter: str, stage: Stage) -> None:
    """Report how many mip levels of the stroke image were not made, because no stroke samples them."""
    if texture.kind != "image":
        stage.details.append("no texture filter: a kernel is computed, not sampled")
        return
    if filter != "mip" or len(boxes) == 0:
        return
    from brushgs.brushes.brush_set import BrushSet
    from brushgs.rendering.texture_levels import count_levels

    used, total = count_levels(boxes, BrushSet.of(texture))
    stage.counts |= {"mip_levels": total, "mip_levels_used": used}
    if used < total:
        stage.details.append(f"{total - used} of {total} mip levels skipped: no stroke samples them")


def write_picture(
    frame: Frame, path: Path, background: Background, config: DrawConfig, report: Report
) -> None:
    """Write the picture on its background."""
    with report.stage("write") as stage:
        from brushgs.io.pictures.images import write_frame

        write_frame(frame, path, background=background)
        stage.did = f"{path}, on {config.background}"
        stage.counts = {"path": str(path), "bytes": path.stat().st_size, "background": config.background}
