"""Gaussians become an SPZ file of version 3, which both the readers of 2025 and those of version 4 take.

Version 2 stores rotations to about a degree and has no other merit; version 4 packs with zstd, which few
readers unpack. The layout, its constants and its source are those of `spz_container` and `spz_decode`. The
axes are written as they are. Rows keep their order, but for strokes with brushes, which are sorted by these.
"""

import gzip
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import replacing
from brushgs.formats.scenes.spz import COLOR_SCALE, LOG_SCALE_STEPS, LOWEST_LOG_SCALE, SH_ZERO
from brushgs.formats.scenes.spz_container import MAX_FRACTIONAL_BITS, Header, notes_record, pack_stream
from brushgs.formats.scenes.stored import NOTHING, Stored, content_of, text_of
from brushgs.formats.scenes.write import brush_order, logs_of, rounded, unit_quats
from brushgs.values.gaussians import Gaussians

_VERSION = 3
_LARGEST_POSITION = (1 << 23) - 1  # 24 bits with a sign
_USUAL_BITS = 12  # fractional ones, as most files have
# Steps across the middle 96 % of a scene: a tenth of a pixel of a picture 10,000 pixels wide.
_STEPS = 100_000
_PACKING = 6  # of gzip: 9 takes three times as long for 1 % less


def write_scene(
    gaussians: Gaussians,
    path: str | Path,
    known: Stored = NOTHING,
) -> NDArray[np.int64] | None:
    """Write a gzip stream of header, blocks and, where there is something to record, an extension.

    `known` is what is recorded. Scales are clipped to exp(-10) to exp(5.94) units,
    colours to -0.44 to 1.44, harmonics to -1 to 1. Positions have as many fractional bits as the extent of
    the scene asks for and its farthest centre leaves room for.

    Returns:
        The rows in the order of the file; None if it is theirs, or recorded.

    Raises:
        ValueError: if a centre is farther away than 24 bits hold, or the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    order = brush_order(gaussians)
    rows = gaussians if order is None else gaussians.take(order)
    stored = known.sorted_by(rows, order)._replace(antialiased=False)  # which a flag says
    content = content_of(stored)
    extensions = notes_record(text_of(content).encode("ascii")) if content else b""
    bits = _fractional_bits(rows)
    header = Header.of(
        _VERSION,
        len(rows),
        rows.sh_degree,
        bits,
        is_antialiased=gaussians.antialiased,
        has_extensions=bool(extensions),
    )
    positions = np.rint(rows.means.astype(np.float64) * 2.0**bits).astype("<i4")
    blocks: list[NDArray[Any]] = [
        positions.view(np.uint8).reshape(-1, 4)[:, :3],
        rounded(rows.opacities * 255.0, 255),
        rounded((rows.sh[:, 0] * COLOR_SCALE + 0.5) * 255, 255),
        rounded((logs_of(rows.scales) - LOWEST_LOG_SCALE) * LOG_SCALE_STEPS, 255),
        _pack_smallest_three(rows),
        rounded(rows.sh[:, 1:] * float(SH_ZERO) + SH_ZERO, 255),
    ]
    data = pack_stream(header, [block.astype(np.uint8) for block in blocks], extensions)
    with replacing(path) as temporary:
        temporary.write_bytes(gzip.compress(data, _PACKING, mtime=0))
    return order if stored.order is None else None


def _fractional_bits(gaussians: Gaussians) -> int:
    """As many as the middle of the scene asks for, at least the usual ones, if its ends leave the room."""
    farthest = float(np.abs(gaussians.means).max())
    if farthest > _LARGEST_POSITION:
        raise ValueError(
            f"save: means must lie within {_LARGEST_POSITION:,} units in an SPZ file, got {farthest:.4g}; "
            "prune what lies far away, or write a .ply"
        )
    low, high = np.percentile(gaussians.means.astype(np.float64), (2, 98), axis=0)
    extent = float((high - low).max())
    wanted = int(np.ceil(np.log2(_STEPS / extent))) if extent > 0 else MAX_FRACTIONAL_BITS
    room = int(np.floor(np.log2(_LARGEST_POSITION / farthest))) if farthest > 0 else MAX_FRACTIONAL_BITS
    return max(0, min(max(wanted, _USUAL_BITS), room, MAX_FRACTIONAL_BITS))


def _pack_smallest_three(gaussians: Gaussians) -> NDArray[np.uint8]:
    """[n, 4] bytes: the inverse of `spz_decode._unpack_smallest_three`."""
    units = unit_quats(gaussians.quats)[:, [1, 2, 3, 0]]  # x, y, z, w
    largest = np.abs(units).argmax(axis=1)
    units *= np.where(np.take_along_axis(units, largest[:, None], 1) < 0, -1, 1)
    others = units[np.arange(4) != largest[:, None]].reshape(-1, 3)
    magnitudes = rounded(np.abs(others) / np.sqrt(0.5) * 511, 511).astype(np.uint32)
    parts = magnitudes | ((others < 0) & (magnitudes > 0)).astype(np.uint32) << 9
    words = largest.astype(np.uint32) << 30 | parts[:, 0] << 20 | parts[:, 1] << 10 | parts[:, 2]
    return np.asarray(words, "<u4").view(np.uint8).reshape(-1, 4)
