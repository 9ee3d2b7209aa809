"""Read scene files of any format as Gaussians."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.moving.moment import open_moment
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.open_file import drop_brushes, find_parts, join_notes, open_file, warn_of_encoding
from brushgs.formats.scenes.rows import SceneFile
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.notes import LoadNotes


def read_scene(
    scene: SceneFiles, encoding: Encoding | None = None, lod: int | None = None
) -> tuple[Gaussians, LoadNotes]:
    """Read a trained 3D Gaussian scene; for a moving scene, the moment in the source, or else the first.

    Rows that cannot be drawn are dropped with a SceneWarning. Bands of spherical harmonics that are zero in
    every row are dropped without one. Several files are joined in order, with the highest degree in use.

    Args:
        scene: a scene file (its content decides the format, not its suffix); a folder that is a scene or
            holds scenes, see `find_parts`; or several of these, of any formats.
        encoding: what the numbers mean; None for the standard layout.
        lod: level of detail of a scene that has several, from 0, the finest; None for the level in the
            source, or the default of its format.

    Returns:
        The Gaussians as float32 in the order of the files, and notes on the content of the files.

    Raises:
        SceneError: if the format of a file is unknown, a file is damaged, or none of its rows can be drawn;
            or if an encoding is given for a format with a fixed one, a level for a scene without levels, or a
            moment for a still scene.
    """
    encoding = encoding or STANDARD
    gaussians, notes = read_files(open_files(scene, lod, encoding), encoding)
    return gaussians, replace(notes, camera_folders=SceneSource.of(scene).camera_folders())


def read_files(files: Sequence[SceneFile], encoding: Encoding = STANDARD) -> tuple[Gaussians, LoadNotes]:
    """Read files as `read_scene` does; `open_files` read their headers with the same encoding."""
    for file in files:
        if file.has_fixed_encoding and not encoding.is_standard:
            raise SceneError(file.path, f"is a {file.format}, whose encoding is fixed; omit the encoding")
    parts, rows_dropped = [], 0
    for file in files:
        columns, dropped = file.read_columns(encoding)
        dropped.report(file.path, file.num_rows)
        rows_dropped += dropped.num_rows
        if encoding.is_standard and not file.has_fixed_encoding:
            warn_of_encoding(file.path, columns)
        parts.append(columns)
    if len(parts) == 1:
        drop_brushes(files[0], parts[0])
    elif strokes := [file.path for file, part in zip(files, parts, strict=True) if part.brushes is not None]:
        why = "as several files are painted with one set of brushes"
        message = f"the brushes of its strokes are dropped, {why}"
        warnings.warn(SceneWarning(f"{strokes[0]}: {message}"), stacklevel=2)
    columns = Columns.joined(parts)
    notes = join_notes(files, rows_dropped=rows_dropped, sh_degree_used=SH_TERMS[columns.sh.shape[1]])
    return columns.gaussians(antialiased=notes.training == "antialiased"), notes


def read_raw_parts(scene: SceneFiles, lod: int | None = None) -> list[tuple[Columns, SceneFile]]:
    """Read all rows of a scene as stored, neither checked nor activated. Arguments are as in `read_scene`.

    Returns:
        For each file, its columns (log-scales, logits and all bands of spherical harmonics if it follows the
        standard layout), and its header.

    Raises:
        SceneError: if the format of a file is unknown, or a file is damaged.
    """
    return [(file.read_columns(is_raw=True)[0], file) for file in open_files(scene, lod)]


def open_files(scene: SceneFiles, lod: int | None, encoding: Encoding = STANDARD) -> list[SceneFile]:
    """Read the headers of all files, so that errors are raised before any rows are read.

    Arguments and errors are as in `read_scene`. A moment of a moving scene is one file.
    """
    source = SceneSource.of(scene, lod=lod)
    moment = open_moment(source, encoding)
    return [moment] if moment else [open_file(path, source.lod) for path in find_parts(source.paths)]
