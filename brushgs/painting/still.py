"""One picture: a scene file, or Gaussians in memory, becomes a still.

The stages are those of `prepare`, then project -> rasterise -> write.
"""

from dataclasses import replace
from pathlib import Path

from brushgs.io.pictures.formats import PICTURE_SUFFIXES, holds_depth
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.painting.drawing import project_scene, rasterize_boxes, write_picture
from brushgs.painting.outputs import check_output, check_transparency, input_files
from brushgs.painting.prepare import Prepared, prepare
from brushgs.painting.report import Report
from brushgs.painting.strokes import name_of
from brushgs.painting.views_sheet import write_sheet_of
from brushgs.scene import Camera, Frame, Gaussians

SPENT_OUTSIDE = "most lie outside: --strokes-for view spends all in this view"


def paint_file(
    scene: SceneFiles,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
    sheet: str | Path | None = None,
) -> Report:
    """Paint a scene file to a picture file.

    Args:
        scene: the files of a trained 3D Gaussian scene.
        output: picture to write; the suffix decides the format, see `brushgs.io.pictures.formats`.
        config: see `PaintConfig`.
        camera: the view, in place of the one that `config.view` describes.
        report: gets the stages; a new one if None.
        sheet: another picture, which shows the plain scene from all around, see `views_sheet`; None for none.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    check_output(output, PICTURE_SUFFIXES, inputs=input_files(scene, config))
    check_transparency(output, config)
    if sheet is not None:
        check_output(Path(sheet), PICTURE_SUFFIXES, inputs=(*input_files(scene, config), output))
    has_sheet = sheet is not None
    prepared = prepare(scene, config, report, views=camera, needs_first_view=has_sheet, keeps_scene=has_sheet)
    frame = paint_view(prepared, report, depth=holds_depth(output))
    write_picture(frame, output, prepared.background, config.draw, report)
    report.output = str(output)
    if sheet is not None:
        write_sheet_of(prepared, Path(sheet), config, report, name=name_of(scene, prepared.notes))
    return report


def paint(
    gaussians: Gaussians,
    config: PaintConfig | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
) -> Frame:
    """Paint Gaussians in memory: `paint_file` without its files. Takes and raises the same."""
    config, report = config or PaintConfig(), report or Report()
    prepared = prepare(gaussians, config, report, views=camera, needs_background=False)
    return paint_view(prepared, report)


def paint_view(prepared: Prepared, report: Report, *, depth: bool = True) -> Frame:
    """Paint the strokes as the first camera sees them."""
    camera, texture = prepared.camera, prepared.texture
    options = replace(prepared.options, depth=depth)
    advice = "" if prepared.notes is not None and prepared.notes.is_strokes else SPENT_OUTSIDE
    boxes = project_scene(prepared.strokes, camera, texture, options, report, advice=advice)
    return rasterize_boxes(boxes, camera, texture, options, report)
