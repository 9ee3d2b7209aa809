"""The tables of picture and video formats. To add one: its line here, and a module if it has code of its own.

OpenImageIO reads and writes pictures, libav (PyAV) writes videos. The content of a picture decides how it is
read, the suffix of an output how it is written, and of a video the codec too. Error texts, help texts and the
fuzzer read these tables; `encoding.py` compares them with what is asked for.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from brushgs.formats.formats import Matcher, begins_with, find_by_suffix, suffixes_of
from brushgs.options.table import listed


class PictureFormat(NamedTuple):
    """A format of still pictures.

    Attributes:
        name: in words, for help and error texts.
        suffixes: that OpenImageIO reads with the right decoder, in lower case, the usual one first.
        matches: whether a path with these first bytes is of this format.
        precheck: module of this package with `check_file(path, file, max_pixels)`, for formats whose decoder
            takes memory before it reports the size of the picture; None if there is no need.
        writer: module of this package with `write(frame, path, background)`, which takes `bits` too where
            the format offers several; None if it is not written.
        bits: of each channel, that may be asked for, the usual number first.
        note: what is written, for help texts.
        is_linear: whether it holds linear light; else it is display-encoded.
        holds_depth: whether a frame's depth is written.
        holds_alpha: whether transparency is written.
        holds_metadata: whether it says how it was painted, see `metadata.py`.
    """

    name: str
    suffixes: tuple[str, ...]
    matches: Matcher
    precheck: str | None = None
    writer: str | None = None
    bits: tuple[int, ...] = (8,)
    note: str = ""
    is_linear: bool = False
    holds_depth: bool = False
    holds_alpha: bool = True
    holds_metadata: bool = True


class VideoCodec(NamedTuple):
    """How the pictures of a video are encoded.

    Attributes:
        name: in words, for help and error texts.
        writer: module of this package with `open_writer(stack, film)`, which returns a `VideoWriter`.
        bits: of each channel, that may be asked for, the usual number first.
        holds_alpha: whether transparency may be written.
        min_side: pixels along a side, at least.
        max_side: at most; None if the codec has no limit that matters.
        has_even_sides: whether width and height must be even.
    """

    name: str
    writer: str
    bits: tuple[int, ...] = (8,)
    holds_alpha: bool = False
    min_side: int = 1
    max_side: int | None = None
    has_even_sides: bool = False


class VideoFormat(NamedTuple):
    """A format of video files; none is read.

    Attributes:
        suffixes: in lower case, the usual one first.
        container: its name in libav.
        codecs: names in `VIDEO_CODECS`, the usual one first.
        max_fps: frames a second.
        holds_metadata: see `PictureFormat`.
    """

    suffixes: tuple[str, ...]
    container: str
    codecs: tuple[str, ...]
    max_fps: int = 1000
    holds_metadata: bool = True


PICTURE_FORMATS = (
    PictureFormat(
        "PNG", (".png",), begins_with(b"\x89PNG\r\n\x1a\n"), writer="png", bits=(8, 16), note="8 or 16 bit"
    ),
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
        bits=(16, 8),
        note="16 or 8 bit",
    ),
    PictureFormat(
        "OpenEXR",
        (".exr",),
        begins_with(b"\x76\x2f\x31\x01"),
        writer="exr",
        bits=(16,),
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
# Without transparency: so it is with the encoder in the wheels of PyAV, which takes none.
WRITTEN_ONLY = (
    PictureFormat(
        "AVIF",
        (".avif",),
        begins_with(),
        writer="avif",
        bits=(8, 10),
        note="8 or 10 bit",
        holds_alpha=False,
        holds_metadata=False,
    ),
)
VIDEO_CODECS: Mapping[str, VideoCodec] = {
    # One chroma sample for each 2 x 2 pixels, so sides are even; x264 refuses longer ones.
    "h264": VideoCodec("H.264", "h264", max_side=16384, has_even_sides=True),
    # x265 refuses shorter sides, and hangs where one is twice as long.
    "h265": VideoCodec("H.265", "h265", bits=(10, 8), min_side=16, max_side=8192, has_even_sides=True),
    # libav takes 10 of the 12 bits that the format has.
    "prores": VideoCodec("ProRes 4444", "prores", bits=(10,), holds_alpha=True),
    "vp9": VideoCodec("VP9", "vp9", holds_alpha=True),
    "gif": VideoCodec("GIF", "gif"),
}
VIDEO_FORMATS = (
    VideoFormat((".mp4",), "mp4", ("h264", "h265")),
    VideoFormat((".mov",), "mov", ("prores", "h265", "h264")),
    VideoFormat((".webm",), "webm", ("vp9",)),
    VideoFormat((".mkv",), "matroska", ("h264", "h265")),
    # Delays count in hundredths of a second, and viewers take a delay of 1 for 10.
    VideoFormat((".gif",), "gif", ("gif",), max_fps=50, holds_metadata=False),
)
WRITTEN_PICTURES = tuple(row for row in (*PICTURE_FORMATS, *WRITTEN_ONLY) if row.writer)
PICTURE_SUFFIXES = suffixes_of(WRITTEN_PICTURES)  # that a picture may be written to
VIDEO_SUFFIXES = suffixes_of(VIDEO_FORMATS)
# For help and error texts, such as "PNG, JPEG ...", ".png (8 bit) ..." and ".mp4 (H.264) ...".
PICTURES_READ = listed([row.name for row in PICTURE_FORMATS])
PICTURES_WRITTEN = listed([f"{row.suffixes[0]} ({row.note})" for row in WRITTEN_PICTURES])
VIDEOS_WRITTEN = listed(
    [
        f"{row.suffixes[0]} ({listed([VIDEO_CODECS[name].name for name in row.codecs])})"
        for row in VIDEO_FORMATS
    ]
)


def holds_depth(path: str | Path) -> bool:
    """Whether a picture that is written to this path holds the depth of the frame."""
    picture_format = find_by_suffix(WRITTEN_PICTURES, path)
    return picture_format is not None and picture_format.holds_depth


def holds_alpha(path: str | Path) -> bool:
    """Whether a picture that is written to this path holds the transparency of the frame."""
    picture_format = find_by_suffix(WRITTEN_PICTURES, path)
    return picture_format is not None and picture_format.holds_alpha
