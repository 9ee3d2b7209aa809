"""Niantic's SPZ, versions 1 to 4: about 10 times smaller than PLY.

Positions have 24 bits an axis (half floats in version 1), rotations 24 to 32 bits, all other numbers 8 bits;
each value is decoded to the float32 nearest to its definition. Axes are read as stored: the specification
says right-up-back, but many writers keep the axes of their PLY, so `up` is set only if an extension of the
file names the axes.

Version 3 is written, which readers of 2025 support: version 2 stores rotations to about a degree, and version
4 needs zstd, which few readers have. Rows keep their order, but strokes with brushes are sorted by brush.
Source: https://github.com/nianticlabs/spz.
"""

import gzip
import warnings
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneWarning
from brushgs.formats.files import open_plain, replacing
from brushgs.formats.scenes import spz_container as container
from brushgs.formats.scenes.columns import Columns, check_decoded_size, find_used_terms
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.formats.scenes.spz_container import MAX_FRACTIONAL_BITS, Blocks, Extensions, Header
from brushgs.formats.scenes.stored import Stored, content_of, parse_text, read_stored, text_of
from brushgs.formats.scenes.write import brush_order, in_order, logs_of, rounded, smallest_three
from brushgs.values.arrays import F32, U8, U32
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import sh_basis

_BYTES = np.arange(256)
_OPACITIES = (_BYTES / 255).astype(np.float32)
_COLOR_SCALE = 0.15  # factor of a coefficient of degree 0, before 0.5 is added
_LOWEST_LOG_SCALE, _LOG_SCALE_STEPS = -10, 16  # the log-scale of byte 0, and steps per unit of log-scale
# Bytes 0 to 255 are coefficients of -3.3 to 3.3, which are colors of -0.44 to 1.44.
_COLORS = ((_BYTES / 255 - 0.5) / _COLOR_SCALE).astype(np.float32)
_SH_ZERO = 128  # the byte of a spherical-harmonic coefficient of 0, and the number of steps from 0 to 1
_MAGNITUDES = np.arange(512) / 511 * np.sqrt(0.5)
# A component of 10 bits, of which the highest is the sign: only the largest can exceed 1/sqrt(2).
_COMPONENTS = np.concatenate([_MAGNITUDES, -_MAGNITUDES]).astype(np.float32)
_SOMEWHERE = np.array([[1, 2, 3]]) / np.sqrt(14)  # a direction in which no basis function is zero
# The sign change of each basis function when x is negated: 1 or -1.
_TURNED_X = np.sign(sh_basis(_SOMEWHERE * [-1, 1, 1], 3) * sh_basis(_SOMEWHERE, 3))[0].astype(np.float32)


def decode(blocks: Blocks, header: Header, is_mirrored: bool, start: int, stop: int, out: Columns) -> None:
    """Decode rows `start` to `stop`; if `is_mirrored`, negate the x axis."""
    if header.version == 1:
        halves = np.ndarray((stop - start, 3), "<f2", blocks.positions.data, start * 6)
        out.means[:] = halves
    else:
        # Read each 24-bit number with the byte after it; the shifts remove that byte and extend the sign.
        words = np.ndarray((stop - start, 3), "<i4", blocks.positions.data, start * 9, (9, 3))
        np.multiply((words << 8) >> 8, np.float32(2.0**-header.fractional_bits), out=out.means)
    np.take(_OPACITIES, blocks.alphas[start:stop], out=out.opacities, mode="clip")
    np.take(_COLORS, blocks.colors[start:stop], out=out.sh[:, 0], mode="clip")
    np.multiply(blocks.scales[start:stop], np.float32(1 / _LOG_SCALE_STEPS), out=out.scales)
    out.scales += _LOWEST_LOG_SCALE
    rotations = blocks.rotations[start:stop]
    unpack = _unpack_first_three if header.version < 3 else _unpack_smallest_three
    unpack(rotations, out.quats)
    num_rest = 3 * (out.sh.shape[1] - 1)
    if num_rest:
        rest = out.sh.reshape(len(out.sh), -1)[:, 3:]
        np.subtract(blocks.sh[start:stop, :num_rest] * np.float32(1 / _SH_ZERO), 1, out=rest)
    if is_mirrored:
        _turn_x(out)


