"""Which kind of picture a file is, told by its first bytes, and what must be known before it is opened.

OpenImageIO has decoders for some twenty-five formats and chooses by the suffix; brushgs lets it use seven, by
content. Of those WebP is decoded as soon as it is opened, and a progressive JPEG takes memory for all of its
pixels then, so their sizes are read here first; and a JPEG may be stored in thousands of passes over the
whole picture, so these are counted.
"""

import re
import struct
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from brushgs.errors import SceneError
from brushgs.io.files import open_plain

_MAX_SCANS = 100  # passes of a JPEG; cameras and editors write 1 to 14
_START_OF_SCAN = b"\xff\xda"
_MAX_SEGMENTS = 10_000  # before the size of a JPEG; cameras write some tens
# Markers of a JPEG: those that tell its size (all SOF, not DHT, JPG and DAC), and those that nothing follows.
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_MARKER = re.compile(rb"\xff([^\x00\xff])", re.DOTALL)
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})
_PIECE = 1 << 20  # bytes looked through at a time,
_SMALL_PIECE = 1 << 12  # and in the search for what mostly comes next


@dataclass(frozen=True)
class Kind:
    """A format of pictures.

    Attributes:
        name: as people call it.
        suffixes: that OpenImageIO opens with the right decoder, the usual one first.
        beginnings: bytes that such files begin with.
    """

    name: str
    suffixes: tuple[str, ...]
    beginnings: tuple[bytes, ...]


KINDS = (
    Kind("PNG", (".png",), (b"\x89PNG\r\n\x1a\n",)),
    Kind("JPEG", (".jpg", ".jpeg"), (b"\xff\xd8\xff",)),
    Kind("TIFF", (".tif", ".tiff"), (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
    Kind("OpenEXR", (".exr",), (b"\x76\x2f\x31\x01",)),
    Kind("WebP", (".webp",), (b"RIFF",)),
    Kind("BMP", (".bmp",), (b"BM",)),
    Kind("Radiance HDR", (".hdr",), (b"#?RADIANCE", b"#?RGBE")),
)


def picture_kind(path: Path, max_pixels: int) -> Kind:
    """The kind of a picture, checked as far as must be before a decoder sees it.

    Raises:
        SceneError: if there is no such plain file, it is of no known kind, or is made to cost too much.
    """
    with open_plain(path, "picture") as file:
        begin = file.read(64)
        kind = next((kind for kind in KINDS if begin.startswith(kind.beginnings)), None)
        if kind is None or (kind.name == "WebP" and begin[8:12] != b"WEBP"):
            known = ", ".join(kind.name for kind in KINDS)
            raise SceneError(path, f"cannot be read as a picture (it is none of {known}); convert it to PNG")
        if kind.name == "WebP":
            check_pixels(path, *_webp_size(begin), max_pixels)
        elif kind.name == "JPEG":
            check_pixels(path, *_jpeg_size(path, file), max_pixels)
            file.seek(0)
            num_scans, last = 0, b""
            while piece := file.read(_PIECE):
                num_scans += (last + piece).count(_START_OF_SCAN)
                last = piece[-1:]
            if num_scans > _MAX_SCANS:
                fact = f"must be stored in at most {_MAX_SCANS} passes, got {num_scans}"
                raise SceneError(path, f"{fact}; save it again as a plain JPEG or PNG")
    return kind


def check_pixels(path: Path, width: int, height: int, max_pixels: int) -> None:
    """Refuse a picture of more than so many pixels. Raises SceneError."""
    if width * height > max_pixels:
        size = f"{width}x{height}"
        raise SceneError(path, f"must have at most {max_pixels} pixels, got {size}; scale it down")


@contextmanager
def suffixed(path: Path, kind: Kind) -> Iterator[Path]:
    """A path that leads to the file and ends as its kind should, so that no other decoder is tried first."""
    if path.suffix.lower() in kind.suffixes:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="brushgs-") as folder:
        link = Path(folder) / f"picture{kind.suffixes[0]}"
        link.symlink_to(path.resolve())
        yield link


def _jpeg_size(path: Path, file: BinaryIO) -> tuple[int, int]:
    """Width and height that a JPEG states; (0, 0) where it states none, which the decoder tells.

    Source: ITU T.81, annex B. As decoders do, whatever stands between two segments is skipped.

    Raises:
        SceneError: if there are very many segments before it.
    """
    file.seek(2)
    for _ in range(_MAX_SEGMENTS):
        marker = _next_marker(file)
        if marker is None or marker == _START_OF_SCAN[1]:
            return 0, 0
        if marker in _BARE:
            continue
        begin = file.read(7)
        if marker in _FRAMES and len(begin) == 7:
            height, width = struct.unpack(">3xHH", begin)
            return width, height
        length = int.from_bytes(begin[:2], "big")
        file.seek(max(length, 2) - len(begin), 1)
    raise SceneError(path, f"states no size in its first {_MAX_SEGMENTS} segments; save it again as a PNG")


def _next_marker(file: BinaryIO) -> int | None:
    """The code of the next marker, after which the file stands then; None at the end."""
    while piece := file.read(_SMALL_PIECE):
        match = _MARKER.search(piece)
        if match is not None:
            file.seek(match.end() - len(piece), 1)
            return match[1][0]
        if piece.endswith(b"\xff") and len(piece) > 1:  # its code stands in the next piece
            file.seek(-1, 1)
    return None


def _webp_size(begin: bytes) -> tuple[int, int]:
    """Width and height in the first chunk of a WebP; (0, 0) where there is none, which the decoder tells.

    Source: RFC 9649, WebP Image Format. The frames of a picture lie within the canvas.
    """
    begin = begin.ljust(64, b"\0")
    match begin[12:16]:
        case b"VP8X":
            width, height = (int.from_bytes(begin[at : at + 3], "little") + 1 for at in (24, 27))
        case b"VP8L":
            (bits,) = struct.unpack_from("<I", begin, 21)
            width, height = (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
        case b"VP8 ":
            width, height = (side & 0x3FFF for side in struct.unpack_from("<HH", begin, 26))
        case _:
            return 0, 0
    return width, height
