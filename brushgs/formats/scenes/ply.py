"""Trained 3D Gaussian scenes in PLY files, in any of their layouts.

Two layouts are read: Inria's (properties in any order and of any scalar type, spherical harmonics of degree
0 to 3, with or without normals, ASCII or binary of either byte order), and the compressed one of PlayCanvas
and SuperSplat.
"""

from collections.abc import Collection
from pathlib import Path

from brushgs.errors import NoGaussiansError, SceneError
from brushgs.formats.files import open_plain
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.fill import RowSource
from brushgs.formats.scenes.ply_compressed import (
    PACKED,
    check_compressed,
    is_compressed,
    open_compressed,
    read_compressed,
)
from brushgs.formats.scenes.ply_header import BRUSH, Element, Header, parse_header
from brushgs.formats.scenes.ply_inria import (
    FILTER_3D,
    check_inria,
    has_brushes,
    is_flat,
    open_inria,
    read_columns_of,
    read_inria,
)
from brushgs.formats.scenes.ply_rows import warn_of_surplus
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.formats.scenes.stored import read_stored
from brushgs.formats.scenes.view_comments import read_comments
from brushgs.values.notes import Training

_MEANINGLESS = ("nx", "ny", "nz")  # Gaussians have no normals: trainers write zeros for viewers of points
_ENCODINGS = {
    "ascii": "ASCII",
    "binary_little_endian": "binary little-endian",
    "binary_big_endian": "binary big-endian",
}


def open_scene(path: Path) -> SceneFile:
    """Read the header of a PLY file.

    Raises:
        SceneError: if it is damaged or describes no 3D Gaussian scene.
    """
    with open_plain(path, "PLY file", buffering=0) as file:
        header = parse_header(file, path)
        size = file.seek(0, 2)
    vertex = header.find("vertex")
    if vertex is None:
        names = ", ".join(element.name for element in header.elements) or "none"
        raise SceneError(path, f"has no element 'vertex' among: {names}; export it as a 3D Gaussian scene")
    if vertex.count == 0:
        raise NoGaussiansError(
            path, "holds no Gaussians: its header says 'element vertex 0'; export the scene again"
        )
    has_chunks = is_compressed(header)
    check = check_compressed if has_chunks else check_inria
    num_terms = check(path, header, vertex)

    def read_columns(*, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
        source = path, header, vertex, num_terms, size
        if has_chunks:
            columns, dropped = read_compressed(*source, stored, is_raw=is_raw)
        else:
            columns, dropped = read_inria(*source, encoding=encoding, is_raw=is_raw)
        warn_of_surplus(path, header, size)
        return columns, dropped

    def open_rows() -> RowSource:
        warn_of_surplus(path, header, size)
        return (open_compressed if has_chunks else open_inria)(path, header, vertex, num_terms, size)

    stored = read_stored(path, lambda: read_comments(header.view_text))
    known = PACKED if has_chunks else read_columns_of(num_terms) | ({BRUSH} if has_brushes(vertex) else set())
    layout = "compressed PLY" if has_chunks else "PLY"
    return SceneFile(
        path=path,
        format=f"{layout}, {_ENCODINGS[header.encoding]}",
        num_rows=vertex.count,
        num_terms=num_terms,
        read_columns=read_columns,
        has_fixed_encoding=has_chunks,
        up=header.up,
        is_strokes=header.is_strokes,
        training=_training(header, vertex),
        unknown=_unknown(vertex, known),
        scene=stored.scene,
        first_view=stored.first_view,
        brushes=stored.brushes,
        open_rows=open_rows,
    )


def _training(header: Header, vertex: Element) -> Training:
    """How the scene was trained: what the comments state, else what the columns show."""
    if is_flat(header, vertex):
        return "2dgs"
    return header.training or ("antialiased" if FILTER_3D in vertex.names else "default")


def _unknown(vertex: Element, known: Collection[str]) -> tuple[str, ...]:
    """The columns that are not read, but for those that mean nothing in a scene."""
    names = (*vertex.names, *vertex.lists)
    return tuple(name for name in names if name not in known and name not in _MEANINGLESS)
