"""A strict reader of the begin of OpenEXR files, by hand from the specification "OpenEXR File Layout"."""

import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO

PIXEL_TYPES = ("uint", "half", "float")
NUMBERS = {"int": "i", "float": "f", "rational": "iI", "chromaticities": "8f", "m44f": "16f", "v2f": "2f"}
NUMBERS |= {"box2i": "4i", "compression": "B", "lineOrder": "B"}


@dataclass
class Header:
    """What a file says of itself: attributes as name -> (type, value), channels as name -> type."""

    version: int
    attributes: dict[str, tuple[str, Any]] = field(default_factory=dict)
    channels: dict[str, str] = field(default_factory=dict)
    size: int = 0

    def value(self, name: str) -> Any:
        return self.attributes[name][1]


def read_header(path: Path) -> Header:
    content = path.read_bytes()
    at = 8

    def text() -> str:
        nonlocal at
        end = content.index(b"\0", at)
        found, at = content[at:end].decode("utf-8"), end + 1
        return found

    magic, version = struct.unpack_from("<II", content)
    assert magic == 20000630
    header = Header(version)
    longest = 255 if version & 1 << 10 else 31
    while name := text():
        kind = text()
        assert len(name.encode()) <= longest
        assert name not in header.attributes
        (size,) = struct.unpack_from("<i", content, at)
        at += 4
        end = at + size
        if kind == "chlist":
            while channel := text():
                pixel_type, is_linear, x_step, y_step = struct.unpack_from("<iB3xii", content, at)
                assert (is_linear, x_step, y_step) == (0, 1, 1)
                header.channels[channel] = PIXEL_TYPES[pixel_type]
                at += 16
            assert at == end
            assert list(header.channels) == sorted(header.channels)  # by bytes, as the format demands
        elif kind == "string":
            header.attributes[name] = kind, content[at:end].decode("utf-8")
        else:
            values = struct.unpack("<" + NUMBERS[kind], content[at:end])
            header.attributes[name] = kind, values if len(values) > 1 else values[0]
        at = end
    header.size = at
    for name in ("compression", "dataWindow", "displayWindow", "lineOrder", "pixelAspectRatio"):
        assert name in header.attributes, f"{name} is required"
    assert {"screenWindowCenter", "screenWindowWidth"} <= set(header.attributes)
    return header


def channels_of(path: Path) -> dict[str, np.ndarray]:
    """The channels of a flat file by name, as OpenImageIO reads them."""
    source = OpenImageIO.ImageInput.open(str(path))
    names = source.spec().channelnames
    pixels = source.read_image(0, 0, 0, len(names), OpenImageIO.FLOAT)
    source.close()
    return dict(zip(names, np.moveaxis(pixels, -1, 0), strict=True))
