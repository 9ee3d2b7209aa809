"""Read trained 3D Gaussian scenes from PLY files, in both layouts.

The layouts are Inria's, see `ply_inria`, and the compressed one of PlayCanvas and SuperSplat: 16 bytes a
Gaussian, in chunks of 256. A chunk stores the smallest and largest position, log-scale and (in later files)
color of its Gaussians; each Gaussian stores fractions between them, in 11 + 10 + 11 bits (position and
log-scale) or 8 bits (color), its opacity in 8 bits and its rotation as the three smaller components of the
quaternion in 10 bits each. An optional element `sh` holds f_rest in 8 bits. The layout is defined by the
PlayCanvas engine and splat-transform.
"""

import warnings
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import NoGaussiansError, SceneError, SceneWarning
from brushgs.formats.files import open_plain
from brushgs.formats.scenes import ply_header, ply_inria
from brushgs.formats.scenes.columns import STANDARD, Columns, Encoding, check_decoded_size, unpack_quats
from brushgs.formats.scenes.ply_header import Element, Header
from brushgs.formats.scenes.rows import Decoder, RowSource, SceneFile
from brushgs.formats.scenes.stored import parse_text, read_stored
from brushgs.options.table import hint_for
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import Camera
from brushgs.values.notes import Training
from brushgs.values.sh import C0

PACKED = ("packed_position", "packed_rotation", "packed_scale", "packed_color")
# The values whose range a chunk stores -> their axes.
AXES = {"position": ("x", "y", "z"), "scale": ("scale_x", "scale_y", "scale_z"), "color": ("r", "g", "b")}
CHUNK_ROWS = 256
MOST_SHOWN = 20  # most column names in a message
_BLOCK_ROWS = 16 * CHUNK_ROWS
THREE, FOUR = (11, 10, 11), (8, 8, 8, 8)  # bits of a packed vector and of a packed color, from the highest
SMALL_BITS = (10, 10, 10)  # of the three smaller components of a rotation
SH_RANGE = 8.0  # f_rest is stored in -4 to 4


def check_compressed(path: Path, header: Header, vertex: Element) -> int:
    """The number of spherical-harmonic terms of each row. Raises SceneError if a property is missing."""
    for name in PACKED:
        if name not in vertex.names:
            raise SceneError(path, f"no property {name!r} among {len(vertex.names)} read; export it again")
    rest = header.find("sh")
    return 1 if rest is None else ply_inria.count_terms(path, rest)


def open_compressed(path: Path, header: Header, vertex: Element, num_terms: int, size: int) -> RowSource:
    """The rows of element `vertex` with their chunks; `size` is the file size in bytes.

    Raises SceneError if the file is cut off or chunks do not match the rows.
    """
    rest = header.find("sh") if num_terms > 1 else None
    for element in (vertex,) if rest is None else (vertex, rest):
        ply_header.check_size(path, header, element, size)
        if element.count != vertex.count:
            rule = f"must have {vertex.count} rows, got {element.count}"
            raise SceneError(path, f"element 'sh' {rule}; export it again")
    check_decoded_size(path, vertex.count, num_terms, size)
    ranges = _read_ranges(path, header, vertex.count, size)

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        with ExitStack() as stack:
            packed = stack.enter_context(ply_header.open_rows(path, header, vertex, _BLOCK_ROWS))
            if rest is not None:
                rest_rows = stack.enter_context(ply_header.open_rows(path, header, rest, _BLOCK_ROWS))

            def decode(start: int, stop: int, out: Columns) -> None:
                _decode(packed.read(start, stop), ranges, start, out)
                if header.training == "2dgs":
                    out.scales[:, 2] = -np.inf  # flat discs
                if rest is not None:
                    _decode_rest(rest_rows.read(start, stop), out.sh)

            yield decode

    return RowSource(vertex.count, num_terms, open_decoder, _BLOCK_ROWS, is_sequential=header.is_ascii)


