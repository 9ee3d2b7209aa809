"""`brushgs export -o FILE.glb`: a scene file -> textured rectangles. Adds one stage to those of `prepare`."""

from pathlib import Path

from brushgs.options.page import QUAD_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.outlets.glb.write import write_quads
from brushgs.outlets.page.export import view_of
from brushgs.pipeline.outputs import check_output, input_files
from brushgs.pipeline.prepare import PICTURE, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import name_of


def export_quads(
    scene: SceneFiles,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    title: str | None = None,
    for_view: bool = False,
    report: Report | None = None,
) -> Report:
    """Convert a scene file to textured rectangles for 3D programs.

    Args:
        scene: the files of a trained 3D Gaussian scene, or of strokes.
        output: .glb file to write.
        config: see `PaintConfig`.
        title: of the scene in the file, any text; None for its name.
        for_view: see `write_quads`.
        report: collects the stages; None makes a new one.

    Returns:
        The report, one stage per step.

    Raises:
        SceneError: if a file cannot be read or written, or no stroke is left to write.
        ValueError: if an option does not suit the scene; before long work if possible.
    """
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    source = SceneSource.of(scene)
    check_output(output, QUAD_SUFFIXES, inputs=input_files(source, config))
    prepared = prepare(source, config, report, asks=(*PICTURE, "first_view"))
    write_quads(
        prepared.painting,
        prepared.camera,
        output,
        view=view_of(prepared, config),
        title=name_of(source, prepared.notes) if title is None else title,
        for_view=for_view,
        report=report,
    )
    report.output = str(output)
    return report
