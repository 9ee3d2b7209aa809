"""Strokes as an output: a scene file, or for a clip a folder of scene files, one per moment."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.formats.moving.write import NAME, check_moments_folder
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.moving import Moving
from brushgs.pipeline.outputs import check_folder, check_output
from brushgs.pipeline.prepare import Prepared
from brushgs.pipeline.report import Report
from brushgs.pipeline.strokes import file_size, write_scene
from brushgs.pipeline.where import Rest
from brushgs.values.gaussians import Gaussians


def check_moments(output: str | Path, clip: Clip, inputs: tuple[Path, ...] = ()) -> None:
    """Refuse an invalid output for the strokes of a clip, before any work.

    A name stands for a folder if it ends in a slash, has no suffix, or is an existing folder.

    Raises:
        ValueError: if it is one file.
        SceneError: if the folder holds an input or files of others, or cannot be written.
    """
    path, text = Path(output), str(output)
    if "%" in path.name:
        raise ValueError(f"moments are called {NAME}; name their folder, {path.parent}/, not {text!r}")
    if not (text.endswith(("/", os.sep)) or path.is_dir() or not path.suffix):
        cure = f"write a folder, {path.with_suffix('')}/"
        if path.suffix.lower() in SCENE_SUFFIXES:
            cure = f"{cure}, or add --time, one moment of it"
            raise ValueError(f"{text} is one scene, and {clip.name} moves; {cure}")
        raise ValueError(f"output of a moving scene must be a folder, got {text!r}; {cure}")
    folder = path.resolve()
    for file in inputs:
        if folder in (file.resolve(), *file.resolve().parents):
            raise SceneError(file, f"is an input, and {path}/ would replace it; choose another folder")
    check_folder(folder, path)
    check_moments_folder(path)


def check_strokes_output(scene: SceneFiles | Clip, output: str | Path, inputs: tuple[Path, ...] = ()) -> None:
    """Refuse an invalid output for the strokes of a scene or a clip, before any work.

    Raises:
        ValueError: if it is no scene file, or no folder for a clip.
        SceneError: if it cannot be written, or an input would be lost.
    """
    if isinstance(scene, Clip):
        check_moments(output, scene, inputs)
    else:
        check_output(Path(output), SCENE_SUFFIXES, inputs)


def write_strokes(
    strokes: Gaussians, prepared: Prepared, output: str | Path, name: str, report: Report
) -> Report:
    """Write the strokes of a prepared scene to a file, or of a clip to a folder, and complete the report.

    Gaussians outside the painted part follow the strokes unchanged.

    Args:
        strokes: those of `prepared`, perhaps changed.
        prepared: with a first view.
        output: see `check_strokes_output`.
        name: of the scene.
        report: gets the stage.
    """
    facts: dict[str, Any] = {"scene": name, "first_view": prepared.known_view, "brushes": prepared.kit.images}
    rest = prepared.rest
    if prepared.moving is None:
        whole = strokes if rest is None else rest.behind(strokes)
        return write_scene(whole, output, report, is_strokes=True, **facts)
    return _write_moments(strokes, prepared.moving, rest, Path(output), report, **facts)


def _write_moments(
    strokes: Gaussians, moving: Moving, rest: Rest | None, folder: Path, report: Report, **facts: Any
) -> Report:
    from brushgs.formats.moving import write

    motion = moving.motion
    num = len(motion.times)
    with report.stage("write", total=num, unit="moments") as stage:

        def moments() -> Iterator[Gaussians]:
            for position in range(num):
                moved = motion.pose(position).moved(strokes, has_color=moving.takes_light)
                yield moved if rest is None else rest.behind(moved, float(motion.times[position]))
                report.advance()

        size = write.write_moments(moments(), folder, **facts)
        stage.did = f"{folder}/, {num:,} moments, {file_size(size)}"
        stage.counts = {"path": str(folder), "bytes": size, "gaussians": len(strokes), "moments": num}
    report.output = f"{folder}/"
    return report
