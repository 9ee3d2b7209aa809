"""Niantic's SPZ: a scene of about 10 times fewer bytes than PLY, of versions 1 to 4.

Positions have 24 bits an axis (half floats in version 1), everything else 8 bits a number and rotations 24 to
32 bits. The axes are read as they are stored: the specification says right-up-back, but many writers store
those of the PLY that they had, so up is stated only where an extension of the file names its axes.
Source: https://github.com/nianticlabs/spz.
"""

import warnings
from contextlib import nullcontext
from functools import partial
from pathlib import Path

from brushgs.errors import SceneWarning
from brushgs.formats.files import open_plain
from brushgs.formats.scenes.columns import Columns, check_decoded_size
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import STANDARD, Encoding
from brushgs.formats.scenes.fill import RowSource
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.spz_container import (
    NUM_HEADER_BYTES,
    Blocks,
    Header,
    read_blocks,
    read_extensions,
    read_header,
)
from brushgs.formats.scenes.spz_decode import count_used_terms, decode
from brushgs.formats.scenes.spz_extensions import Extensions
from brushgs.formats.scenes.stored import Stored, parse_text, read_stored

_BLOCK_ROWS = 4096
# Trained scenes take 4 to 20 times their bytes in memory; a scene of equal Gaussians compresses better.
_MAX_GROWTH = 100


def open_scene(path: Path) -> SceneFile:
    """Read the header of an SPZ file.

    Raises:
        SceneError: if it is damaged, of an unknown version, or other data compressed with gzip.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        read_header(path, file.read(NUM_HEADER_BYTES))  # before a large file of another kind is read
        file.seek(0)
        return open_data(path, file.read())


def open_data(path: Path, data: bytes) -> SceneFile:
    """The same for the content of an SPZ file, which may be a part of another file.

    Args:
        path: of the file that holds it, for messages.
        data: its bytes.

    Raises:
        SceneError: as above.
    """
    header = read_header(path, data)
    check_decoded_size(
        path, header.num_rows, header.num_terms, len(data), row_size=header.row_size, max_growth=_MAX_GROWTH
    )
    extensions = read_extensions(path, data, header)
    unknown = extensions.unknown
    stored = read_stored(path, lambda: parse_text(extensions.notes))
    if header.sh_degree > header.used_degree:
        unknown = (f"spherical harmonics of degree {header.sh_degree}", *unknown)
    return SceneFile(
        path=path,
        format=f"SPZ, version {header.version}",
        num_rows=header.num_rows,
        num_terms=header.num_terms,
        read_columns=partial(_read_columns, path, data, header, extensions, stored),
        up=extensions.up,
        training="antialiased" if header.is_antialiased else "default",
        unknown=unknown,
        is_strokes=stored.is_strokes,
        scene=stored.scene,
        first_view=stored.first_view,
        brushes=stored.brushes,
        open_rows=partial(_open_rows, path, data, header, extensions),
    )


def _read_columns(
    path: Path,
    data: bytes,
    header: Header,
    extensions: Extensions,
    stored: Stored,
    *,
    encoding: Encoding,
    is_raw: bool,
) -> tuple[Columns, Dropped]:
    """See `ColumnReader`."""
    blocks, surplus = read_blocks(path, data, header)
    num_terms = header.num_terms if is_raw else count_used_terms(blocks.sh, header.num_terms)
    empty = Columns.empty(header.num_rows, num_terms)
    empty.brushes = stored.rows_of_brushes(header.num_rows)
    columns, dropped = _rows_of(blocks, header, extensions).read(empty, is_raw=is_raw)
    if is_raw:
        columns.standardize(Encoding(opacities="linear"))
    if surplus:
        _warn_of_surplus(path, surplus)
    return stored.in_order(columns), dropped


def _open_rows(path: Path, data: bytes, header: Header, extensions: Extensions) -> RowSource:
    """See `SceneFile`: the bytes of the whole file are decompressed, 19 to 64 a Gaussian."""
    blocks, surplus = read_blocks(path, data, header)
    if surplus:
        _warn_of_surplus(path, surplus)
    return _rows_of(blocks, header, extensions)


def _rows_of(blocks: Blocks, header: Header, extensions: Extensions) -> RowSource:
    return RowSource(
        header.num_rows,
        header.num_terms,
        lambda: nullcontext(partial(decode, blocks, header, extensions.is_mirrored)),
        block_rows=_BLOCK_ROWS,
        num_rest=header.num_terms - 1,
        is_sequential=False,
        is_logit=False,
        encoding=STANDARD,
        is_whole=True,
    )


def _warn_of_surplus(path: Path, surplus: int) -> None:
    message = f"{path}: {surplus} bytes after the last Gaussian were ignored"
    warnings.warn(SceneWarning(f"{message}; if the picture looks wrong, copy it again"), stacklevel=4)
