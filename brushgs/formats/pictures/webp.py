"""WebP: a frame becomes a lossless file, 8 bit, display-encoded, straight alpha.

On reading the size is checked before a decoder opens the file, which decodes all of it at once.
"""

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.files import open_plain
from brushgs.formats.pictures.limits import check_pixels
from brushgs.formats.pictures.metadata import metadata_text
from brushgs.formats.pictures.oiio import Background, bytes_of, write_pixels
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame

_TEXT_AT, _MAX_EXIF = 26, 1 << 17  # bytes of Exif data
NUM_HEADER_BYTES = 30  # up to the size in each kind of first chunk
_ATTRIBUTES = {"oiio:UnassociatedAlpha": 1, "Compression": "lossless"}


def write(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> None:
    """See `write_frame`."""
    write_exact(bytes_of(frame, background), path, metadata_text(shot))


def write_exact(pixels: NDArray[np.uint8], path: str | Path, description: str = "") -> None:
    """Write [H, W, 3 or 4] bytes without loss, but for the colour of pixels whose alpha is 0."""
    names = ("R", "G", "B", "A")[: pixels.shape[-1]]

    def describe(written: Path) -> bool:
        if description:
            written.write_bytes(_with_description(written.read_bytes(), description))
        return True

    write_pixels(path, "webp", pixels, names, _ATTRIBUTES, describe)


def _with_description(content: bytes, text: str) -> bytes:
    """A simple WebP as one with Exif data of one field, which OpenImageIO does not write."""
    width, height = stated_size(content[:NUM_HEADER_BYTES])
    has_alpha = content[24] >> 4 & 1  # of VP8L
    size = b"".join((side - 1).to_bytes(3, "little") for side in (width, height))
    # A TIFF whose only field is the image description, text at byte 26.
    exif = (
        struct.pack("<4sIHHHII4x", b"II*\0", 8, 1, 0x010E, 2, len(text) + 1, _TEXT_AT) + text.encode() + b"\0"
    )
    chunks = (
        _chunk(b"VP8X", bytes([8 | has_alpha << 4, 0, 0, 0]) + size) + content[12:] + _chunk(b"EXIF", exif)
    )
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WEBP" + chunks


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


def read_description(path: Path) -> str:
    """The text that `write_exact` wrote; "" if there is none."""
    with open_plain(path, "picture") as file:
        file.seek(12)
        while len(head := file.read(8)) == 8:
            size = int.from_bytes(head[4:], "little")
            if head[:4] == b"EXIF":
                return file.read(min(size, _MAX_EXIF))[_TEXT_AT:].rstrip(b"\0").decode("ascii", "replace")
            file.seek(size + size % 2, 1)
    return ""


def check_file(path: Path, file: BinaryIO, max_pixels: int) -> None:
    """Refuse a WebP of too many pixels. Raises SceneError."""
    file.seek(0)
    check_pixels(path, *stated_size(file.read(NUM_HEADER_BYTES)), max_pixels)


def stated_size(begin: bytes) -> tuple[int, int]:
    """Width and height by the first bytes of a WebP; (0, 0) where there are none, which the decoder refuses.

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
