"""The .splat format of early web viewers: rows of 32 bytes, no header, no spherical harmonics above degree 0.

Rotations are bytes, which readers decode as (b - 128) / 128 or as b / 127.5 - 1. The first is used here: the
format's own viewer uses it, it has an exact zero, and in two of three files at hand it gives quaternion
lengths nearest to 1. The other differs by at most 0.3 degrees. Written files hold the rows in their order and
record nothing else.
Source: https://github.com/antimatter15/splat.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import open_plain, read_exactly, replacing
from brushgs.formats.format import SPLAT_ROW_SIZE
from brushgs.formats.scenes.columns import Columns, Encoding, check_decoded_size
from brushgs.formats.scenes.rows import Decoder, RowSource, SceneFile
from brushgs.formats.scenes.stored import NOTHING, Stored
from brushgs.formats.scenes.write import finite_scales, rounded
from brushgs.options.table import listed
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized
from brushgs.values.sh import C0

QUAT_ZERO = 128  # the byte that encodes 0, and the number of steps from 0 to 1
_BLOCK_ROWS = 4096
_ENCODING = Encoding(scales="linear", colors="byte")


def open_scene(path: Path) -> SceneFile:
    """Count the rows of a .splat file.

    Raises:
        SceneError: if the file size is no multiple of the row size.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        size = file.seek(0, 2)
    num_rows, surplus = divmod(size, SPLAT_ROW_SIZE)
    if surplus:
        rule = f"the bytes of a .splat scene must be a multiple of {SPLAT_ROW_SIZE}, got {size}"
        raise SceneError(path, f"{rule}; it is cut off or of another format: copy or download it again")
    check_decoded_size(path, num_rows, 1, size)
    return SceneFile(path, ".splat", num_rows, 1, partial(_open_rows, path, num_rows))


def _open_rows(path: Path, num_rows: int) -> RowSource:
    """See `SceneFile.open_rows`."""

    @contextmanager
    def open_decoder() -> Iterator[Decoder]:
        with open_plain(path, buffering=0) as file:
            buffer = np.empty((_BLOCK_ROWS, SPLAT_ROW_SIZE // 4), "<f4")

            def decode(start: int, stop: int, out: Columns) -> None:
                rows = buffer[: stop - start]
                read_exactly(path, file, start * SPLAT_ROW_SIZE, memoryview(rows.data).cast("B"))
                for axis in range(3):  # one column at a time: inner loops of length 3 take twice as long
                    out.means[:, axis] = rows[:, axis]
                    out.scales[:, axis] = rows[:, 3 + axis]
                rgba, quats = (np.ascontiguousarray(rows[:, i]).view(np.uint8).reshape(-1, 4) for i in (6, 7))
                out.sh[:, 0] = rgba[:, :3]
                np.divide(rgba[:, 3], np.float32(255), out=out.opacities)
                np.subtract(quats, np.float32(QUAT_ZERO), out=out.quats)
                out.quats *= np.float32(1 / QUAT_ZERO)

            yield decode

    return RowSource(num_rows, 1, open_decoder, _BLOCK_ROWS, _ENCODING)


_ROW = np.dtype([("means", "<f4", 3), ("scales", "<f4", 3), ("rgba", "u1", 4), ("quats", "u1", 4)])
_WRITTEN_ROWS = 1 << 16


def write_scene(gaussians: Gaussians, path: str | Path, known: Stored = NOTHING) -> None:
    """Write rows of 32 bytes; `known` is not recorded.

    A SceneWarning names lost data that matters to a painting. Colors are clipped to 0 to 1.

    Raises:
        SceneError: if the file cannot be written.
    """
    assert _ROW.itemsize == SPLAT_ROW_SIZE
    with replacing(path) as temporary, temporary.open("wb") as file:
        for start in range(0, len(gaussians), _WRITTEN_ROWS):
            file.write(_encode(gaussians.take(slice(start, start + _WRITTEN_ROWS))))
    lost = [
        *(["colors that change with the view"] if gaussians.sh.shape[1] > 1 else []),
        *(["that they are strokes"] if known.is_strokes else []),
        *(["brushes"] if gaussians.brushes is not None else []),
        *(["that they are antialiased"] if gaussians.antialiased else []),
    ]
    if lost:
        message = f"a .splat file does not hold {listed(lost)}, which are lost; .ply, .spz and .sog do"
        warnings.warn(SceneWarning(f"{path}: {message}"), stacklevel=3)


def _encode(gaussians: Gaussians) -> bytes:
    """Encode Gaussians as the bytes of rows."""
    rows = np.empty(len(gaussians), _ROW)
    rows["means"] = gaussians.means
    rows["scales"] = finite_scales(gaussians.scales)
    rows["rgba"][:, :3] = rounded((gaussians.sh[:, 0] * C0 + 0.5) * 255, 255)
    rows["rgba"][:, 3] = rounded(gaussians.opacities * 255, 255)
    rows["quats"] = rounded(normalized(gaussians.quats) * QUAT_ZERO + QUAT_ZERO, 255)
    return rows.tobytes()
