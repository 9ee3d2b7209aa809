"""Single passes as commands: prune, cluster or recolor, from scene file to scene file.

The output stores the name and first view of the input scene, so that pictures of both line up.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.painting import PaintConfig, PaletteConfig, PruneConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.options.where import WhereConfig
from brushgs.pipeline.clip import Clip, as_files, files_of
from brushgs.pipeline.moments import check_strokes_output, write_strokes
from brushgs.pipeline.outputs import check_output, scene_inputs
from brushgs.pipeline.prepare import STROKES, prepare
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Step, costly, held
from brushgs.pipeline.strokes import (
    load_scene,
    name_of,
    open_palette,
    prune_scene,
    recolor_scene,
    write_scene,
)
from brushgs.pipeline.views import default_first_view
from brushgs.pipeline.where import files_where, rows_where, where_in

if TYPE_CHECKING:
    from brushgs.values.camera import FirstView
    from brushgs.values.gaussians import Gaussians
    from brushgs.values.notes import LoadNotes

_FIRST_VIEW = Step.of(costly(default_first_view))


def prune_file(
    scene: SceneFiles,
    output: str | Path,
    config: PruneConfig,
    report: Report,
    *,
    where: WhereConfig | None = None,
) -> Report:
    """Prune a scene or stroke file, or only a part of it."""
    check_output(Path(output), SCENE_SUFFIXES, inputs=(*scene_inputs(scene), *files_where(where)))
    gaussians, notes = load_scene(scene, report)
    view = _first_view(scene, gaussians, notes, report)
    among = rows_where(gaussians, where, view, report, what=_called(notes))
    gaussians = prune_scene(gaussians, config, report, among=among)
    return _write(gaussians, output, scene, notes, view, report)


def cluster_file(
    scene: SceneFiles | Clip,
    output: str | Path,
    config: PaintConfig,
    report: Report,
    *,
    where: WhereConfig | None = None,
) -> Report:
    """Cluster a scene file without pruning it; for a moving scene, write strokes as one file per moment.

    If only a part is clustered, the other Gaussians follow unchanged in the file. A number of strokes that
    depends on a view is chosen for the default view and stroke of `paint_file`.
    """
    files, scene = files_of(scene), as_files(scene)
    check_strokes_output(scene, output, inputs=(*scene_inputs(files), *files_where(where)))
    unpruned = replace(config, prune=PruneConfig(keep=1.0))
    prepared = prepare(scene, unpruned, report, asks=(*STROKES, "first_view"), where=where)
    return write_strokes(prepared.strokes, prepared, output, name_of(files, prepared.notes), report)


def recolor_file(
    scene: SceneFiles,
    output: str | Path,
    config: PaletteConfig,
    report: Report,
    *,
    where: WhereConfig | None = None,
) -> Report:
    """Give a scene file, or a part of it, the colors of a palette."""
    check_output(
        Path(output), SCENE_SUFFIXES, inputs=(*scene_inputs(scene), config.file, *files_where(where))
    )
    palette = open_palette(config, report)
    gaussians, notes = load_scene(scene, report)
    view = _first_view(scene, gaussians, notes, report)
    shares = where_in(gaussians, where, view, report, what=_called(notes))
    gaussians = recolor_scene(gaussians, palette, config, report, is_strokes=notes.is_strokes, shares=shares)
    return _write(gaussians, output, scene, notes, view, report)


def _write(
    gaussians: "Gaussians",
    output: str | Path,
    scene: SceneFiles,
    notes: "LoadNotes",
    view: "FirstView",
    report: Report,
) -> Report:
    """Write what a pass made of a scene, with what is known of that scene."""
    return write_scene(
        gaussians,
        output,
        report,
        is_strokes=notes.is_strokes,
        scene=name_of(scene, notes),
        first_view=view,
        brushes=notes.brushes,
    )


def _called(notes: "LoadNotes") -> str:
    return "strokes" if notes.is_strokes else "Gaussians"


def _first_view(scene: SceneFiles, gaussians: "Gaussians", notes: "LoadNotes", report: Report) -> "FirstView":
    """The default first view of a scene as loaded; a command that keeps results keeps it by its files."""

    def make() -> "FirstView":
        return default_first_view(gaussians, notes, report)

    memory = held()
    if memory is None or not isinstance(scene, SceneSource):
        return make()
    return memory.run(_FIRST_VIEW, {"source": scene}, {}, report, make)
