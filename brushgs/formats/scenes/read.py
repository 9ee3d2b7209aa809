"""Scene files of any format become Gaussians."""

import warnings
from collections.abc import Sequence
from dataclasses import replace

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.moving.moment import open_moment
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding
from brushgs.formats.scenes.open_file import (
    drop_unnamed_brushes,
    find_parts,
    join_notes,
    open_file,
    warn_of_other_encoding,
)
from brushgs.formats.scenes.rows import SceneFile
from brushgs.options.scene_source import SceneFiles, SceneSource
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.notes import LoadNotes


def read_scene(
    scene: SceneFiles, encoding: Encoding | None = None, lod: int | None = None
) -> tuple[Gaussians, LoadNotes]:
    """Read a trained 3D Gaussian scene; of a moving one, the moment that the source names, else the first.

    Rows that cannot be drawn are dropped with a SceneWarning, as are bands of spherical harmonics that are
    zero in every row, without one. Several files are joined in order, to the highest degree in use.

    Args:
        scene: a scene file, whose content decides the format, not its suffix; a folder that is a scene or
            holds scenes, see `find_parts`; or several of these, of any formats.
        encoding: what the numbers mean; None for the standard layout.
        lod: level of detail of a scene that has several, from 0, the finest; None for that of the source, or
            the default of its format.

    Returns:
        The Gaussians as float32 in the order of the files, and notes on what these held.

    Raises:
        SceneError: if a file is of no known format, is damaged, or no row of it can be drawn; if an
            encoding is given for a format that has a fixed one, a level for a scene without levels, or a
            moment for a scene at rest.
    """
    encoding = encoding or STANDARD
    gaussians, notes = read_files(open_files(scene, lod, encoding), encoding)
    return gaussians, replace(notes, camera_folders=SceneSource.of(scene).camera_folders())


def read_files(files: Sequence[SceneFile], encoding: Encoding = STANDARD) -> tuple[Gaussians, LoadNotes]:
    """The same, of files whose headers were read by `open_files` with this encoding."""
    for file in files:
        if file.has_fixed_encoding and not encoding.is_standard:
            raise SceneError(file.path, f"is a {file.format}, whose encoding is fixed; omit the encoding")
    parts, rows_dropped = [], 0
    for file in files:
        columns, dropped = file.read_columns(encoding)
        dropped.report(file.path, file.num_rows)
        rows_dropped += dropped.num_rows
        if encoding.is_standard and not file.has_fixed_encoding:
            warn_of_other_encoding(file.path, columns)
        parts.append(columns)
    if len(parts) == 1:
        drop_unnamed_brushes(files[0], parts[0])
    elif strokes := [file.path for file, part in zip(files, parts, strict=True) if part.brushes is not None]:
        why = "as several files are painted with one set of brushes"
        message = f"the brushes of its strokes are dropped, {why}"
        warnings.warn(SceneWarning(f"{strokes[0]}: {message}"), stacklevel=2)
    columns = Columns.joined(parts)
    notes = join_notes(files, rows_dropped=rows_dropped, sh_degree_used=SH_TERMS[columns.sh.shape[1]])
    return columns.gaussians(antialiased=notes.training == "antialiased"), notes


def read_raw_parts(scene: SceneFiles, lod: int | None = None) -> list[tuple[Columns, SceneFile]]:
    """Read all rows of a scene as stored, neither checked nor decoded. Takes the same as `read_scene`.

    Returns:
        Of each file log-scales, logits and all bands of spherical harmonics, if it follows the standard
        layout; and what its header states.

    Raises:
        SceneError: if a file is of no known format or is damaged.
    """
    return [(file.read_columns(is_raw=True)[0], file) for file in open_files(scene, lod)]


def open_files(scene: SceneFiles, lod: int | None, encoding: Encoding = STANDARD) -> list[SceneFile]:
    """Read the headers of all files: what is wrong with one is said before the first is read.

    Takes and raises the same as `read_scene`. A moment of a moving scene is one file.
    """
    source = SceneSource.of(scene, lod=lod)
    moment = open_moment(source, encoding)
    if moment is not None:
        return [moment]
    return [open_file(path, source.lod) for path in find_parts(source.paths)]
