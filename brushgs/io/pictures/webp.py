"""WebP: a frame becomes a lossless file, 8 bit, display-encoded, straight alpha.

On reading the size is checked before a decoder opens the file, which decodes all of it at once.
"""

import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from brushgs.io.pictures.limits import check_pixels
from brushgs.io.pictures.oiio import Background, bytes_of, write_pixels
from brushgs.values.frame import Frame

NUM_HEADER_BYTES = 30  # up to the size in each kind of first chunk
_ATTRIBUTES = {"oiio:UnassociatedAlpha": 1, "Compression": "lossless"}


def write(frame: Frame, path: str | Path, background: Background) -> None:
    """See `write_frame`."""
    write_exact(bytes_of(frame, background), path)


def write_exact(pixels: NDArray[np.uint8], path: str | Path) -> None:
    """Write [H, W, 3 or 4] bytes without loss, but for the colour of pixels whose alpha is 0."""
    names = ("R", "G", "B", "A")[: pixels.shape[-1]]
    write_pixels(path, "webp", pixels, names, _ATTRIBUTES)


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
