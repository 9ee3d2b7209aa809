"""Encode pixels as PNG in memory, for notebooks, and the chunks of any PNG.

Files are written by `formats.pictures.png`; this needs nothing but the standard library, so that values can
show themselves. Source: PNG specification (ISO/IEC 15948), sections 9.2 (filters) and 11.2 (chunks).
"""

import struct
import zlib

import numpy as np

from brushgs.values.arrays import U8

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOR_TYPES = {3: 2, 4: 6}  # channels -> RGB, RGBA
_UP = 2  # the filter that stores the difference from the pixel above
_LEVEL = 4  # of zlib: level 9 makes paintings 2 % smaller in four times the time


def png_bytes(pixels: U8) -> bytes:
    """An 8-bit PNG.

    Args:
        pixels: [H, W, 3] RGB, or [H, W, 4] with straight alpha; H and W >= 1.
    """
    height, width, channels = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, COLOR_TYPES[channels], 0, 0, 0)
    lines = np.full((height, 1 + width * channels), _UP, np.uint8)
    lines[:, 1:] = np.diff(pixels.reshape(height, -1), axis=0, prepend=np.uint8(0))  # modulo 256
    chunks = (
        chunk(b"IHDR", header),
        chunk(b"IDAT", zlib.compress(lines.tobytes(), _LEVEL)),
        chunk(b"IEND", b""),
    )
    return SIGNATURE + b"".join(chunks)


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk: length, kind of four letters, data, checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))
