"""Outputs of a path: the meaning of their names, and checks that they suit the options and can be written."""

import os
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.formats.pictures.numbered import DEFAULT_NAME, NumberedFiles
from brushgs.formats.pictures.video import check_rate, check_size
from brushgs.formats.registry import PICTURE_SUFFIXES, VIDEO_SUFFIXES
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles
from brushgs.pipeline.background import check_background
from brushgs.pipeline.outputs import check_encoding, check_folder, check_output, input_files


def plan_output(output: str | Path, *, is_resumed: bool = False) -> Path | NumberedFiles:
    """Read an output name: a video, or the numbered files that a pattern or a folder stands for.

    A name stands for a folder if it ends in a slash, has no suffix, or is an existing folder.

    Raises:
        ValueError: if it is neither, or a video is to be resumed.
    """
    path, text = Path(output), str(output)
    is_folder = text.endswith(("/", os.sep)) or path.is_dir() or (not path.suffix and "%" not in path.name)
    if is_folder:
        return NumberedFiles.of(path / DEFAULT_NAME, PICTURE_SUFFIXES)
    suffix = path.suffix.lower()
    if suffix in VIDEO_SUFFIXES:
        if is_resumed:
            cure = f"paint numbered frames, -o {path.with_suffix('')}/"
            raise ValueError(f"a video cannot be resumed (--resume), got {text!r}; {cure}")
        return path
    if suffix in PICTURE_SUFFIXES and "%" not in text:
        name = path.with_name(f"{path.stem}-%05d{path.suffix}")
        raise ValueError(f"a path has many frames, but {text!r} is one picture; write {name}")
    if suffix not in PICTURE_SUFFIXES:
        known = ", ".join((*VIDEO_SUFFIXES, *PICTURE_SUFFIXES))
        raise ValueError(f"output of a path must be a folder or end in one of {known}, got {text!r}")
    return NumberedFiles.of(path, PICTURE_SUFFIXES)


def check_target(
    target: Path | NumberedFiles, scene: SceneFiles | None, rate: float | None, config: PaintConfig
) -> None:
    """Refuse an output that does not suit the options or cannot be written, before any work.

    `rate` is the requested number of frames a second, or None.

    Raises:
        ValueError: if the background, the frame rate, the size, the codec or the bits do not suit the output.
        SceneError: if the output cannot be written, or would replace an input.
    """
    check_background(config.draw.background)
    check_encoding(target if isinstance(target, Path) else target.pattern, config)
    inputs = input_files(scene, config)
    if isinstance(target, Path):
        if rate is not None:
            check_rate(target, rate)
        crop, fixed = config.output.crop, config.view.fixed_size
        if crop is not None:
            check_size(target, *crop[2:], config.output.codec)
        elif fixed is not None:
            check_size(target, *config.projection.whole_size(*fixed), config.output.codec)
        check_output(target, VIDEO_SUFFIXES, inputs=inputs)
        return
    folder = target.folder.resolve()
    check_folder(folder, target.pattern)
    for file in inputs:
        if target.number(file) is not None and file.is_file() and file.resolve().parent == folder:
            raise SceneError(file, f"is an input, and {target.pattern} would replace it; choose another name")
