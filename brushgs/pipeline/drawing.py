"""The stages that turn strokes into a picture: stroke image, background, project, rasterise and write."""

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from functools import partial
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.choices import StrokeColor
from brushgs.options.look_parts import BrushesConfig
from brushgs.options.painting import DEFAULT_SIZE, DrawConfig, PaintConfig
from brushgs.pipeline.background import Background, open_background
from brushgs.pipeline.report import Report, Stage
from brushgs.pipeline.runner import Memory
from brushgs.pipeline.strokes import zero_degrees
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brushes, BrushSet, Sigmas
    from brushgs.brushes.kit import BrushKit
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.formats.pictures.oiio import Strips
    from brushgs.rendering.canvas import Canvas, Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.options import RenderOptions
    from brushgs.rendering.relief import Relief
    from brushgs.rendering.wanted import Wanted
    from brushgs.values.shot import Shot

NOTHING_SEEN = "no stroke is in the picture; check that the camera and the scene belong together"
CURE = "run `brushgs doctor` on the scene, its file may encode opacities in another way"
BLANK = 0.01  # mean alpha below which a picture is almost empty
FAINT = 0.1  # mean opacity weighted by area; nine trained scenes have 0.28 to 0.99, unweighted
CULLED = {  # field of ProjectCounts -> words
    "behind_near": "at or behind the near plane of the camera",
    "outside": "outside the picture",
    "faint": "with an opacity under 1/255",
    "not_finite": "too large for the arithmetic",
}


def open_brushes(
    named: BrushesConfig,
    stroke: str,
    size: tuple[int, int] | None,
    styled: Sequence[str],
    report: Report,
    *,
    by_material: bool,
    stroke_color: StrokeColor | None = None,
    memory: Memory,
) -> "tuple[BrushSet, BrushKit]":
    """Open the stroke images, or the kernel, and assign several images to kinds of strokes.

    Args:
        named: brushes by the strokes that they suit.
        stroke: the stroke if `named` is empty.
        size: (width, height) of the picture, pixels; None for the usual one.
        styled: names of the brushes of styles; a kernel cannot be mixed with them.
        report: gets the stage.
        by_material: whether smooth and rough surfaces have brushes of their own.
        stroke_color: whose color paint has.
        memory: of opened brushes.
    """
    with report.stage("stroke") as stage:
        from brushgs.brushes.brush_set import MOST_BRUSHES, BrushSet, paths_of, size_for
        from brushgs.brushes.kit import BrushKit

        colored = stroke_color in ("own", "mix")
        side = size_for(*(size or DEFAULT_SIZE))
        if named.names:
            kit = BrushKit(named.long, named.short, named.other, named.large)
            if by_material:
                kit = replace(kit, smooth=named.smooth, rough=named.rough)
        else:
            kit = BrushKit.of(stroke)
        if not named.names and len(paths_of(stroke)) == 1:
            texture = BrushSet.open(stroke, size=side, colored=colored)
        else:
            texture = kit.open(size=side, known=_built_in(kit, side, colored, memory), colored=colored)
        if styled and texture.kind == "image":
            from brushgs.brushes.of_style import fitting

            known = dict(zip(kit.images, texture.textures, strict=True))
            kit = replace(kit, styled=fitting(styled, MOST_BRUSHES - len(kit.images)))
            texture = kit.open(size=side, known=known, colored=colored)
        if stroke_color == "scene":
            texture = texture.without_colors()
        shapes = [image.coverage.shape for image in texture.textures]
        height, width = (max(sides) for sides in zip(*shapes, strict=True))
        stage.did = f"{texture.name}: {width} x {height} texels"
        if texture.kind != "image":
            stage.did = f"{texture.name}: a kernel, no image"
        elif len(texture) > 1:
            stage.did = f"{len(texture)} brushes, up to {width} x {height} texels"
        stage.counts = {"name": texture.name, "kind": texture.kind, "width": width, "height": height}
        if len(texture) > 1:
            stage.counts["brushes"] = list(texture.names)
    return texture, kit


def _built_in(kit: "BrushKit", side: int, colored: bool, memory: Memory) -> "dict[str, StrokeTexture] | None":
    """The images of a kit from a memory, if all are built-in ones, about which there is nothing to warn."""
    from brushgs.brushes.texture import StrokeTexture, variants_of

    if not all(map(variants_of, kit.images)):
        return None
    openings = {image: (image, side, colored) for image in kit.images}
    return {
        image: memory.of(f"brush {image}", of, partial(StrokeTexture.open, image, size=side, colored=colored))
        for image, of in openings.items()
    }


