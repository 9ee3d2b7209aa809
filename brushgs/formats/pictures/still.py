"""Write frames as PNG, TIFF, JPEG or WebP: display-encoded, with straight alpha if the format has alpha.

Before reading, the size of JPEG and WebP files is checked, as their decoders allocate memory before they
report it. A progressive JPEG allocates all of its pixels when it is opened, and may have thousands of scans
over the whole picture; a WebP is decoded all at once.
"""

import re
import struct
from pathlib import Path
from typing import Any, BinaryIO

from brushgs.core.signals import defer_stop
from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, replacing
from brushgs.formats.pictures import oiio
from brushgs.formats.pictures.images import check_pixels
from brushgs.formats.pictures.metadata import described, metadata_text
from brushgs.formats.pictures.oiio import Background, Strips
from brushgs.formats.pictures.panorama import panorama_tags
from brushgs.values.arrays import U8
from brushgs.values.frame import Frame
from brushgs.values.shot import Shot

_TIFF = {"oiio:UnassociatedAlpha": 1, "DateTime": oiio.NO_DATE, "tiff:zipquality": 2}


def write_tiff(
    frame: Frame | Strips, path: str | Path, background: Background, *, bits: int, shot: Shot | None = None
) -> None:
    """See `write_frame`."""
    layout = oiio.Layout("tiff", oiio.shape_of(frame, background), bits, _TIFF | described(shot))
    oiio.write_frame_as(path, layout, frame, background)


_JPEG = {"Compression": "jpeg:95", "jpeg:subsampling": "4:4:4"}
_MAX_SCANS = 100  # cameras and editors write 1 to 14
_START_OF_SCAN = b"\xff\xda"
_MAX_SEGMENTS = 10_000  # before the size; cameras write a few dozen
# Markers that contain the size (all SOF; not DHT, JPG and DAC), and those without content.
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})
_MARKER = re.compile(rb"\xff([^\x00\xff])", re.DOTALL)
_PIECE = 1 << 20  # bytes searched at a time for scans
_SMALL_PIECE = 1 << 12  # bytes searched at a time for the next marker, which is usually near


def write_jpeg(
    frame: Frame | Strips, path: str | Path, background: Background, *, shot: Shot | None = None
) -> None:
    """See `write_frame`."""
    if background is None:
        raise ValueError(f"write_frame: a JPEG holds no transparency, got {str(path)!r}; give a background")
    height, width, _ = oiio.shape_of(frame, background)
    attributes: dict[str, Any] = {**_JPEG, **described(shot)}
    if shot is not None and shot.panorama is not None:
        attributes |= panorama_tags(shot.panorama, width, height)
    oiio.write_frame_as(path, oiio.Layout("jpeg", (height, width, 3), 8, attributes), frame, background)


def encode_jpeg(pixels: U8, quality: int) -> bytes:
    """Encode a picture [H, W, 3] as JPEG with a quality of 1 to 100 and 4:2:0 chroma.

    Raises SceneError if the folder for temporary files is full.
    """
    attributes = {"Compression": f"jpeg:{quality}", "jpeg:subsampling": "4:2:0"}
    return oiio.encode_pixels("jpeg", pixels, attributes)


def check_jpeg(path: Path, file: BinaryIO, max_pixels: int) -> None:
    """Refuse a JPEG of too many pixels or scans. Raises SceneError."""
    check_pixels(path, *_jpeg_size(path, file), max_pixels)
    file.seek(0)
    num_scans, last = 0, b""
    while piece := file.read(_PIECE):
        num_scans += (last + piece).count(_START_OF_SCAN)
        last = piece[-1:]
    if num_scans > _MAX_SCANS:
        fact = f"must be stored in at most {_MAX_SCANS} scans, got {num_scans}"
        raise SceneError(path, f"{fact}; save it again as a plain JPEG or PNG")


def _jpeg_size(path: Path, file: BinaryIO) -> tuple[int, int]:
    """Width and height in the header; (0, 0) if there is none, which the decoder refuses.

    Bytes between two segments are skipped, as decoders do. Source: ITU T.81, annex B.

    Raises SceneError if more than `_MAX_SEGMENTS` segments precede it.
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
    """Code of the next marker, with the file positioned after it; None at the end of the file."""
    while piece := file.read(_SMALL_PIECE):
        match = _MARKER.search(piece)
        if match is not None:
            file.seek(match.end() - len(piece), 1)
            return match[1][0]
        if piece.endswith(b"\xff") and len(piece) > 1:  # its code is in the next piece
            file.seek(-1, 1)
    return None


_TEXT_AT, _MAX_EXIF = 26, 1 << 17  # bytes of Exif data
NUM_HEADER_BYTES = 30  # enough to contain the size in every kind of first chunk
_WEBP = {"oiio:UnassociatedAlpha": 1, "Compression": "lossless"}


def write_webp(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> None:
    """See `write_frame`."""
    write_exact(oiio.pixels_of(frame, background, 8), path, metadata_text(shot))


def write_exact(pixels: oiio.Pixels, path: str | Path, description: str = "") -> None:
    """Write [H, W, 3 or 4] bytes as lossless WebP; only colors of pixels with alpha 0 may change."""
    with defer_stop(), replacing(path, most=pixels.nbytes + oiio.HEADER) as temporary:
        oiio.encode_rows(temporary, path, iter([pixels]), oiio.Layout("webp", pixels.shape, 8, _WEBP))
        if description:
            temporary.write_bytes(_with_description(temporary.read_bytes(), description))


def _with_description(content: bytes, text: str) -> bytes:
    """Add Exif data with one field to a simple WebP, which OpenImageIO does not support."""
    width, height = stated_size(content[:NUM_HEADER_BYTES])
    has_alpha = content[24] >> 4 & 1  # of VP8L
    size = b"".join((side - 1).to_bytes(3, "little") for side in (width, height))
    # A TIFF whose only field is the image description; its text starts at byte 26.
    exif = (
        struct.pack("<4sIHHHII4x", b"II*\0", 8, 1, 0x010E, 2, len(text) + 1, _TEXT_AT) + text.encode() + b"\0"
    )
    head = _webp_chunk(b"VP8X", bytes([8 | has_alpha << 4, 0, 0, 0]) + size)
    chunks = head + content[12:] + _webp_chunk(b"EXIF", exif)
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WEBP" + chunks


def _webp_chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def read_description(path: Path) -> str:
    """The text stored by `write_exact`; "" if there is none."""
    with open_plain(path, "picture") as file:
        file.seek(12)
        while len(head := file.read(8)) == 8:
            size = int.from_bytes(head[4:], "little")
            if head[:4] == b"EXIF":
                return file.read(min(size, _MAX_EXIF))[_TEXT_AT:].rstrip(b"\0").decode("ascii", "replace")
            file.seek(size + size % 2, 1)
    return ""


def check_webp(path: Path, file: BinaryIO, max_pixels: int) -> None:
    """Refuse a WebP of too many pixels. Raises SceneError."""
    file.seek(0)
    check_pixels(path, *stated_size(file.read(NUM_HEADER_BYTES)), max_pixels)


def stated_size(begin: bytes) -> tuple[int, int]:
    """Width and height in the first bytes of a WebP; (0, 0) if there are none, which the decoder refuses.

    Source: RFC 9649, WebP Image Format. The frames of an animation lie within the canvas.
    """
    begin = begin.ljust(NUM_HEADER_BYTES, b"\0")
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
