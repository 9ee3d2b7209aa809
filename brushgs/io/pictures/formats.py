"""The tables of picture and video formats. To add one: its line here, and a module if it has code of its own.

OpenImageIO reads and writes pictures, libav (PyAV) writes videos. The content of a picture decides how it is
read, the suffix of an output how it is written. Error texts, help texts and the fuzzer read these tables.
"""

from pathlib import Path
from typing import NamedTuple

from brushgs.io.formats import Matcher, begins_with, find_by_suffix, in_words, suffixes_of


class PictureFormat(NamedTuple):
    """A format of still pictures.

    Attributes:
        name: in words, for help and error texts.
        suffixes: that OpenImageIO reads with the right decoder, in lower case, the usual one first.
        matches: whether a path with these first bytes is of this format.
        precheck: module of this package with `check_file(path, file, max_pixels)`, for formats whose decoder
            takes memory before it reports the size of the picture; None if there is no need.
        writer: module of this package with `write(frame, path, background)`; None if it is not written.
        note: what is written, for help texts.
        is_linear: whether it holds linear light; else it is display-encoded.
        holds_depth: whether a frame's depth is written.
        holds_alpha: whether transparency is written.
    """

    name: str
    suffixes: tuple[str, ...]
    matches: Matcher
    precheck: str | None = None
    writer: str | None = None
    note: str = ""
    is_linear: bool = False
    holds_depth: bool = False
    holds_alpha: bool = True


class VideoFormat(NamedTuple):
    """A format of videos; none is read.

    Attributes:
        name: in words, for help and error texts.
        suffixes: in lower case, the usual one first.
        writer: module of this package with `open_writer(stack, path, size, rate, loops)`, which returns a
            `VideoWriter`; `size` is width and height as padded by `padded_size`.
        max_fps: frames a second.
        max_side: pixels along a side; None if the format has no limit that matters.
        has_even_sides: whether width and height must be even.
    """

    name: str
    suffixes: tuple[str, ...]
    writer: str
    max_fps: int = 1000
    max_side: int | None = None
    has_even_sides: bool = False


PICTURE_FORMATS = (
    PictureFormat("PNG", (".png",), begins_with(b"\x89PNG\r\n\x1a\n"), writer="png", note="8 bit"),
    PictureFormat(
        "JPEG",
        (".jpg", ".jpeg"),
        begins_with(b"\xff\xd8\xff"),
        precheck="jpeg",
        writer="jpeg",
        note="8 bit, quality 95",
        holds_alpha=False,
    ),
    PictureFormat(
        "TIFF",
        (".tif", ".tiff"),
        begins_with(b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
        writer="tiff",
        note="16 bit",
    ),
    PictureFormat(
        "OpenEXR",
        (".exr",),
        begins_with(b"\x76\x2f\x31\x01"),
        writer="exr",
        note="half float, linear light, depth, layers",
        is_linear=True,
        holds_depth=True,
    ),
    PictureFormat(
        "WebP",
        (".webp",),
        lambda path, begin: begin.startswith(b"RIFF") and begin[8:12] == b"WEBP",
        precheck="webp",
        writer="webp",
        note="8 bit, lossless",
    ),
    PictureFormat("BMP", (".bmp",), begins_with(b"BM")),
    PictureFormat("Radiance HDR", (".hdr",), begins_with(b"#?RADIANCE", b"#?RGBE"), is_linear=True),
)
VIDEO_FORMATS = (
    # One chroma sample for each 2 x 2 pixels, so sides are even; x264 refuses longer ones.
    VideoFormat("H.264", (".mp4",), "h264", max_side=16384, has_even_sides=True),
    VideoFormat("VP9", (".webm",), "vp9"),
    # Delays count in hundredths of a second, and viewers take a delay of 1 for 10.
    VideoFormat("GIF", (".gif",), "gif", max_fps=50),
)
WRITTEN_PICTURES = tuple(row for row in PICTURE_FORMATS if row.writer)
PICTURE_SUFFIXES = suffixes_of(WRITTEN_PICTURES)  # that a picture may be written to
VIDEO_SUFFIXES = suffixes_of(VIDEO_FORMATS)
# For help and error texts, such as "PNG, JPEG ...", ".png (8 bit) ..." and ".mp4 (H.264) ...".
PICTURES_READ = in_words([row.name for row in PICTURE_FORMATS])
PICTURES_WRITTEN = in_words([f"{row.suffixes[0]} ({row.note})" for row in WRITTEN_PICTURES])
VIDEOS_WRITTEN = in_words([f"{row.suffixes[0]} ({row.name})" for row in VIDEO_FORMATS])


def holds_depth(path: str | Path) -> bool:
    """Whether a picture that is written to this path holds the depth of the frame."""
    picture_format = find_by_suffix(WRITTEN_PICTURES, path)
    return picture_format is not None and picture_format.holds_depth


def holds_alpha(path: str | Path) -> bool:
    """Whether a picture that is written to this path holds the transparency of the frame."""
    picture_format = find_by_suffix(WRITTEN_PICTURES, path)
    return picture_format is not None and picture_format.holds_alpha