def render_options(
    draw: DrawConfig,
    texture: "Brushes",
    *,
    along_path: bool,
    is_spherical: bool = False,
    relief: "Relief | None" = None,
) -> "RenderOptions":
    """Resolve the options for one picture, or for all frames along a path.

    Fields that `DrawConfig` and `RenderOptions` share are passed on by name.

    Raises:
        ValueError: if the lock is "track" and there is no path.
    """
    from brushgs.rendering.options import RenderOptions

    shared = {field.name for field in fields(RenderOptions)} & set(DrawConfig.__struct_fields__)
    resolved = {
        "lock": draw.lock_of(along_path=along_path, is_spherical=is_spherical),
        "order": draw.order_of(along_path=along_path),
        "num_sigmas": None if draw.extent == "fitted" else texture.num_sigmas,
        "num_threads": draw.threads,
        "relief": relief,
    }
    return RenderOptions.of(texture, **{name: getattr(draw, name) for name in shared} | resolved)


def open_picture_background(config: DrawConfig, camera: Camera, report: Report) -> Background:
    """Open the background of a picture; a stage only if an image is read."""
    if not Path(config.background).is_file():
        return open_background(config.background, camera.width, camera.height)
    with report.stage("background") as stage:
        background = open_background(config.background, camera.width, camera.height)
        stage.did = f"{config.background}, scaled to fill the picture"
        stage.counts = {"path": config.background}
    return background


def project_coat(coat: "Coat", camera: Camera, report: Report, *, advice: str = "", among: int = 1) -> Boxes:
    """Project the strokes of a coat to boxes on the picture, nearest first.

    Args:
        coat: strokes in space with drawing options.
        camera: the view.
        report: gets the stage.
        advice: added to the report if most strokes lie outside the picture.
        among: number of coats of the painting; one of several is named.
    """
    strokes, options = coat.strokes, coat.options
    with report.stage(_stage_name("project", coat, among)) as stage:
        from brushgs.values.sh import used_sh_degree

        boxes, culled = coat.boxes(camera)
        num = len(strokes) + (0 if coat.plain is None else len(coat.plain))
        what = "strokes" if coat.plain is None else "strokes and Gaussians"
        stage.did = f"{len(boxes):,} of {num:,} {what} in the picture"
        stage.counts = {
            "before": num,
            "after": len(boxes),
            "sigmas": _rounded(options.num_sigmas),
            "lock": options.lock,
            "order": options.order,
        }
        for reason, words in CULLED.items():
            count = getattr(culled, reason)
            stage.counts[reason] = count
            if count:
                stage.skipped.append(f"{count:,} strokes {words}")
        if advice and culled.outside > 0.5 * num:
            stage.did += f"; {advice}"
        if not coat.texture.is_directed:
            stage.details.append("no lock, fading or soft order: a kernel fills the ellipse itself")
        degree = used_sh_degree(strokes)
        stage.counts["sh_degree"] = degree
        if degree < strokes.sh_degree:
            stage.details.append(zero_degrees(degree, strokes.sh_degree))
    return boxes


def lay_coat(canvas: "Canvas", coat: "Coat", boxes: Boxes, report: Report, *, among: int = 1) -> float:
    """Draw the boxes of a coat on the canvas, and return its mean alpha; `among` as for `project_coat`."""
    with report.stage(_stage_name("rasterise", coat, among)) as stage:
        frame = canvas.lay(coat, boxes)
        options = coat.options
        painted = float(np.mean(frame.alpha, dtype=np.float64))
        stage.did = f"{len(boxes):,} strokes cover {painted:.1%} of the picture"
        stage.counts = {"strokes": len(boxes), "painted": round(painted, 6), "filter": options.filter}
        _describe_levels(boxes, coat.texture, options.filter, stage)
        if not options.depth:
            stage.details.append("no depth: this file format does not hold it")
    return painted


def paint_with_rig(painting: "Painting", camera: Camera, report: Report, wanted: "Wanted") -> Frame:
    """Paint one picture with several cameras."""
    rig = painting.rig
    assert rig is not None, "the painting has one"
    with report.stage("paint") as stage:
        frame = painting.frame(camera, wanted=wanted)
        painted = float(np.mean(frame.alpha, dtype=np.float64))
        views = len(rig.eyes(camera)) * len(rig.guides(camera))
        width, height = rig.size_of(camera)
        stage.did = f"{views} views into {width}x{height}"
        stage.counts = {"views": views, "width": width, "height": height, "painted": round(painted, 6)}
    if painting.surface is None and painted < BLANK:
        warnings.warn(SceneWarning(NOTHING_SEEN), stacklevel=2)
    return frame


def warn_if_blank(coat: "Coat", boxes: Boxes, camera: Camera, painted: float) -> None:
    """Warn if the picture is almost empty, and say why.

    Args:
        coat: the coat with most paint.
        boxes: of the coat.
        camera: the view.
        painted: mean alpha of the coat.
    """
    if len(boxes) == 0:
        warnings.warn(SceneWarning(why_nothing_is_seen([coat.strokes])), stacklevel=2)
    elif painted < BLANK:
        warnings.warn(SceneWarning(_why_blank(boxes, camera, painted)), stacklevel=2)