def _unpack_first_three(rotations: U8, quats: F32) -> None:
    """Decode [n, 3] bytes of x, y and z to w, x, y, z; w >= 0 follows from the unit length.

    Computed in integer 255ths, since in float32 a w near 0 would lose half of its digits.
    """
    whole = 2 * rotations.astype(np.int32) - 255
    rest = np.maximum(255**2 - (whole * whole).sum(axis=1), 0)
    np.divide(np.sqrt(rest, dtype=np.float32), np.float32(255), out=quats[:, 0])
    np.divide(whole, np.float32(255), out=quats[:, 1:], casting="same_kind")


def _unpack_smallest_three(rotations: U8, quats: F32) -> None:
    """Decode [n, 4] bytes to w, x, y, z; the upper two bits of a word name the largest of x, y, z, w.

    The others are stored in this order; the largest is positive and follows from the unit length.
    """
    words: U32 = np.ndarray(len(rotations), "<u4", np.ascontiguousarray(rotations).data)
    largest = words >> 30
    first, second, third = (np.take(_COMPONENTS, words >> shift & 1023, mode="clip") for shift in (20, 10, 0))
    rest = np.sqrt(np.maximum(1 - first * first - second * second - third * third, 0))
    is_x, is_x_or_y, is_w = largest == 0, largest <= 1, largest == 3
    quats[:, 1] = np.where(is_x, rest, first)
    quats[:, 2] = np.where(is_x, first, np.where(is_x_or_y, rest, second))
    quats[:, 3] = np.where(is_x_or_y, second, np.where(is_w, third, rest))
    quats[:, 0] = np.where(is_w, rest, third)


def _turn_x(out: Columns) -> None:
    """Negate the x axis of rows in place."""
    out.means[:, 0] *= -1
    out.quats[:, 2:] *= -1  # mirroring reverses rotations, except about x
    out.sh *= _TURNED_X[: out.sh.shape[1], None]


_BLOCK_ROWS = 4096
# Most bytes in memory per byte of a file: trained scenes take 4 to 20, a scene of equal Gaussians more.
_MAX_GROWTH = 100


def open_scene(path: Path) -> SceneFile:
    """Read the header of an SPZ file.

    Raises:
        SceneError: if it is damaged, of an unknown version, or other data compressed with gzip.
    """
    with open_plain(path, "scene file", buffering=0) as file:
        begin = file.read(container.NUM_HEADER_BYTES)
        container.read_header(path, begin)  # refuses a large file of another kind early
        file.seek(0)
        return open_data(path, file.read())


def open_data(path: Path, data: bytes) -> SceneFile:
    """`open_scene` for the content of an SPZ file, which may be a part of the file at `path`."""
    header = container.read_header(path, data)
    counts = header.num_rows, header.num_terms
    check_decoded_size(path, *counts, len(data), row_size=header.row_size, max_growth=_MAX_GROWTH)
    extensions = container.read_extensions(path, data, header)
    unknown = extensions.unknown
    if header.sh_degree > header.used_degree:
        unknown = (f"spherical harmonics of degree {header.sh_degree}", *unknown)
    open_rows = partial(_open_rows, path, data, header, extensions)
    return SceneFile(
        path,
        f"SPZ, version {header.version}",
        *counts,
        open_rows,
        up=extensions.up,
        training="antialiased" if header.flags & container.ANTIALIASED else "default",
        unknown=unknown,
        stored=read_stored(path, lambda: parse_text(extensions.notes)),
    )


def _open_rows(path: Path, data: bytes, header: Header, extensions: Extensions) -> RowSource:
    """Decompress the whole file, to 19 to 64 bytes a Gaussian."""
    blocks, surplus = container.read_blocks(path, data, header)
    if surplus:
        message = f"{path}: {surplus} bytes after the last Gaussian were ignored"
        warnings.warn(SceneWarning(f"{message}; if the picture looks wrong, copy it again"), stacklevel=3)
    decoder = partial(decode, blocks, header, extensions.is_mirrored)
    rest = blocks.sh.reshape(header.num_rows, -1, 3)
    count = partial(find_used_terms, rest, header.num_terms, _SH_ZERO)
    size = header.num_rows, header.num_terms
    return RowSource(*size, lambda: nullcontext(decoder), _BLOCK_ROWS, is_whole=True, count_used=count)


