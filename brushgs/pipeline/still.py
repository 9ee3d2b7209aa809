"""From a scene file, or Gaussians in memory, to one picture.

The stages are those of `prepare`, then project -> rasterise -> write.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from brushgs.formats.pictures.shot import Origin, Shot
from brushgs.formats.registry import DRAWING_SUFFIXES, PICTURE_SUFFIXES, holds_depth, is_drawing
from brushgs.options.look import Look, config_of
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.backdrop import with_cut_edges
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
from brushgs.pipeline.strokes import name_of
from brushgs.pipeline.views_sheet import write_sheet_of
from brushgs.rendering.wanted import NOTHING, Wanted
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

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
    check_output(output, PICTURE_SUFFIXES + DRAWING_SUFFIXES, inputs=input_files(scene, config))
    check_encoding(output, config)
    if is_drawing(output) and not config.projection.is_plain:
        cure = output.with_suffix(".png")
        raise ValueError(
            f"{output.name} holds paths of one pinhole camera, no sphere and no eyes; write {cure}"
        )
    if "motion" in config.output.layers:
        raise ValueError("layers must not have motion in one picture, which has no next frame; omit it")
    if sheet is not None:
        check_output(Path(sheet), PICTURE_SUFFIXES, inputs=(*input_files(scene, config), output))
    has_sheet = sheet is not None
    prepared = prepare(
        scene,
        config,
        report,
        asks=(*PICTURE, *(("first_view", "scene") if has_sheet else ()), *(("growth",) if first < 1 else ())),
        views=camera,
    )
    wanted = Wanted(config.output.all_layers, config.output.deep, paths=is_drawing(output))
    frame = paint_view(prepared, report, depth=holds_depth(output), first=first, wanted=wanted)
    shot = Shot(prepared.camera, origin=origin)
    if prepared.painting.rig is not None:  # there is no single view
        shot = Shot(origin=origin, panorama=prepared.painting.rig.panorama)
    write_picture(frame, output, prepared.background, config, report, shot)
    report.output = str(output)
    if sheet is not None:
        name = name_of(scene, prepared.notes)
        write_sheet_of(prepared, Path(sheet), config, report, name=name, origin=origin)
    return report


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
    if not is_on_background or prepared.background is None:
        return frame
    return replace(frame, rgb=frame.over(prepared.background), alpha=np.ones_like(frame.alpha))


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
) -> Frame:
    """Paint the strokes as the first camera sees them; `first` as for `paint_file`, `wanted` as `Wanted`."""
    painting, camera = prepared.painting, prepared.camera
    if prepared.growth is not None:
        painting = prepared.growth.first(first)
    painting = painting.with_depth(depth)
    advice = "" if prepared.notes is not None and prepared.notes.is_strokes else SPENT_OUTSIDE
    if prepared.growth is None:
        painting = with_cut_edges(painting, camera, prepared.edges)
    if painting.rig is not None:
        return paint_with_rig(painting, camera, report, wanted)
    canvas, shown = painting.canvas(camera, wanted), []
    for coat in painting.coats:
        boxes = project_coat(coat, camera, report, advice=advice, among=len(painting.coats))
        painted = lay_coat(canvas, coat, boxes, report, among=len(painting.coats))
        if coat.name not in (BACKDROP, CUT_IN):
            shown.append((painted, len(boxes), boxes, coat))
    if prepared.growth is None:  # an unfinished painting may be almost empty
        painted, _, boxes, coat = max(shown, key=lambda one: one[:2])
        warn_if_blank(coat, boxes, camera, painted)
    frame = light_canvas(canvas, painting, camera, report)
    return add_layers(canvas, report) if wanted.is_any else frame
