"""Checks that outputs can be written, before the work for them."""

import hashlib
import os
import tempfile
import warnings
from collections.abc import Callable, Iterable
from itertools import count
from pathlib import Path

from brushgs.brushes.brush_set import paths_of
from brushgs.brushes.texture import brush_of_style
from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import exists, is_dir, is_plain, open_plain
from brushgs.formats.pictures.encoding import check_encoder, choose_encoding
from brushgs.formats.registry import (
    PICTURE_SUFFIXES,
    find_written,
    holds_depth,
    is_drawing,
    is_layered,
    is_written,
)
from brushgs.options.output import OutputConfig
from brushgs.options.painting import PaintConfig
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.pipeline.background import TRANSPARENT
from brushgs.values.shot import Origin

_PIECE, _MOST_PIECES = 1 << 14, 1 << 12  # bytes per piece, and number of pieces, read for a digest


def scene_inputs(scene: SceneFiles | None) -> tuple[Path, ...]:
    """The files and folders of a scene, and the files in these folders; none for a scene in memory."""
    return () if scene is None else SceneSource.of(scene).files()


def input_files(scene: SceneFiles | None, config: PaintConfig) -> tuple[Path, ...]:
    """The input files of a painting; names of built-in strokes and colors among them are no files."""
    palette = () if config.palette is None else (config.palette.file,)
    styles = () if config.style is None else config.style.files
    return (
        *scene_inputs(scene),
        *map(_file_of, paths_of(config.draw.stroke)),
        Path(config.draw.background),
        *map(_file_of, config.brushes.names),
        Path(config.ground.ground),
        *map(_file_of, config.ground.backdrop_brushes),
        *palette,
        *styles,
        *(() if config.rules is None else config.rules.files),
        *(() if config.painted is None else config.painted.files),
        *config.strokes.files,
        *config.hand.files,
        *config.overpaint.files,
    )


def digest_of(files: Iterable[Path]) -> str:
    """A digest of the content of files; names without a file are ignored.

    Files up to 64 MiB are read completely, larger ones in 4096 evenly spaced pieces.
    """
    found = [path for path in files if is_plain(path)]
    hashed, num_pieces = hashlib.blake2b(digest_size=8), max(_MOST_PIECES // max(len(found), 1), 4)
    for path in found:
        with open_plain(path) as file:
            size = file.seek(0, os.SEEK_END)
            step = max(size // num_pieces, _PIECE)
            hashed.update(f"{size} ".encode())
            for start in range(0, size, step):
                file.seek(start)
                hashed.update(file.read(_PIECE))
    return hashed.hexdigest()


def free_name(
    default: Path, origin: Origin | None = None, is_ours: Callable[[Path], bool] | None = None
) -> Path:
    """The first of NAME, NAME-2, NAME-3, ... that is free or may be replaced; warns if it is not NAME.

    Args:
        default: the name; without a suffix that of a folder.
        origin: of the picture: a file with equal metadata may be replaced. None for no file.
        is_ours: whether a file may be replaced, instead of comparing `origin`.
    """
    from brushgs.formats.pictures.metadata import is_painted_by

    def is_same(path: Path) -> bool:
        return origin is not None and is_painted_by(path, origin)

    path, replaces = default, is_ours or is_same
    for number in count(2):
        if replaces(path) or not is_there(path):
            break
        path = default.with_name(f"{default.stem}-{number}{default.suffix}")
    if path != default:
        warnings.warn(SceneWarning(f"{default} exists and is kept; this is written to {path}"), stacklevel=2)
    return path


def is_there(path: Path) -> bool:
    """Whether there is a file of that name, or a folder that is not empty."""
    return any(path.iterdir()) if is_dir(path) else exists(path)


def _file_of(stroke: str | Path) -> Path:
    of_style = brush_of_style(str(stroke))
    return Path(stroke) if of_style is None else of_style[0]


def check_output(path: Path, suffixes: tuple[str, ...], inputs: tuple[Path, ...] = ()) -> None:
    """Refuse an output that cannot be written, before any work.

    Raises:
        ValueError: if the suffix is none of `suffixes`.
        SceneError: if the folder is read-only or a file, or the output is one of the inputs.
    """
    if not is_written(path, suffixes):
        raise ValueError(
            f"output must end in {', '.join(suffixes)}, got {str(path)!r}; the suffix decides the format"
        )
    if path.exists() and not path.is_file():
        raise SceneError(path, "is not a regular file and cannot be replaced; choose another name")
    if path.exists() and any(other.exists() and path.samefile(other) for other in inputs):
        raise SceneError(path, "is the input, which is never overwritten; choose another name")
    check_folder(path.resolve().parent, path)


def check_encoding(path: Path, config: PaintConfig) -> None:
    """Refuse a background, layers, a codec or bits that an output does not support, before any work.

    Raises:
        ValueError: if it does not support one of them.
    """
    output, transparent = config.output, config.draw.background.lower() == TRANSPARENT
    if is_drawing(path) or is_layered(path):
        given = [name for name in ("codec", "bits", "colorspace") if getattr(output, name) is not None]
        given += [name for name in ("layers", "deep") if getattr(output, name)]
        if given:
            cure = path.with_suffix(".exr" if given[0] in ("layers", "deep", "colorspace") else ".png")
            holds = "paths, not pixels" if is_drawing(path) else "its own layers, of 8 bits"
            raise ValueError(f"{given[0]} must be omitted for {path.name}, which holds {holds}; write {cure}")
        if (layered := find_written("layered", path)) is not None:
            check_encoder(path, layered)
        return
    _check_colorspace(path, output)
    choose_encoding(path, codec=output.codec, bits=output.bits, transparent=transparent)
    if (output.layers or output.deep) and not holds_depth(path):
        asked = "deep" if output.deep else "layers"
        frames = Path(f"{path.with_suffix('')}/%05d.exr")  # of a video
        cure = path.with_suffix(".exr") if path.suffix.lower() in PICTURE_SUFFIXES else frames
        raise ValueError(f"{asked} must be written to .exr, got {path.name}; write {cure}")


def _check_colorspace(path: Path, output: OutputConfig) -> None:
    """Refuse a color space that a file does not hold. Raises ValueError."""
    space = output.colorspace
    if space is None or holds_depth(path):
        return
    if path.suffix.lower() not in PICTURE_SUFFIXES:
        raise ValueError(f"colorspace must be omitted for {path.name}, a film; write numbered .exr files")
    if space != "srgb":
        fact = f"colorspace must be srgb for {path.name}, which is display-encoded, got {space}"
        raise ValueError(f"{fact}; write {path.with_suffix('.exr')}")


def check_folder(folder: Path, path: Path) -> None:
    """Refuse a folder that is not writable, and a name that libraries do not accept.

    A missing folder is created later, with its first file, see `replacing`.

    Raises:
        SceneError: if the folder, or the one that it would be made in, is read-only or a file, or if the name
            is not UTF-8.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise SceneError(path, "its name is not UTF-8; choose another name") from None
    there = next(one for one in (folder, *folder.parents) if one.exists())
    if not there.is_dir():
        raise SceneError(path, f"{there} is a file, not a folder; choose another name")
    try:
        with tempfile.TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise SceneError(path, f"cannot be written: {os.strerror(error.errno or 0).lower()}") from None
