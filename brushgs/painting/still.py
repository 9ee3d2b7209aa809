"""The stages in order, each timed, each able to say what it did and what this scene does not need.

    stroke (-> palette) -> load -> camera (-> background, plain) -> prune (-> count) -> cluster (-> recolor)
        -> project -> rasterise -> write

The camera is framed on the scene as loaded, so that paintings of one scene with other counts line up.
Every step takes a `Report` and adds its `Stage`; a scene is let go as soon as the next one is made of it.
"""

import os
import tempfile
from dataclasses import replace
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.pictures.formats import PICTURE_SUFFIXES
from brushgs.io.scenes.formats import SCENE_SUFFIXES
from brushgs.options.painting import ClusterConfig, DrawConfig, PaintConfig, PaletteConfig, PruneConfig
from brushgs.painting.prepare import Prepared, prepare
from brushgs.painting.report import Report
from brushgs.painting.stages import (
    load_scene,
    open_palette,
    project_scene,
    prune_scene,
    rasterize_boxes,
    recolor_scene,
    write_picture,
    write_scene,
)
from brushgs.scene import Camera, Frame, Gaussians


def paint_file(
    scene: str | Path,
    output: str | Path,
    config: PaintConfig | None = None,
    *,
    camera: Camera | None = None,
    report: Report | None = None,
) -> Report:
    """Paint a scene file to a picture file.

    Args:
        scene: a trained 3D Gaussian scene.
        output: picture to write; the suffix decides the format: .png, .exr, .tif.
        config: see `PaintConfig`.
        camera: the view, in place of what `config.view` says.
        report: where the stages are told; a new one if None.

    Returns:
        The report, with one stage per step.

    Raises:
        SceneError: if a file cannot be read or written.
        ValueError: if an option does not suit the scene, before any long work where that can be known.
    """
    config, report, output = config or PaintConfig(), report or Report(), Path(output)
    check_output(output, PICTURE_SUFFIXES, inputs=input_files(scene, config))
    prepared = prepare(scene, config, report, views=camera)
    is_deep = output.suffix.lower() == ".exr"  # the one format that carries depth
    frame = paint_view(replace(prepared, options=replace(prepared.options, depth=is_deep)), report)
    write_picture(frame, output, prepared.background, config.draw, report)
    report.output = str(output)
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


def paint_view(prepared: Prepared, report: Report) -> Frame:
    """The strokes as the first camera sees them."""
    camera, texture, options = prepared.camera, prepared.texture, prepared.options
    boxes = project_scene(prepared.strokes, camera, texture, options, report)
    return rasterize_boxes(boxes, camera, texture, options, report)


def prune_file(scene: str | Path, output: str | Path, config: PruneConfig, report: Report) -> Report:
    """The prune pass alone: scene file to scene file."""
    check_output(Path(output), SCENE_SUFFIXES, inputs=(Path(scene),))
    gaussians, notes = load_scene(scene, report)
    gaussians = prune_scene(gaussians, config, report)
    return write_scene(gaussians, output, report, is_strokes=notes.is_strokes)


def cluster_file(scene: str | Path, output: str | Path, config: ClusterConfig, report: Report) -> Report:
    """The cluster pass alone: scene file to scene file.

    It has no view. Where the count of strokes is chosen for one, the scene is framed as `paint_file` does by
    default, and seen with the plain kernel.
    """
    check_output(Path(output), SCENE_SUFFIXES, inputs=(Path(scene),))
    paint = PaintConfig(PruneConfig(keep=1.0), config, draw=DrawConfig(stroke="gaussian"))
    prepared = prepare(scene, paint, report, needs_view=False, needs_background=False)
    return write_scene(prepared.strokes, output, report, is_strokes=True)


def recolor_file(scene: str | Path, output: str | Path, config: PaletteConfig, report: Report) -> Report:
    """The palette pass alone: scene file to scene file."""
    check_output(Path(output), SCENE_SUFFIXES, inputs=(Path(scene), config.file))
    palette = open_palette(config, report)
    gaussians, notes = load_scene(scene, report)
    gaussians = recolor_scene(gaussians, palette, config, report)
    return write_scene(gaussians, output, report, is_strokes=notes.is_strokes)


def input_files(scene: str | Path, config: PaintConfig) -> tuple[Path, ...]:
    """The files that a painting is made of; names of built-in strokes and grounds among them mean no file."""
    palette = () if config.palette is None else (config.palette.file,)
    return Path(scene), Path(config.draw.stroke), Path(config.draw.background), *palette


def check_output(path: Path, suffixes: tuple[str, ...], inputs: tuple[Path, ...] = ()) -> None:
    """Refuse an output that could not be written, before the work for it is done.

    Raises:
        ValueError: if the suffix is none of `suffixes`.
        SceneError: if the folder is missing or read-only, or the output is one of the inputs.
    """
    if path.suffix.lower() not in suffixes:
        raise ValueError(
            f"output must end in {', '.join(suffixes)}, got {str(path)!r}; the suffix decides the format"
        )
    if path.exists() and not path.is_file():
        raise SceneError(path, "is not a regular file and cannot be replaced; choose another name")
    if path.exists() and any(other.exists() and path.samefile(other) for other in inputs):
        raise SceneError(path, "is the input, which is never overwritten; choose another name")
    check_folder(path.resolve().parent, path)


def check_folder(folder: Path, path: Path) -> None:
    """Refuse a folder that `path` could not be written to.

    Raises:
        SceneError: if the folder is missing, read-only or a file.
    """
    if folder.exists() and not folder.is_dir():
        raise SceneError(path, f"{folder} is a file, not a folder; choose another name")
    if not folder.is_dir():
        raise SceneError(path, f"the folder {folder} does not exist; create it first")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise SceneError(path, f"cannot be written: {os.strerror(error.errno or 0).lower()}") from None