def light_canvas(canvas: "Canvas", painting: "Painting", camera: Camera, report: Report) -> Frame:
    """The finished picture; a stage only if there is a lamp."""
    if painting.lamp is None:
        return canvas.finish()
    with report.stage("light") as stage:
        frame, lamp = canvas.finish(painting.lamp), painting.lamp.seen_by(camera)
        azimuth, elevation = degrees(lamp.azimuth), degrees(lamp.elevation)
        stage.did = f"a lamp at {azimuth:.0f}, {elevation:.0f} degrees lights paint and canvas"
        stage.counts = {"azimuth": azimuth, "elevation": elevation, "strength": lamp.strength}
    return frame


def add_layers(canvas: "Canvas", report: Report) -> Frame:
    """The finished picture with its layers, or with every stroke in every pixel."""
    with report.stage("layers") as stage:
        frame = canvas.layered()
        stage.did, stage.counts = ", ".join(frame.layers), {"layers": list(frame.layers)}
        if frame.deep is not None:
            stage.did = f"{len(frame.deep.alphas):,} samples"
            stage.counts = {"samples": len(frame.deep.alphas)}
    return frame


def _stage_name(step: str, coat: "Coat", among: int) -> str:
    return step if among == 1 else f"{step} {coat.name}"


def _rounded(sigmas: "Sigmas") -> Any:
    return round(sigmas, 4) if isinstance(sigmas, float) else [round(each, 4) for each in sigmas]


def why_nothing_is_seen(strokes: Iterable[Gaussians]) -> str:
    """Why none of these strokes is in a picture, and what to do about it."""
    most = max((float(one.opacities.max(initial=0)) for one in strokes), default=0.0)
    if most >= MIN_ALPHA:
        return NOTHING_SEEN
    return f"no stroke is in the picture: all opacities are under 1/255, the largest {most:.2g}; {CURE}"


def _why_blank(boxes: Boxes, camera: Camera, painted: float) -> str:
    """Why so little of a picture is painted, and what to do about it."""
    from brushgs.rendering.areas import seen_areas

    areas = seen_areas(boxes, camera.width, camera.height)
    opacity = float((areas @ boxes.opacities) / max(areas.sum(), 1e-300))
    fact = f"the picture is nearly blank: strokes cover {painted:.2%} of it"
    if opacity > FAINT:
        return f"{fact}, since few or small ones lie in view; take a larger --zoom or another view"
    return f"{fact}, since they are faint: their mean opacity is {opacity:.2g}; {CURE}"


def _describe_levels(boxes: Boxes, texture: "Brushes", filter: str, stage: Stage) -> None:
    """Report how many mip levels of the stroke image were skipped, because no stroke samples them."""
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
    frame: "Frame | Strips",
    path: Path,
    background: Background,
    config: PaintConfig,
    report: Report,
    shot: "Shot | None" = None,
) -> None:
    """Write the picture on its background, with layers and metadata if the format holds them."""
    with report.stage("write") as stage:
        from brushgs.formats.pictures.images import write_frame
        from brushgs.formats.registry import find_written, function_of, is_drawing

        if is_drawing(path):
            assert isinstance(frame, Frame), "drawings are made of a frame"
            _write_paths(frame, path, background, shot, stage)
        elif (layered := find_written("layered", path)) is not None:
            assert isinstance(frame, Frame), "layered files are made of a frame"
            num = function_of(layered.write)(frame, path, background, shot=shot)
            stage.details.append(f"{num} layers: {', '.join(sheet.name for sheet in frame.sheets)}")
            stage.counts = {"layers": num}
        else:
            output = config.output
            more: dict[str, Any] = {"bits": output.bits, "colorspace": output.colorspace}
            write_frame(frame, path, background=background, **more, shot=shot)
        ground = config.draw.background
        stage.did = f"{path}, on {ground}"
        stage.counts |= {"path": str(path), "bytes": path.stat().st_size, "background": ground}


def _write_paths(frame: Frame, path: Path, background: Background, shot: "Shot | None", stage: Stage) -> None:
    """Write the strokes of a frame as paths; a picture behind them becomes its mean color."""
    from brushgs.formats.pictures.svg import write_svg

    paths = frame.paths
    assert paths is not None, "they were wanted of the frame"
    if paths.ground is None and background is not None:
        red, green, blue = np.asarray(background, np.float64).reshape(-1, 3).mean(axis=0)
        paths = replace(paths, ground=(float(red), float(green), float(blue)))
    write_svg(paths, path, shot=shot)
    num = sum(len(group.paths) for group in paths.groups)
    stage.details.append(f"{num:,} paths in {len(paths.groups)} groups, without light, tooth and streaks")
    stage.counts = {"paths": num}
