"""Shared by the writers of pictures and videos: quantized pixels, and output with OpenImageIO.

OpenImageIO's division by alpha on writing is turned off, so straight colors are stored exactly. 8-bit videos
take 8-bit pixels, others 16-bit ones, which the encoder rounds. Their alpha is straight, as readers of ProRes
4444, and of VP9 in browsers, expect.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from brushgs.core.signals import defer_stop
from brushgs.errors import SceneError
from brushgs.formats.files import replacing, scratch_folder
from brushgs.values.arrays import U8, Array
from brushgs.values.frame import Frame

HEADER = 1 << 12  # bytes of a file beside its pixels, at most
# Without a date OpenImageIO writes the current time, and equal frames would give different bytes.
NO_DATE = "1970:01:01 00:00:00"
Background = Sequence[float] | Array | None  # one RGB color or [H, W, 3], display-encoded; None for none


Pixels: TypeAlias = U8 | NDArray[np.uint16]  # [H, W, 3 or 4]


def quantise(values: Array, dtype: type[np.unsignedinteger[Any]]) -> NDArray[np.unsignedinteger[Any]]:
    """Quantize values, clipped to 0 to 1, to the full range of `dtype`; halves are rounded up."""
    return np.asarray(np.clip(values, 0, 1) * np.iinfo(dtype).max + 0.5).astype(dtype)


class Strips(NamedTuple):
    """A frame as a stream of horizontal strips, for pictures larger than memory."""

    height: int  # of the whole picture, pixels
    width: int  # pixels
    frames: Callable[[], Iterator[Frame]]  # yields the strips from the top; each call renders them again


def _strips_of(frame: Strips, background: Background) -> Iterator[tuple[Frame, Background]]:
    """The strips of a picture, each with its part of the background."""
    is_image, row = background is not None and np.ndim(background) == 3, 0
    for strip in frame.frames():
        rows = slice(row, row + len(strip.alpha))
        yield strip, np.asarray(background)[rows] if is_image else background
        row = rows.stop


def pixels_of(frame: Frame, background: Background, bits: int, *, spreads: bool = False) -> Pixels:
    """[H, W, 3] on a background, else [H, W, 4] with straight alpha; uint8 if `bits` is 8, else uint16.

    `spreads` extends straight colors, see `spread_colors`.
    """
    if background is not None and bits == 8:
        return frame.bytes_over(background)
    if background is None:
        colors = spread_colors(frame) if spreads else frame.straight_colors()
        values = np.concatenate([colors, frame.alpha[..., None]], axis=-1)
    else:
        values = frame.over(background)
    return quantise(values, np.uint8 if bits == 8 else np.uint16)


class Layout(NamedTuple):
    """How OpenImageIO writes a file."""

    format_name: str  # in OpenImageIO
    shape: tuple[int, ...]  # height, width and channels
    bits: int  # per channel
    attributes: Mapping[str, Any]  # of OpenImageIO


def write_frame_as(path: str | Path, layout: Layout, frame: Frame | Strips, background: Background) -> None:
    """Write a frame, or its strips one at a time; the file appears when it is complete."""
    _write_rows(path, rows_of(frame, background, layout.bits), layout)


def shape_of(frame: Frame | Strips, background: Background) -> tuple[int, int, int]:
    """Height, width and channels of a picture: without a background it has alpha."""
    height, width = (frame.height, frame.width) if isinstance(frame, Strips) else frame.alpha.shape
    return height, width, 4 if background is None else 3


def rows_of(frame: Frame | Strips, background: Background, bits: int) -> Iterator[Pixels]:
    """`pixels_of` a strip at a time, from the top."""
    strips = _strips_of(frame, background) if isinstance(frame, Strips) else iter([(frame, background)])
    return (pixels_of(strip, behind, bits) for strip, behind in strips)


def encode_pixels(format_name: str, pixels: U8, attributes: Mapping[str, Any]) -> bytes:
    """The bytes of a file with pixels [H, W, 1, 3 or 4], unchanged if the format is lossless.

    `format_name` and `attributes` are those of OpenImageIO, which writes to named files only. Raises
    SceneError if the folder for temporary files is full.
    """
    with scratch_folder() as folder:
        path = folder / "picture"
        _write_rows(path, iter([pixels]), Layout(format_name, pixels.shape, 8, attributes))
        return path.read_bytes()


def _write_rows(path: str | Path, rows: Iterator[NDArray[Any]], layout: Layout) -> None:
    """Write blocks of rows from the top."""
    # An interrupted encoder prints errors to the terminal.
    with defer_stop(), replacing(path, most=prod(layout.shape) * layout.bits // 8 + HEADER) as temporary:
        encode_rows(temporary, path, rows, layout)


def encode_rows(temporary: Path, path: str | Path, rows: Iterator[NDArray[Any]], layout: Layout) -> None:
    """Write blocks of rows to a temporary file; errors name `path`."""
    import OpenImageIO

    height, width, channels = layout.shape
    spec = OpenImageIO.ImageSpec(width, height, channels, f"uint{layout.bits}")
    spec.channelnames = ("Y",) if channels == 1 else ("R", "G", "B", "A")[:channels]
    spec.alpha_channel = 3 if channels == 4 else -1
    for name, value in layout.attributes.items():
        spec.attribute(name, value)
    out = OpenImageIO.ImageOutput.create(layout.format_name)
    assert out is not None, "the formats of the table are part of every build of OpenImageIO"
    is_written, row = out.open(str(temporary), spec), 0
    while is_written and (pixels := next(rows, None)) is not None:
        end = row + len(pixels)
        is_written = out.write_scanlines(row, end, 0, np.ascontiguousarray(pixels))
        row = end
    if not (out.close() and is_written):
        raise not_written(path, temporary, out)


def not_written(path: str | Path, temporary: Path, out: Any) -> SceneError:
    """The SceneError for a failed output of OpenImageIO, whose message names the temporary file."""
    reason = first_line(out.geterror()).replace(str(temporary), str(path))
    return SceneError(path, f"cannot be written ({reason}); check the disk")


def first_line(text: str) -> str:
    """First line of a message of OpenImageIO."""
    return text.strip().splitlines()[0] if text.strip() else "no reason given"


def video_pixels(frame: Frame, background: Background, bits: int) -> Pixels:
    """The pixels of a video frame, see `pixels_of`."""
    return pixels_of(frame, background, bits, spreads=True)


def spread_colors(frame: Frame) -> Array:
    """[H, W, 3] straight colors, extended into pixels where nothing is painted (pull-push).

    Codecs mix colors of neighbors whatever their alpha: black beside the paint would darken its edge. A
    pixel with alpha 0 takes the mean of the smallest block of 2, 4, 8 ... pixels a side that has paint.
    OpenImageIO's fillholes_pushpull takes three times as long.
    """
    colors = frame.straight_colors()
    is_bare = frame.alpha <= 0
    if is_bare.any() and not is_bare.all():
        colors[is_bare] = _means_of_blocks(frame.rgb, frame.alpha)[is_bare]
    return colors


def _means_of_blocks(rgb: Array, alpha: Array) -> Array:
    """For each pixel, the alpha-weighted mean color of the smallest block around it that has paint."""
    height, width = alpha.shape
    if height == width == 1:
        return np.divide(rgb, alpha[..., None], out=np.zeros_like(rgb), where=alpha[..., None] > 0)
    padded = np.pad(np.dstack([rgb, alpha]), ((0, height % 2), (0, width % 2), (0, 0)))
    halves = padded[0::2] + padded[1::2]
    sums = halves[:, 0::2] + halves[:, 1::2]
    coarse = _means_of_blocks(sums[..., :3], sums[..., 3])
    fine = np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:height, :width]
    return np.divide(rgb, alpha[..., None], out=np.ascontiguousarray(fine), where=alpha[..., None] > 0)
