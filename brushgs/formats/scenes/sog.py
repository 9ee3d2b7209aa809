"""SOG scenes (Spatially Ordered Gaussians, versions 1 and 2): WebP pictures of bytes with a `meta.json`.

Each Gaussian has one pixel in each picture, in rows from the top left. A scene is given as a folder, its
`meta.json`, or a zip archive of the same files.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from math import prod
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.errors import SceneError
from brushgs.formats.pictures.images import read_bytes
from brushgs.formats.pictures.still import stated_size
from brushgs.formats.scenes.columns import Columns, check_decoded_size, unpack_quats
from brushgs.formats.scenes.rows import Decoder, RowSource, SceneFile, decoder_of_parts
from brushgs.formats.scenes.sog_meta import Meta, Palette, SceneFiles, open_files, parse_meta
from brushgs.formats.schema import MAX_BYTES
from brushgs.values.arrays import F32, U8, Array

_BLOCK_ROWS = 1 << 11  # 0.4 MB with harmonics of degree 3, which fits the cache
_CURE = "download or export the scene again"
# A picture may have unused pixels, because its sides are multiples of 4 or powers of 2.
_MAX_SPARE, _FEW_PIXELS = 4, 1 << 16
# Most bytes of a lossless WebP: its size without any compression.
_MAX_PIXEL_BYTES, _MAX_EXTRA_BYTES = 5, 1 << 16
# Bytes in memory per byte of the pictures: trained scenes reach 18 (degree 3, with a large palette).
MAX_GROWTH = 64
QUAT_TAG = 252  # last byte of a rotation whose largest component is w
_SMALL_COMPONENTS = ((np.arange(256) / 255 * 2 - 1) * np.sqrt(0.5)).astype(np.float32)


class Sog(NamedTuple):
    """A SOG scene; the sizes of its pictures were checked."""

    path: Path  # zip archive, folder, or the `meta.json` in a folder
    meta: Meta
    num_entries: int  # entries of the palette, 0 without one
    num_terms: int  # spherical-harmonic terms of each Gaussian
    size: int  # total bytes of its files


def open_scene(path: Path) -> SceneFile:
    """Read the `meta.json` of a SOG scene and the sizes of its pictures.

    Raises SceneError if a file or field is missing or does not fit.
    """
    sog = open_sog(path)
    meta = sog.meta
    open_rows = partial(rows_of, [(sog, [(0, meta.num_rows)])], sog.num_terms)
    about = path, f"SOG version {meta.version}", meta.num_rows, sog.num_terms, open_rows
    return SceneFile(*about, training=meta.training, stored=meta.stored)


def open_sog(path: Path) -> Sog:
    """Read the `meta.json` of a scene and check the sizes of its pictures. Raises as `open_scene`."""
    with open_files(path) as files:
        content = files.meta(MAX_BYTES)
        meta = parse_meta(files.path, content)
        for name in meta.pictures[:6]:  # all except the centroids
            _check_size(files, name, meta.num_rows)
        num_entries, bands = 0, 0
        if meta.palette is not None:
            num_entries, bands = _check_centroids(files, meta.palette)
        num_terms = (bands + 1) ** 2
        size = len(content) + sum(files.size(name) for name in set(meta.pictures))
    check_decoded_size(path, meta.num_rows, num_terms, size, max_growth=MAX_GROWTH)
    return Sog(path, meta, num_entries, num_terms, size)


def rows_of(parts: Sequence[tuple[Sog, list[tuple[int, int]]]], num_terms: int) -> RowSource:
    """The rows of several scenes in order; the pictures of a scene are decoded when its rows are needed.

    Each scene has a list of runs (first row, row after the last). Scenes with fewer than `num_terms`
    spherical-harmonic terms are padded with 0.
    """
    counts = [sum(stop - start for start, stop in runs) for _, runs in parts]
    is_logit = all(sog.meta.version == 1 for sog, _ in parts)
    openers = [partial(_open_decoder, sog, runs, is_logit=is_logit) for sog, runs in parts]
    open_decoder = decoder_of_parts(list(zip(counts, openers, strict=True)))
    return RowSource(sum(counts), num_terms, open_decoder, _BLOCK_ROWS, is_logit=is_logit, is_whole=True)


def _open_decoder(sog: Sog, runs: list[tuple[int, int]], *, is_logit: bool) -> Decoder:
    """A decoder of the rows in `runs` of a scene. Raises SceneError if a picture is damaged."""
    meta = sog.meta
    with open_files(sog.path) as files:
        with ThreadPoolExecutor(min(num_threads_or_default(None), len(meta.pictures))) as pool:
            pictures = list(pool.map(partial(_read_picture, files), meta.pictures))
        palette = None
        if meta.palette is not None:
            palette = _read_palette(pictures.pop(), meta.palette, sog)
            labels = _words(*(pictures[-1][:, channel] for channel in (0, 1)))
            largest = int(max(labels[start:stop].max(initial=0) for start, stop in runs))
            if largest >= sog.num_entries:
                rule = f"{meta.palette.labels!r} must hold labels below {sog.num_entries}, got {largest}"
                raise SceneError(files.path, f"{rule}; {_CURE}")
    parts = ([picture[start:stop] for start, stop in runs] for picture in pictures)
    pictures = [part[0] if len(part) == 1 else np.concatenate(part) for part in parts]
    opacities: Array = meta.opacities
    if meta.version == 1 and not is_logit:  # joined with scenes of version 2
        opacities = (1 / (1 + np.exp(-opacities))).astype(np.float32)
    return _decoder(meta, pictures, palette, opacities)


def _size_of(files: SceneFiles, name: str) -> tuple[int, int]:
    """Width and height of a picture, from its first bytes. Raises SceneError if it is no lossless WebP."""
    begin = files.head(name)
    if begin[:4] != b"RIFF" or begin[8:12] != b"WEBP":
        raise SceneError(files.path, f"picture {name[:100]!r} must be a WebP, but is not; {_CURE}")
    if begin[12:16] == b"VP8 ":
        rule = f"picture {name[:100]!r} must be a lossless WebP, got a lossy one"
        raise SceneError(files.path, f"{rule}; export the scene again")
    return stated_size(begin)


def _check_size(files: SceneFiles, name: str, num_rows: int) -> None:
    """Refuse a picture with fewer or far more pixels than Gaussians."""
    width, height = _size_of(files, name)
    most = _MAX_SPARE * num_rows + _FEW_PIXELS
    if not num_rows <= width * height <= most:
        rule = f"picture {name[:100]!r} must have {num_rows} to {most} pixels, one for each Gaussian"
        raise SceneError(files.path, f"{rule}, got {width}x{height}; {_CURE}")


def _check_centroids(files: SceneFiles, palette: Palette) -> tuple[int, int]:
    """Number of entries and bands of the palette. Raises SceneError if the size of its picture is wrong."""
    width, height = _size_of(files, palette.centroids)
    if (found := palette.counts(width, height)) is None:
        stated = "" if palette.bands is None else f" of {palette.bands} bands, {palette.num_entries} of them,"
        rule = f"picture {palette.centroids[:100]!r} must hold 64 centroids{stated} in a row"
        raise SceneError(files.path, f"{rule}, got {width}x{height}; {_CURE}")
    return found


def _read_picture(files: SceneFiles, name: str) -> U8:
    """[pixels, 4] in rows from the top left; alpha is 255 if the picture has none."""
    num_pixels = prod(_size_of(files, name))
    with files.on_disk(name, _MAX_PIXEL_BYTES * num_pixels + _MAX_EXTRA_BYTES) as path:
        pixels = read_bytes(path, num_pixels)
    if pixels.shape[0] * pixels.shape[1] != num_pixels or pixels.shape[2] not in (3, 4):
        raise SceneError(files.path, f"picture {name[:100]!r} is damaged; {_CURE}")
    if pixels.shape[2] == 3:
        pixels = np.dstack([pixels, np.full(pixels.shape[:2], 255, np.uint8)])
    return pixels.reshape(num_pixels, 4)


def _read_palette(pixels: U8, palette: Palette, sog: Sog) -> F32:
    """[entries, terms, 3] coefficients of the palette; degree 0 is 0."""
    num_rest = sog.num_terms - 1
    entries = np.zeros((sog.num_entries, sog.num_terms, 3), np.float32)
    entries[:, 1:] = palette.values[pixels[: sog.num_entries * num_rest, :3]].reshape(-1, num_rest, 3)
    return entries


def _words(low: U8, high: U8) -> NDArray[np.uint16]:
    """Combine low and high bytes to 16-bit numbers."""
    return np.asarray(high.astype(np.uint16) << 8 | low)


def _decoder(meta: Meta, pictures: list[U8], palette: F32 | None, opacities: F32) -> Decoder:
    """A decoder of rows; `pictures` are low and high bytes of means, quats, scales, colors, any labels."""

    def decode(start: int, stop: int, out: Columns) -> None:
        low, high, quats, scales, colors = (picture[start:stop] for picture in pictures[:5])
        num_terms = 1
        if palette is not None:
            labels = _words(*(pictures[5][start:stop, channel] for channel in (0, 1)))
            num_terms = palette.shape[1]
            if num_terms == out.sh.shape[1]:  # without an intermediate copy: half of the time
                np.take(palette, labels, axis=0, out=out.sh, mode="clip")  # labels were checked
            else:
                out.sh[:, :num_terms] = palette[labels]
        out.sh[:, num_terms:] = 0
        for index in range(3):
            out.means[:, index] = meta.means[index][_words(low[:, index], high[:, index])]
            out.scales[:, index] = meta.log_scales[index][scales[:, index]]
            out.sh[:, 0, index] = meta.colors[index][colors[:, index]]
        out.opacities[:] = opacities[colors[:, 3]]
        _unpack_quats(quats, out.quats)

    return decode


def _unpack_quats(stored: U8, out: F32) -> None:
    """Decode [n, 4] bytes to unit quaternions w x y z.

    The last byte is 252 + the index of the largest component; the others are fractions of -1/sqrt(2) to
    1/sqrt(2). Another last byte gives the zero quaternion, whose row is dropped with a warning.
    """
    largest = stored[:, 3].astype(np.int16) - QUAT_TAG
    unpack_quats(largest, _SMALL_COMPONENTS[stored[:, :3]], out)
    out[largest < 0] = 0
