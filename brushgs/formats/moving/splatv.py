"""Read the .splatv format of the splaTV viewer: a JSON header, then 64 bytes per Gaussian.

Time is 0 to 1. A width above the largest half, 65,504, is stored as infinity: such a row never fades, as the
viewer divides by the width. Source: https://github.com/antimatter15/splaTV, hybrid.js.
"""

from pathlib import Path
from typing import Annotated, Any, BinaryIO

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import cut_off, open_plain, read_exactly
from brushgs.formats.moving.formula import RawRows, clip_of, open_nothing
from brushgs.formats.scenes.columns import Columns, Encoding
from brushgs.formats.scenes.rows import SceneFile
from brushgs.formats.schema import decode, shown
from brushgs.values.moving import MovingScene

_MAX_HEADER = 1 << 24  # bytes of the JSON; a file with one camera has 452
_MAX_SIZE = 1 << 50  # bytes of a texture, as stated in the JSON
# A row: position, quaternion w, x, y, z, scales and a zero, red, green, blue and opacity, nine coefficients
# of motion and a zero, four of rotation, center, width. Halves and bytes are packed low half first.
_STILL = [("means", "<f4", 3), ("quats", "<f2", 4), ("scales", "<f2", 3), ("zero", "<f2"), ("rgba", "u1", 4)]
_MOVED = [("motion", "<f2", (3, 3)), ("zeros", "<f2"), ("spin", "<f2", 4)]
_TIMED = [("center", "<f2"), ("width", "<f2")]
_ROW = np.dtype(_STILL + _MOVED + _TIMED)
assert _ROW.itemsize == 64
_ENCODING = Encoding(scales="linear", colors="byte")
_CURE = "export it again"
_Count = Annotated[int, Meta(ge=0, le=_MAX_SIZE)]


class _Chunk(Struct):
    """A chunk of the file, as listed in the header."""

    size: _Count
    type: Any = None
    texwidth: _Count | None = None


def open_moving(path: Path) -> MovingScene:
    """Read a .splatv file. Raises SceneError if it is damaged or truncated, or no row can be drawn."""
    with open_plain(path, "scene file", buffering=0) as file:
        rows = _read_rows(path, file)
    rows = rows[: _count_filled(rows)]
    if len(rows) == 0:
        raise SceneError(path, "holds no Gaussians; export it again")
    columns = Columns.empty(len(rows), 1)
    columns.means[:], columns.quats[:] = rows["means"], rows["quats"]
    scales = rows["scales"].astype(np.float32)
    columns.scales[:] = scales
    columns.sh[:, 0] = rows["rgba"][:, :3]
    columns.opacities[:] = rows["rgba"][:, 3] / np.float32(255)
    columns.standardize(_ENCODING)
    motion, spin = rows["motion"].astype(np.float32), rows["spin"].astype(np.float32)
    centers, widths = rows["center"].astype(np.float32), np.abs(rows["width"].astype(np.float64))
    stored = {f"motion_{index}": motion[:, index // 3, index % 3] for index in range(9)}
    stored |= {f"omega_{index}": spin[:, index] for index in range(4)} | {"trbf_center": centers}
    source = SceneFile(path, "splaTV", len(rows), 1, open_nothing)
    raw = RawRows(columns, stored, centers, widths, "trbf_scale", motion, spin, scales=scales, is_logit=False)
    return clip_of(source, raw)


def _read_rows(path: Path, file: BinaryIO) -> NDArray[np.void]:
    """All rows of the file, including padding at the end of its texture."""
    size = file.seek(0, 2)
    start, chunk = _find_texture(path, file, size)
    if chunk.texwidth is None:
        raise SceneError(path, f"its header states no texwidth of the chunk of type 'splat'; {_CURE}")
    stated, texture_row = chunk.size, 16 * chunk.texwidth
    there = min(size - start, stated)
    # Files may end after the last Gaussian, within the last row of the texture, or hold the whole texture.
    if there < stated and (there + texture_row <= stated or there % _ROW.itemsize):
        missing = stated - texture_row + 1 - there
        fact = f"{missing} bytes are missing at least" if missing > 0 else "its last Gaussian is not complete"
        raise cut_off(path, fact)
    rows = np.empty(max(there, 0) // _ROW.itemsize, _ROW)
    read_exactly(path, file, start, memoryview(rows.view(np.uint8).data))
    return rows


def _find_texture(path: Path, file: BinaryIO, size: int) -> tuple[int, _Chunk]:
    """Offset of the texture of Gaussians, and its chunk in the header."""
    begin = bytearray(8)
    if size < len(begin):
        raise cut_off(path, f"{size} bytes are there")
    read_exactly(path, file, 0, memoryview(begin))
    length = int.from_bytes(begin[4:], "little")
    start = len(begin) + length
    if length > _MAX_HEADER or start > size:
        raise cut_off(path, f"its header has {length} bytes, the file {size}")
    content = bytearray(length)
    read_exactly(path, file, len(begin), memoryview(content))
    chunks = decode(path, bytes(content), list[_Chunk], "copy or download it again", root="header")
    for chunk in chunks:
        if chunk.type == "splat":
            return start, chunk
        start += chunk.size
    found = shown([chunk.type for chunk in chunks])
    raise SceneError(path, f"its header names no chunk of type 'splat', got {found}; {_CURE}")


def _count_filled(rows: NDArray[np.void]) -> int:
    """Number of rows without the zero padding at the end of the texture."""
    filled = np.flatnonzero(rows.view("<u8").reshape(len(rows), -1).any(axis=1))
    return int(filled[-1]) + 1 if len(filled) else 0
