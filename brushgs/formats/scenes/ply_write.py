"""Write Gaussians as a PLY file, in the standard layout, which every 3DGS program reads, or compressed.

The compressed layout of PlayCanvas and SuperSplat takes 16 bytes a Gaussian, in chunks of 256; see `ply` for
its constants and source. Its rows are sorted along a space-filling curve, so that the rows of a chunk are
near each other.
"""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing
from brushgs.formats.scenes.ply import AXES, CHUNK_ROWS, FOUR, PACKED, SH_RANGE, SMALL_BITS, THREE
from brushgs.formats.scenes.ply_header import BRUSH, MIP, STROKES, comment_lines
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.formats.scenes.write import (
    in_order,
    logits_of,
    logs_of,
    rounded,
    shares_of,
    smallest_three,
    spatial_order,
)
from brushgs.values.arrays import F32, U8, U32, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

_BLOCK_ROWS = 1 << 14


def write_scene(gaussians: Gaussians, path: str | Path, known: Stored = NOTHING) -> None:
    """Write Gaussians as binary little-endian float32, with log-scales and opacity logits.

    Values are read back within the float32 rounding of the logs. No infinity is written: a scale of 0 and
    opacities of 0 and 1 become finite logs that are read back as exactly 0 and 1. A comment, worded as by
    Brush, marks antialiased Gaussians. Brushes of strokes are bytes in the last column, `brush`.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    names = _names(gaussians.sh.shape[1])
    properties = [f"float {name}" for name in names] + [f"uchar {BRUSH}"] * (gaussians.brushes is not None)
    starts = range(0, len(gaussians), _BLOCK_ROWS)
    blocks = (_encode(gaussians.take(slice(start, start + _BLOCK_ROWS)), len(names)) for start in starts)
    _write(path, known, [("vertex", len(gaussians), properties, blocks)])


_Element = tuple[str, int, Sequence[str], Iterable[bytes]]  # name, rows, types and names of columns, content


def _write(path: str | Path, known: Stored, elements: Sequence[_Element]) -> None:
    header = f"ply\nformat binary_little_endian 1.0\n{header_comments(known)}"
    for name, count, properties, _ in elements:
        header += f"element {name} {count}\n" + "".join(f"property {column}\n" for column in properties)
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(f"{header}end_header\n".encode("ascii"))
        for *_, blocks in elements:
            file.writelines(blocks)


def header_comments(known: Stored) -> str:
    """Comment lines that record `known`, each with a newline."""
    texts = [STROKES] * known.is_strokes + [MIP] * known.antialiased
    others = comment_lines(known._replace(is_strokes=False, antialiased=False))
    return "".join(f"{line}\n" for line in [*(f"comment {text}" for text in texts), *others])


def _names(num_terms: int) -> tuple[str, ...]:
    """Names of the properties in standard order."""
    rest = (f"f_rest_{index}" for index in range(3 * (num_terms - 1)))
    head = ("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2")
    tail = ("opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")
    return (*head, *rest, *tail)


def _encode(gaussians: Gaussians, width: int) -> bytes:
    """Encode Gaussians as the bytes of rows."""
    num_rows, num_rest = len(gaussians), 3 * (gaussians.sh.shape[1] - 1)
    rows = np.zeros((num_rows, width), dtype="<f4")  # normals stay 0: Gaussians have none
    rows[:, 0:3] = gaussians.means
    rows[:, 6:9] = gaussians.sh[:, 0]
    rows[:, 9 : 9 + num_rest] = gaussians.sh[:, 1:].transpose(0, 2, 1).reshape(num_rows, num_rest)
    rows[:, -8] = logits_of(gaussians.opacities)
    rows[:, -7:-4] = logs_of(gaussians.scales)
    # Scaled to the range of float32: the length of a quaternion has no meaning.
    quats, is_single = gaussians.quats, gaussians.quats.dtype == np.float32
    rows[:, -4:] = quats if is_single else quats / np.abs(quats).max(axis=1, keepdims=True)
    if gaussians.brushes is None:
        return rows.tobytes()
    return np.hstack([rows.view(np.uint8), gaussians.brushes[:, None]]).tobytes()


_LARGEST_LOG = 20.0  # largest log-scale: some readers clip there


@in_order(spatial_order)
def write_compressed(rows: Gaussians, path: str | Path, known: Stored) -> None:
    """Write chunks, packed rows and 8-bit spherical harmonics, with comments as in a standard PLY.

    Scales are clipped to exp(-20) to exp(20) units, harmonics to -4 to 4.

    Raises:
        ValueError: if the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    columns = {
        "position": rows.means.astype(np.float32),
        "scale": np.clip(logs_of(rows.scales), -_LARGEST_LOG, _LARGEST_LOG).astype(np.float32),
        "color": (rows.sh[:, 0] * C0 + 0.5).astype(np.float32),
    }
    ranges = {name: _ranges(column) for name, column in columns.items()}
    of_row = np.arange(len(rows)) // CHUNK_ROWS
    inside = {
        name: shares_of(column, *(end[of_row] for end in ranges[name])) for name, column in columns.items()
    }
    packed = np.empty(len(rows), [(name, "<u4") for name in PACKED])
    packed["packed_position"] = _pack(inside["position"], THREE)
    packed["packed_rotation"] = _pack_quats(rows.quats)
    packed["packed_scale"] = _pack(inside["scale"], THREE)
    packed["packed_color"] = _pack(np.column_stack([inside["color"], rows.opacities]), FOUR)
    chunks = np.concatenate([end for name in AXES for end in ranges[name]], axis=1).astype("<f4")
    ends = [f"float {end}_{axis}" for axes in AXES.values() for end in ("min", "max") for axis in axes]
    elements: list[tuple[str, list[str], NDArray[Any]]] = [
        ("chunk", ends, chunks),
        ("vertex", [f"uint {name}" for name in PACKED], packed),
    ]
    if num_rest := 3 * (rows.sh.shape[1] - 1):
        elements.append(("sh", [f"uchar f_rest_{index}" for index in range(num_rest)], _pack_rest(rows.sh)))
    _write(path, known, [(name, len(values), kinds, [values.tobytes()]) for name, kinds, values in elements])


def _ranges(column: F32) -> tuple[F32, F32]:
    """Smallest and largest value of each chunk, [chunks, 3] each."""
    starts = np.arange(0, len(column), CHUNK_ROWS)
    return np.minimum.reduceat(column, starts), np.maximum.reduceat(column, starts)


def _pack(fractions: Array, bits: tuple[int, ...]) -> U32:
    """Pack [n, len(bits)] fractions, 0 to 1, to [n] words, from the highest bits down."""
    words = np.zeros(len(fractions), np.int64)
    for index, width in enumerate(bits):
        largest = (1 << width) - 1
        words = words << width | rounded(fractions[:, index] * largest, largest)
    return words.astype(np.uint32)


def _pack_quats(quats: Array) -> U32:
    """Pack quaternions: upper two bits the index of the largest of w, x, y, z, then the others in order."""
    largest, others = smallest_three(quats)
    return np.asarray(largest.astype(np.uint32) << 30 | _pack(others * np.sqrt(0.5) + 0.5, SMALL_BITS))


def _pack_rest(sh: Array) -> U8:
    """[n, 3 x terms] f_rest as bytes, channel by channel: the range is divided into 256 equal parts."""
    rest = sh[:, 1:].transpose(0, 2, 1).reshape(len(sh), -1)
    return np.asarray(np.clip(np.floor((rest / SH_RANGE + 0.5) * 256), 0, 255)).astype(np.uint8)
