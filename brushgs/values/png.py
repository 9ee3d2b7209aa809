"""Encode pixels as PNG in memory, for notebooks.

Files are written by `formats.pictures`; this needs nothing but the standard library, so that values can
show themselves. Source: PNG specification (ISO/IEC 15948), sections 9.2 (filters) and 11.2 (chunks).
"""

import struct
import zlib

import numpy as np

from brushgs.values.arrays import U8

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_COLOR_TYPES = {3: 2, 4: 6}  # channels -> RGB, RGBA
_UP = 2  # the filter that stores the difference from the pixel above
_LEVEL = 4  # of zlib: level 9 makes paintings 2 % smaller in four times the time


def png_bytes(pixels: U8) -> bytes:
    """An 8-bit PNG.

    Args:
        pixels: [H, W, 3] RGB, or [H, W, 4] with straight alpha; H and W >= 1.
    """
    height, width, channels = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, _COLOR_TYPES[channels], 0, 0, 0)
    lines = np.full((height, 1 + width * channels), _UP, np.uint8)
    lines[:, 1:] = np.diff(pixels.reshape(height, -1), axis=0, prepend=np.uint8(0))  # modulo 256
    chunks = (
        _chunk(b"IHDR", header),
        _chunk(b"IDAT", zlib.compress(lines.tobytes(), _LEVEL)),
        _chunk(b"IEND", b""),
    )
    return _SIGNATURE + b"".join(chunks)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
