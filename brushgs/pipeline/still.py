"""From a scene file, or Gaussians in memory, to one picture.

The stages are those of `prepare`, then project -> rasterise -> write.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from brushgs.formats.pictures.metadata import write_sidecar
from brushgs.formats.pictures.oiio import Strips
from brushgs.formats.registry import (
    DRAWING_SUFFIXES,
    LAYERED_SUFFIXES,
    PICTURE_SUFFIXES,
    holds_depth,
    is_drawing,
    is_layered,
    takes_strips,
)
from brushgs.options.look import Look, config_of
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.backdrop import with_cut_edges
from brushgs.pipeline.background import cut_background
from brushgs.pipeline.drawing import (
    add_layers,
    lay_coat,
    light_canvas,
    paint_with_rig,
    project_coat,
    warn_if_blank,
    write_picture,
)
from brushgs.pipeline.media.materials import BACKDROP, CUT_IN
from brushgs.pipeline.outputs import check_encoding, check_output, input_files
from brushgs.pipeline.prepare import PICTURE, Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strips import check_memory, needs_strips, strips
from brushgs.pipeline.strokes import name_of
from brushgs.rendering.wanted import NOTHING, Wanted
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.shot import Origin, Shot

SPENT_OUTSIDE = "most lie outside: --strokes-for view spends all in this view"


def paint_file(
    scene: SceneFiles,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
    sheet: str | Path | None = None,
    first: float = 1.0,
    origin: Origin | None = None,
) -> Report:
    """Paint a scene file to a picture file.

    Args:
        scene: the files of a trained 3D Gaussian scene.
        output: picture to write; the suffix decides the format, see `formats.registry`.
        config: see `PaintConfig`.
        camera: the view, in place of that of `config.view`.
        report: gets the stages; None makes a new one.
        sheet: output of a contact sheet of the plain scene, see `views_sheet`; or None.
        first: share of the strokes that are laid, 0 to 1: an unfinished painting.
        origin: metadata of picture and sheet, or None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene; before long work if possible.
    """
    check_share(first)
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    inputs = input_files(scene, config)
    _check_output(output, config, inputs, has_origin=origin is not None)
    if sheet is not None:
        check_output(Path(sheet), PICTURE_SUFFIXES, inputs=(*inputs, output))
    has_sheet = sheet is not None
    prepared = prepare(
        scene,
        config,
        report,
        asks=(*PICTURE, *(("first_view", "scene") if has_sheet else ()), *(("growth",) if first < 1 else ())),
        views=camera,
    )
    kind: dict[str, Any] = {"paths": is_drawing(output), "sheets": is_layered(output)}
    wanted = Wanted(config.output.all_layers, config.output.deep, **kind)
    frame = paint_view(
        prepared,
        report,
        depth=holds_depth(output),
        first=first,
        wanted=wanted,
        in_strips=takes_strips(output),
    )
    painting, rig = prepared.painting, prepared.painting.rig
    shot = Shot(prepared.camera, origin=origin, part=painting.part, dpi=painting.dpi)
    if rig is not None:  # there is no single view
        shot = Shot(origin=origin, dpi=painting.dpi, panorama=rig.panorama)
    behind = cut_background(prepared.background, painting.part)
    write_picture(frame, output, behind, config, report, shot)
    if config.output.sidecar:
        write_sidecar(output, shot)
    report.output = str(output)
    if sheet is not None:
        from brushgs.pipeline.views_sheet import write_sheet_of

        name = name_of(scene, prepared.notes)
        write_sheet_of(prepared, Path(sheet), config, report, name=name, origin=origin)
    return report


def _check_output(output: Path, config: PaintConfig, inputs: tuple[Path, ...], *, has_origin: bool) -> None:
    """Raise a ValueError if one picture cannot be written as the options say."""
    check_output(output, PICTURE_SUFFIXES + DRAWING_SUFFIXES + LAYERED_SUFFIXES, inputs=inputs)
    check_encoding(output, config)
    if (is_drawing(output) or is_layered(output)) and not config.projection.is_plain:
        cure = output.with_suffix(".png")
        raise ValueError(
            f"{output.name} holds the strokes of one pinhole camera, no sphere and no eyes; write {cure}"
        )
    if config.output.sidecar and not has_origin:
        raise ValueError("sidecar holds the metadata, which no-metadata omits; omit one")
    if "motion" in config.output.layers:
        raise ValueError("layers must not have motion in one picture, which has no next frame; omit it")
    if is_drawing(output) and config.output.crop is not None:
        raise ValueError(f"crop must be omitted for a drawing in lines, got {output.name}; write a picture")


def paint(
    scene: Gaussians | SceneFiles,
    look: PaintConfig | Look | str | Path | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
    first: float = 1.0,
    is_on_background: bool = False,
) -> Frame:
    """Paint a scene, as `paint_file` does, to a frame.

    Args:
        scene: N Gaussians, which count as a scene and not as strokes, or the files of one.
        look: a look, its name ("oil") or its TOML file, or all options, see `PaintConfig`. None for oil, the
            look of `brushgs render`.
        camera: the view, in place of that of the options; None frames the scene.
        report: gets the stages; None makes a new one.
        first: see `paint_file`.
        is_on_background: whether to draw on the background of the options: the frame is then opaque, unless
            the background is "transparent".

    Returns:
        The picture. It is opaque if the look has a ground, and has a height if it has a relief.

    Raises:
        SceneError: if a file cannot be read.
        ValueError: if an option does not suit the scene.
    """
    check_share(first)
    config, report = config_of(look), report or Report()
    asks = (*PICTURE, "growth") if first < 1 else PICTURE
    prepared = prepare(scene, config, report, asks=asks, views=camera, on_background=is_on_background)
    wanted = Wanted(config.output.all_layers, config.output.deep)
    frame = paint_view(prepared, report, first=first, wanted=wanted)
    assert isinstance(frame, Frame), "strips were not asked for"
    background = cut_background(prepared.background, prepared.painting.part)
    if not is_on_background or background is None:
        return frame
    return replace(frame, rgb=frame.over(background), alpha=np.ones_like(frame.alpha))


def check_share(first: float) -> None:
    """Refuse an invalid share of strokes.

    Raises:
        ValueError: if it is not in 0 to 1.
    """
    if not 0 <= first <= 1:
        raise ValueError(f"first must be in 0 to 1, got {first:g}; for 30 % write 0.3 or 30%")


def paint_view(
    prepared: Prepared,
    report: Report,
    *,
    depth: bool = True,
    first: float = 1.0,
    wanted: Wanted = NOTHING,
    in_strips: bool = False,
) -> Frame | Strips:
    """Paint the strokes as the first camera sees them.

    Args:
        prepared: the painting and its view.
        report: gets the stages.
        depth: whether the frame has a depth.
        first: as for `paint_file`.
        wanted: see `Wanted`.
        in_strips: whether a large picture may be painted strip by strip, while it is written.
    """
    painting, camera = prepared.painting, prepared.camera
    if prepared.growth is not None:
        painting = prepared.growth.first(first)
    painting = painting.with_depth(depth)
    advice = "" if prepared.notes is not None and prepared.notes.is_strokes else SPENT_OUTSIDE
    if prepared.growth is None:
        painting = with_cut_edges(painting, camera, prepared.edges)
    if painting.rig is not None:
        return paint_with_rig(painting, camera, report, wanted)
    # An unfinished painting may be almost empty, and so may a part of one.
    is_whole = prepared.growth is None and painting.part is None
    if in_strips and not wanted.is_any and needs_strips(painting, camera):
        return strips(painting, camera, report, advice=advice, is_whole=is_whole)
    check_memory(painting, camera)
    canvas, shown = painting.canvas(camera, wanted), []
    for coat in painting.coats:
        boxes = project_coat(coat, camera, report, advice=advice, among=len(painting.coats))
        painted = lay_coat(canvas, coat, boxes, report, among=len(painting.coats))
        if coat.name not in (BACKDROP, CUT_IN):
            shown.append((painted, len(boxes), boxes, coat))
    if is_whole:
        painted, _, boxes, coat = max(shown, key=lambda one: one[:2])
        warn_if_blank(coat, boxes, camera, painted)
    frame = light_canvas(canvas, painting, camera, report)
    return add_layers(canvas, report) if wanted.is_any else frame
