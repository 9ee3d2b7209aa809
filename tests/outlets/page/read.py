"""Reads a page again, apart from the code that wrote it."""

import base64
import json
import re
import struct
import zlib

import numpy as np

CONTENTS = re.compile(r'<script type="application/octet-stream" id="contents">([A-Za-z0-9+/=]*)</script>')


def read_container(content):
    """Header and arrays of a container; asserts that it is whole."""
    raw = zlib.decompress(content, wbits=31)
    body, checksum = raw[:-4], struct.unpack("<I", raw[-4:])[0]
    assert zlib.crc32(body) == checksum
    assert body[:8] == b"brushgs\x01"
    length = int.from_bytes(body[8:12], "little")
    header = json.loads(body[12 : 12 + length])
    start = -(-(12 + length) // 8) * 8
    assert not any(body[12 + length : start])
    arrays, end = {}, start
    for name, place in header["arrays"].items():
        dtype, count = np.dtype(place["dtype"]), int(np.prod(place["shape"]))
        begin = start + place["offset"]
        end = max(end, begin + count * dtype.itemsize)
        planes = np.frombuffer(body, np.uint8, count * dtype.itemsize, begin).reshape(dtype.itemsize, count)
        arrays[name] = np.ascontiguousarray(planes.T).view(dtype.newbyteorder("<")).reshape(place["shape"])
    assert end == len(body)
    return header, arrays


def read_page(path):
    """Header and arrays of the contents of a page."""
    (text,) = CONTENTS.findall(path.read_text(encoding="utf-8"))
    return read_container(base64.b64decode(text))
