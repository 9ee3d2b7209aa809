"""The .splat format of early web viewers: rows of 32 bytes, no header, no spherical harmonics above degree 0.

Rotations are bytes, and readers differ in what they mean: (b - 128) / 128 or b / 127.5 - 1. The first is read
here: it is what the format's own viewer reads, it has an exact zero, and in two of three files at hand it
leaves the lengths of the quaternions nearest to 1. The other differs by at most 0.3 degrees.
Source: https://github.com/antimatter15/splat.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.format import SPLAT_ROW_SIZE
from brushgs.formats.scenes.columns import Columns, check_decoded_size
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.fill import Decoder, RowSource
from brushgs.formats.scenes.scene_file import SceneFile

QUAT_ZERO = 128  # the byte that stands for 0, and the steps from there to 1
_BLOCK_ROWS = 4096
_ENCODING = Encoding(scales="linear", colors="byte")


def open_scene(path: Path) -> SceneFile:
    """Count the rows of a .splat file.

    Raises:
        SceneError: if its size is that of no whole rows.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        size = file.seek(0, 2)
    if size % SPLAT_ROW_SIZE:
        fact = f"got {size}, {size % SPLAT_ROW_SIZE} more than whole Gaussians take"
        rule = f"the bytes of a .splat scene must be a multiple of {SPLAT_ROW_SIZE}, {fact}"
        raise SceneError(path, f"{rule}; it is cut off or of another format: copy or download it again")
    check_decoded_size(path, size // SPLAT_ROW_SIZE, 1, size)
    return SceneFile(
        path=path,
        format=".splat",
        num_rows=size // SPLAT_ROW_SIZE,
        num_terms=1,
        read_columns=partial(_read_columns, path, size // SPLAT_ROW_SIZE),
        open_rows=partial(_open_rows, path, size // SPLAT_ROW_SIZE),
    )


def _read_columns(path: Path, num_rows: int, *, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
    """See `ColumnReader`."""
    columns, dropped = _open_rows(path, num_rows).read(Columns.empty(num_rows, 1), is_raw=is_raw)
    if is_raw:
        columns.standardize(replace(_ENCODING, opacities="linear"))
    return columns, dropped


def _open_rows(path: Path, num_rows: int) -> RowSource:
    """See `SceneFile`."""

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

    return RowSource(
        num_rows,
        1,
        open_decoder,
        block_rows=_BLOCK_ROWS,
        num_rest=0,
        is_sequential=False,
        is_logit=False,
        encoding=_ENCODING,
    )
