"""Write the strokes of a painting as a scene file, for viewers of Gaussians; or convert a scene's format."""

from pathlib import Path

from brushgs.formats.registry import STROKE_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.outputs import check_output, input_files
from brushgs.pipeline.prepare import STROKES, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import load_scene, name_of, write_scene
from brushgs.pipeline.views import default_first_view
from brushgs.values.gaussians import Gaussians

_KERNEL = "gaussian"  # gives the plain picture


def export_strokes(
    scene: SceneFiles,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    report: Report | None = None,
) -> Report:
    """Write the strokes of `paint_file` as Gaussians; the suffix decides the format.

    The file stores the scene's name, first view and brushes, as far as the format allows: `paint_file` of it
    shows the same strokes. Ground, backdrop, light and medium belong to the look, and are not stored. With
    the stroke "gaussian" the scene itself is written with its records: a format conversion.

    Args:
        scene: the files of a trained 3D Gaussian scene, or of strokes.
        output: one of `STROKE_SUFFIXES`.
        config: see `PaintConfig`.
        report: collects the stages; None makes a new one.

    Returns:
        The report; its stage "write" states the rounding of the format.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, or the format cannot store a value.
    """
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    source = SceneSource.of(scene)
    check_output(output, STROKE_SUFFIXES, inputs=input_files(source, config))
    if config.draw.stroke == _KERNEL:
        gaussians, notes = load_scene(source, report)
        return write_scene(
            gaussians,
            output,
            report,
            is_strokes=notes.is_strokes,
            scene=name_of(source, notes),
            first_view=default_first_view(gaussians, notes, report),
            brushes=notes.brushes,
        )
    prepared = prepare(source, config, report, asks=(*STROKES, "first_view"))
    strokes = prepared.strokes
    if prepared.plain is not None:  # outside of the painted part
        strokes = Gaussians.joined([strokes, prepared.plain])
    return write_scene(
        strokes,
        output,
        report,
        is_strokes=True,
        scene=name_of(source, prepared.notes),
        first_view=prepared.known_view,
        brushes=prepared.kit.images,
    )