def _read_ranges(path: Path, header: Header, num_rows: int, size: int) -> dict[str, tuple[F32, F32]]:
    """Smallest and largest position, scale and color of each chunk, by name; [chunks, 3] each."""
    chunk = header.find("chunk")
    assert chunk is not None
    if chunk.count * CHUNK_ROWS < num_rows:
        rule = f"must have a chunk for {CHUNK_ROWS} Gaussians, got {chunk.count} for {num_rows}"
        raise SceneError(path, f"{rule}; export again")
    ply_header.check_size(path, header, chunk, size)
    ends = {
        name: [[f"{end}_{axis}" for axis in axes] for end in ("min", "max")]
        for name, axes in AXES.items()
        if name != "color" or "min_r" in chunk.names  # earlier files have no range of colors: 0 to 1
    }
    for column in (column for pair in ends.values() for names in pair for column in names):
        if column not in chunk.names:
            raise SceneError(path, f"no property {column!r} in element 'chunk'; export it again")
    num_used = -(-num_rows // CHUNK_ROWS)
    with ply_header.open_rows(path, header, chunk, num_used) as reader:
        rows = reader.read(0, num_used)
    zeros = np.zeros((num_used, 3), np.float32)
    found = {name: (_column(rows, low), _column(rows, high)) for name, (low, high) in ends.items()}
    return {"color": (zeros, zeros + 1)} | found


def _column(rows: NDArray[np.void], names: list[str]) -> F32:
    """Columns as [rows, names]; numbers beyond float32 become infinity, detected when rows are checked."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([rows[name].astype(np.float32) for name in names], axis=1)


def _decode(rows: NDArray[np.void], ranges: dict[str, tuple[F32, F32]], start: int, out: Columns) -> None:
    """Decode some rows; the first is row `start` of the file."""
    position, rotation, scale, color = (rows[name].astype(np.uint32) for name in PACKED)
    chunks = np.arange(start, start + len(rows)) // CHUNK_ROWS
    out.means[:] = _between(ranges["position"], chunks, _unpack(position, THREE))
    out.scales[:] = _between(ranges["scale"], chunks, _unpack(scale, THREE))
    rgba = _unpack(color, FOUR)
    out.sh[:, 0] = (_between(ranges["color"], chunks, rgba[:, :3]) - 0.5) / C0
    out.opacities[:] = rgba[:, 3]
    # The upper two bits of a rotation are the index of its largest component.
    small = (_unpack(rotation & 0x3FFFFFFF, SMALL_BITS) - 0.5) * np.float32(np.sqrt(2))
    unpack_quats((rotation >> 30).astype(np.int8), small, out.quats)


def _unpack(packed: NDArray[np.integer[Any]], bits: tuple[int, ...]) -> F32:
    """Unpack [n] words to [n, len(bits)] fractions, 0 to 1, from the highest bits down."""
    fractions = np.empty((len(packed), len(bits)), np.float32)
    shift = sum(bits)
    for index, width in enumerate(bits):
        shift -= width
        largest = (1 << width) - 1
        fractions[:, index] = (packed >> shift & largest) / np.float32(largest)
    return fractions


def _between(limits: tuple[F32, F32], chunks: NDArray[np.integer[Any]], fractions: F32) -> F32:
    """Linear interpolation between the smallest and largest value of each chunk."""
    low, high = (end[chunks] for end in limits)
    return np.asarray(low * (1 - fractions) + high * fractions)


def _decode_rest(rows: NDArray[np.void], sh: F32) -> None:
    """Decode f_rest of some rows, stored channel by channel.

    The range is divided into 256 equal parts: a byte decodes to the middle of its part, 0 and 255 to the
    exact ends of the range.
    """
    values = (np.arange(256, dtype=np.float32) + 0.5) / 256
    values[[0, 255]] = 0, 1
    values = (values - 0.5) * SH_RANGE
    num_rest = sh.shape[1] - 1
    for channel in range(3):
        for term in range(num_rest):
            sh[:, 1 + term, channel] = values[rows[f"f_rest_{channel * num_rest + term}"].astype(np.uint8)]


_MEANINGLESS = ("nx", "ny", "nz")  # Gaussians have no normals: trainers write zeros for point viewers


def open_scene(path: Path) -> SceneFile:
    """Read the header of a PLY file.

    Raises:
        SceneError: if it is damaged or describes no 3D Gaussian scene.
    """
    header, size = ply_header.open_header(path)
    vertex = header.find("vertex")
    if vertex is None:
        names = ", ".join(element.name for element in header.elements) or "none"
        raise SceneError(path, f"has no element 'vertex' among: {names}; export it as a 3D Gaussian scene")
    if vertex.count == 0:
        fact = "holds no Gaussians: its header says 'element vertex 0'"
        raise NoGaussiansError(path, f"{fact}; export the scene again")
    has_chunks = header.find("chunk") is not None and PACKED[0] in vertex.names
    check = check_compressed if has_chunks else ply_inria.check_inria
    num_terms = check(path, header, vertex)

    def open_rows(encoding: Encoding = STANDARD) -> RowSource:
        source = path, header, vertex, num_terms, size
        rows = open_compressed(*source) if has_chunks else ply_inria.open_inria(*source, encoding)
        ply_header.warn_of_surplus(path, header, size)  # only if the file was not refused
        return rows

    stored = read_stored(path, lambda: parse_text("".join(header.view_text)))
    if not has_chunks:  # the standard layout keeps the order of rows and has a column of brushes
        stored = stored._replace(counts=None, order=None)
    photograph, elements = _photograph(path, header, size)
    known = PACKED if has_chunks else ply_inria.read_columns_of(num_terms, vertex)
    encoding = header.encoding.replace("ascii", "ASCII").replace("_endian", "-endian").replace("_", " ")
    name = f"{'compressed ' * has_chunks}PLY, {encoding}"
    return SceneFile(
        path,
        name,
        vertex.count,
        num_terms,
        open_rows,
        has_fixed_encoding=has_chunks,
        up=header.up,
        training=_training(header, vertex),
        unknown=(*_unknown(vertex, known), *elements),
        photograph=photograph,
        stored=stored._replace(is_strokes=header.is_strokes),
    )


def read_column(path: Path, name: str) -> tuple[F64, F64]:
    """Positions [N, 3] and the column `name` [N] of a PLY file, as float64.

    Raises:
        SceneError: if the file cannot be read, is no PLY file, or lacks the column; the message hints at a
            similar name or lists the columns.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        if file.read(3) != b"ply":
            raise SceneError(path, f"is no PLY file, so it has no column {name}; convert the scene to PLY")
    header, size = ply_header.open_header(path)
    vertex = header.find("vertex")
    names = () if vertex is None else vertex.names
    if vertex is None or name not in names or not {"x", "y", "z"} <= set(names):
        cure = hint_for(name, names) or f"; it has {', '.join(names[:MOST_SHOWN])}"
        raise SceneError(path, f"has no column {name!r} beside x, y and z{cure}")
    ply_header.check_size(path, header, vertex, size)
    *points, values = ply_header.read_columns(path, header, vertex, ("x", "y", "z", name), np.float64)
    return np.stack(points, axis=1), values


def _photograph(path: Path, header: Header, size: int) -> tuple[Camera | None, tuple[str, ...]]:
    """The camera of the photograph from which a scene was predicted, and the elements that are not read."""
    known, camera = {"vertex", "chunk", "sh"}, None
    if header.find("extrinsic") is not None:
        from brushgs.formats.cameras.photograph import COUNTS, camera_in
        from brushgs.formats.cameras.read import reason_of

        try:
            camera = camera_in(path, header, size)
        except SceneError as error:
            message = f"{path}: the camera of its photograph is not used: {reason_of(error)}"
            warnings.warn(SceneWarning(message), stacklevel=3)
        if camera is not None:
            known |= set(COUNTS)
    return camera, tuple(f"element {one.name}" for one in header.elements if one.name not in known)


def _training(header: Header, vertex: Element) -> Training:
    """How the scene was trained, from its comments or else from its columns."""
    if ply_inria.is_flat(header, vertex):
        return "2dgs"
    return header.training or ("antialiased" if ply_inria.FILTER_3D in vertex.names else "default")


def _unknown(vertex: Element, known: Collection[str]) -> tuple[str, ...]:
    """The columns that are not read, except normals, which have no meaning in a scene."""
    names = (*vertex.names, *vertex.lists)
    return tuple(name for name in names if name not in known and name not in _MEANINGLESS)