_VERSION = 3
_LARGEST_POSITION = (1 << 23) - 1  # 24 bits with a sign
_USUAL_BITS = 12  # fractional bits of most files
# Least steps across the middle 96 % of a scene: a tenth of a pixel in a picture 10,000 pixels wide.
_STEPS = 100_000
_PACKING = 6  # gzip level: 9 takes three times as long to save 1 %


@in_order(brush_order)
def write_scene(rows: Gaussians, path: str | Path, stored: Stored) -> None:
    """Write a gzip stream of header, blocks and, if there is something to record, an extension.

    Scales are clipped to exp(-10) to exp(5.94) units, colors to -0.44 to 1.44, harmonics to -1 to 1. The
    extent of the scene decides the fractional bits of positions, limited by its farthest center.

    Raises:
        ValueError: if a center is too far for 24 bits, or the names of brushes are too long.
        SceneError: if the file cannot be written.
    """
    notes = text_of(content_of(stored._replace(antialiased=False)))  # a flag states it
    extensions = container.notes_record(notes.encode("ascii")) if notes else b""
    bits = _fractional_bits(rows)
    flags = container.ANTIALIASED * rows.antialiased | container.HAS_EXTENSIONS * bool(extensions)
    header = Header(_VERSION, len(rows), rows.sh_degree, bits, flags)
    positions = np.rint(rows.means.astype(np.float64) * 2.0**bits).astype("<i4")
    blocks: list[NDArray[Any]] = [
        positions.view(np.uint8).reshape(-1, 4)[:, :3],
        rounded(rows.opacities * 255.0, 255),
        rounded((rows.sh[:, 0] * _COLOR_SCALE + 0.5) * 255, 255),
        rounded((logs_of(rows.scales) - _LOWEST_LOG_SCALE) * _LOG_SCALE_STEPS, 255),
        _pack_smallest_three(rows),
        rounded(rows.sh[:, 1:] * float(_SH_ZERO) + _SH_ZERO, 255),
    ]
    data = container.pack_stream(header, [block.astype(np.uint8) for block in blocks], extensions)
    with replacing(path) as temporary:
        temporary.write_bytes(gzip.compress(data, _PACKING, mtime=0))


def _fractional_bits(gaussians: Gaussians) -> int:
    """Bits for `_STEPS` across the middle, at least `_USUAL_BITS`, as far as the farthest center allows."""
    farthest = float(np.abs(gaussians.means).max())
    if farthest > _LARGEST_POSITION:
        rule = f"means must lie within {_LARGEST_POSITION:,} units in an SPZ file, got {farthest:.4g}"
        raise ValueError(f"save: {rule}; prune what lies far away, or write a .ply")
    low, high = np.percentile(gaussians.means.astype(np.float64), (2, 98), axis=0)
    extent = float((high - low).max())
    wanted = int(np.ceil(np.log2(_STEPS / extent))) if extent > 0 else MAX_FRACTIONAL_BITS
    room = int(np.floor(np.log2(_LARGEST_POSITION / farthest))) if farthest > 0 else MAX_FRACTIONAL_BITS
    return max(0, min(max(wanted, _USUAL_BITS), room, MAX_FRACTIONAL_BITS))


def _pack_smallest_three(gaussians: Gaussians) -> U8:
    """Encode rotations as [n, 4] bytes: the inverse of `_unpack_smallest_three`."""
    largest, others = smallest_three(gaussians.quats[:, [1, 2, 3, 0]])  # x, y, z, w
    magnitudes = rounded(np.abs(others) / np.sqrt(0.5) * 511, 511).astype(np.uint32)
    parts = magnitudes | ((others < 0) & (magnitudes > 0)).astype(np.uint32) << 9
    words = largest.astype(np.uint32) << 30 | parts[:, 0] << 20 | parts[:, 1] << 10 | parts[:, 2]
    return np.asarray(words, "<u4").view(np.uint8).reshape(-1, 4)
