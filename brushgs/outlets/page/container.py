"""The contents of a page as bytes: one compressed block with a checksum.

    gzip( b"brushgs" 0x01, uint32 length of the header, header as JSON, zeros up to a multiple of 8, arrays,
          uint32 CRC-32 of all before )

All numbers are little-endian. The key "arrays" of the header gives offset, dtype and shape of each array.
Bytes of an array are stored in planes (the first bytes of all numbers, then all second ones, and so on),
since similar signs and exponents compress well together.
"""

import gzip
import json
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from brushgs.outlets.page.contents import PageContents

MAGIC = b"brushgs\x01"
DTYPES = ("float32", "float16", "uint32", "uint16", "uint8")
LEVEL = 9  # of gzip: 7000 strokes take 0.1 s


def write_container(contents: PageContents, *, level: int = LEVEL) -> bytes:
    """The bytes that `container.js` reads; equal contents give equal bytes.

    Args:
        contents: of the page.
        level: of gzip, 0 to 9.

    Raises:
        TypeError: if an array has another dtype.
        ValueError: if a number in the header is not finite.
    """
    planes, places, offset = [], {}, 0
    for name, array in contents.arrays.items():
        if array.dtype.name not in DTYPES:
            raise TypeError(f"write_container: {name} must be {', '.join(DTYPES)}, got {array.dtype}")
        places[name] = {"offset": offset, "dtype": array.dtype.name, "shape": list(array.shape)}
        planes.append(_planes(array))
        offset += array.nbytes
    text = json.dumps({**contents.header, "arrays": places}, allow_nan=False, separators=(",", ":"))
    header = text.encode("ascii")  # json escapes other characters
    start = MAGIC + struct.pack("<I", len(header)) + header
    body = start.ljust(-(-len(start) // 8) * 8, b"\0") + b"".join(planes)
    return gzip.compress(body + struct.pack("<I", zlib.crc32(body)), level, mtime=0)


def _planes(array: NDArray[np.generic]) -> bytes:
    little = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
    return little.reshape(-1).view(np.uint8).reshape(-1, little.itemsize).T.tobytes()
