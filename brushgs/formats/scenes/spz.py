"""Niantic's SPZ: a scene of about 10 times fewer bytes than PLY, of versions 1 to 4.

Positions have 24 bits an axis (half floats in version 1), everything else 8 bits a number and rotations 24 to
32 bits; every value becomes the float32 that is nearest to what the format defines. The axes are read as they
are stored: the specification says right-up-back, but many writers store those of the PLY that they had, so up
is stated only where an extension of the file names its axes.
Source: https://github.com/nianticlabs/spz.
"""

import warnings
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneWarning
from brushgs.formats.files import open_plain
from brushgs.formats.scenes.columns import Columns, check_decoded_size, find_used_terms
from brushgs.formats.scenes.rows import RowSource, SceneFile
from brushgs.formats.scenes.spz_container import (
    NUM_HEADER_BYTES,
    Blocks,
    Extensions,
    Header,
    read_blocks,
    read_extensions,
    read_header,
)
from brushgs.formats.scenes.stored import parse_text, read_stored
from brushgs.values.arrays import F32, U32
from brushgs.values.sh import sh_basis

_BYTES = np.arange(256)
_OPACITIES = (_BYTES / 255).astype(np.float32)
COLOR_SCALE = 0.15  # of a coefficient of degree 0, before 0.5 is added
LOWEST_LOG_SCALE, LOG_SCALE_STEPS = -10, 16  # the log-scale of byte 0, and steps to the next whole one
# 0 to 255 are colours of -0.44 to 1.44: coefficients of -3.3 to 3.3, without the factor C0 of a colour.
_COLORS = ((_BYTES / 255 - 0.5) / COLOR_SCALE).astype(np.float32)
SH_ZERO = 128  # of a spherical-harmonic coefficient, and the steps from there to 1
_MAGNITUDES = np.arange(512) / 511 * np.sqrt(0.5)
# A component of 10 bits, the highest its sign: no component but the largest is beyond 1/sqrt(2).
_COMPONENTS = np.concatenate([_MAGNITUDES, -_MAGNITUDES]).astype(np.float32)
_SOMEWHERE = np.array([[1, 2, 3]]) / np.sqrt(14)  # a direction in which no basis function is zero
# How each basis function changes where x is turned: 1 or -1.
_TURNED_X = np.sign(sh_basis(_SOMEWHERE * [-1, 1, 1], 3) * sh_basis(_SOMEWHERE, 3))[0].astype(np.float32)


def count_used_terms(sh: NDArray[np.uint8], num_terms: int) -> int:
    """Terms up to the highest band of which some coefficient of block `sh` is not zero."""
    return find_used_terms(
        num_terms,
        len(sh),
        lambda start, stop, rows: bool((sh[rows, 3 * start - 3 : 3 * stop - 3] != SH_ZERO).any()),
    )


def decode(blocks: Blocks, header: Header, is_mirrored: bool, start: int, stop: int, out: Columns) -> None:
    """Decode rows `start` to `stop`, with the x axis turned if they are mirrored."""
    if header.version == 1:
        halves = np.ndarray((stop - start, 3), "<f2", blocks.positions.data, start * 6)
        out.means[:] = halves
    else:
        # Three bytes are read with the one behind them, which is shifted out; so is the sign shifted in.
        words = np.ndarray((stop - start, 3), "<i4", blocks.positions.data, start * 9, (9, 3))
        np.multiply((words << 8) >> 8, np.float32(2.0**-header.fractional_bits), out=out.means)
    np.take(_OPACITIES, blocks.alphas[start:stop], out=out.opacities, mode="clip")
    np.take(_COLORS, blocks.colors[start:stop], out=out.sh[:, 0], mode="clip")
    np.multiply(blocks.scales[start:stop], np.float32(1 / LOG_SCALE_STEPS), out=out.scales)
    out.scales += LOWEST_LOG_SCALE
    rotations = blocks.rotations[start:stop]
    unpack = _unpack_first_three if header.version < 3 else _unpack_smallest_three
    unpack(rotations, out.quats)
    num_rest = 3 * (out.sh.shape[1] - 1)
    if num_rest:
        rest = out.sh.reshape(len(out.sh), -1)[:, 3:]
        np.subtract(blocks.sh[start:stop, :num_rest] * np.float32(1 / SH_ZERO), 1, out=rest)
    if is_mirrored:
        _turn_x(out)


def _unpack_first_three(rotations: NDArray[np.uint8], quats: F32) -> None:
    """[n, 3] bytes of x, y and z -> w, x, y, z; w is not negative and follows from the unit length.

    In whole 255ths: in float32, a w near 0 would lose half of its digits.
    """
    whole = 2 * rotations.astype(np.int32) - 255
    rest = np.maximum(255**2 - (whole * whole).sum(axis=1), 0)
    np.divide(np.sqrt(rest, dtype=np.float32), np.float32(255), out=quats[:, 0])
    np.divide(whole, np.float32(255), out=quats[:, 1:], casting="same_kind")


def _unpack_smallest_three(rotations: NDArray[np.uint8], quats: F32) -> None:
    """[n, 4] bytes -> w, x, y, z; the upper two bits of a word name the largest of x, y, z, w.

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
    """Mirror rows in the plane of y and z."""
    out.means[:, 0] *= -1
    out.quats[:, 2:] *= -1  # a mirrored rotation turns the other way round, except about x
    out.sh *= _TURNED_X[: out.sh.shape[1], None]


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
        up=extensions.up,
        training="antialiased" if header.is_antialiased else "default",
        unknown=unknown,
        stored=stored,
        open_rows=partial(_open_rows, path, data, header, extensions),
    )


def _open_rows(path: Path, data: bytes, header: Header, extensions: Extensions) -> RowSource:
    """The bytes of the whole file are decompressed, 19 to 64 a Gaussian."""
    blocks, surplus = read_blocks(path, data, header)
    if surplus:
        _warn_of_surplus(path, surplus)
    return RowSource(
        header.num_rows,
        header.num_terms,
        lambda: nullcontext(partial(decode, blocks, header, extensions.is_mirrored)),
        block_rows=_BLOCK_ROWS,
        is_whole=True,
        count_used=lambda: count_used_terms(blocks.sh, header.num_terms),
    )


def _warn_of_surplus(path: Path, surplus: int) -> None:
    message = f"{path}: {surplus} bytes after the last Gaussian were ignored"
    warnings.warn(SceneWarning(f"{message}; if the picture looks wrong, copy it again"), stacklevel=4)
