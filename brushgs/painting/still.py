"""One picture: a scene file, or Gaussians in memory, becomes a still.

The stages are those of `prepare`, then project -> rasterise -> write.
"""

from pathlib import Path

from brushgs.io.pictures.formats import PICTURE_SUFFIXES, holds_depth
from brushgs.options.look import Look, config_of
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.painting.drawing import lay_coat, light_canvas, project_coat, warn_if_blank, write_picture
from brushgs.painting.look import BACKDROP
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
    first: float = 1.0,
) -> Report:
    """Paint a scene file to a picture file.

    Args:
        scene: the files of a trained 3D Gaussian scene.
        output: picture to write; the suffix decides the format, see `brushgs.io.pictures.formats`.
        config: see `PaintConfig`.
        camera: the view, in place of the one that `config.view` describes.
        report: gets the stages; a new one if None.
        sheet: another picture, which shows the plain scene from all around, see `views_sheet`; None for none.
        first: share of the strokes that are laid, 0 to 1: the painting as it is when so much of it is done.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    if not 0 <= first <= 1:
        raise ValueError(f"first must be in 0 to 1, got {first:g}; for 30 % write 0.3 or 30%")
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    check_output(output, PICTURE_SUFFIXES, inputs=input_files(scene, config))
    check_transparency(output, config)
    if sheet is not None:
        check_output(Path(sheet), PICTURE_SUFFIXES, inputs=(*input_files(scene, config), output))
    has_sheet = sheet is not None
    prepared = prepare(
        scene,
        config,
        report,
        views=camera,
        needs_first_view=has_sheet,
        keeps_scene=has_sheet,
        grows=first < 1,
    )
    frame = paint_view(prepared, report, depth=holds_depth(output), first=first)
    write_picture(frame, output, prepared.background, config.draw, report)
    report.output = str(output)
    if sheet is not None:
        write_sheet_of(prepared, Path(sheet), config, report, name=name_of(scene, prepared.notes))
    return report


def paint(
    gaussians: Gaussians,
    look: PaintConfig | Look | str | Path | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
) -> Frame:
    """Paint Gaussians in memory, as `brushgs render` paints a file.

    Args:
        gaussians: the scene, N Gaussians.
        look: a look, its name ("oil") or its TOML file, or all options, see `PaintConfig`. None for plain
            strokes.
        camera: the view, in place of the one that the options describe; None frames the scene.
        report: gets the stages; a new one if None.

    Returns:
        The picture. It is opaque where the look has a ground, and has a height where it has a relief.

    Raises:
        SceneError: if a file of the look cannot be read.
        ValueError: if an option does not suit the scene.
    """
    config, report = config_of(look), report or Report()
    prepared = prepare(gaussians, config, report, views=camera, needs_background=False)
    return paint_view(prepared, report)


def paint_view(prepared: Prepared, report: Report, *, depth: bool = True, first: float = 1.0) -> Frame:
    """Paint the strokes as the first camera sees them; `first` as for `paint_file`."""
    painting, camera = prepared.painting, prepared.camera
    if prepared.growth is not None:
        painting = prepared.growth.first(first)
    painting = painting.with_depth(depth)
    advice = "" if prepared.notes is not None and prepared.notes.is_strokes else SPENT_OUTSIDE
    canvas, shown = painting.canvas(camera), []
    for coat in painting.coats:
        boxes = project_coat(coat, camera, report, advice=advice, among=len(painting.coats))
        painted = lay_coat(canvas, coat, boxes, report, among=len(painting.coats))
        if coat.name != BACKDROP:
            shown.append((painted, len(boxes), boxes))
    if prepared.growth is None:  # else little may be painted yet
        painted, _, boxes = max(shown, key=lambda one: one[:2])
        warn_if_blank(boxes, camera, painted)
    return light_canvas(canvas, painting, report)
