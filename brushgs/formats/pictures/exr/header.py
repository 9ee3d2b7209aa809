"""The begin of an OpenEXR file with deep scan lines, byte by byte.

OpenImageIO writes deep files too, but takes their samples one by one from Python, which takes ten times as
long as writing them here. Source: OpenEXR, File Layout (openexr.com).
"""

import struct
from collections.abc import Mapping
from typing import Any

from brushgs.formats.pictures.exr.attributes import Attribute

UINT, HALF, FLOAT = range(3)  # types of channels
_MAGIC = 20000630
_VERSION, _IS_DEEP = 2, 1 << 11
_ZIPS = 2  # ZIP of single scan lines, the only kind of ZIP that deep files may have
_FORMATS = {"int": "i", "float": "f", "rational": "iI", "chromaticities": "8f", "m44f": "16f"}
_FORMATS |= {"box2i": "4i", "v2f": "2f", "compression": "B", "lineOrder": "B"}


def deep_header(
    width: int,
    height: int,
    most_samples: int,
    channels: Mapping[str, int],
    attributes: Mapping[str, Attribute],
) -> bytes:
    """The file up to the table of the offsets of its scan lines.

    Args:
        width: pixels.
        height: pixels.
        most_samples: of a pixel.
        channels: name -> type, as above.
        attributes: beside those that every file has.
    """
    window = (0, 0, width - 1, height - 1)
    values: dict[str, tuple[str, Any]] = {
        "channels": ("chlist", channels),
        "chunkCount": ("int", height),
        "compression": ("compression", _ZIPS),
        "dataWindow": ("box2i", window),
        "displayWindow": ("box2i", window),
        "lineOrder": ("lineOrder", 0),  # from the top
        "maxSamplesPerPixel": ("int", most_samples),
        "pixelAspectRatio": ("float", 1.0),
        "screenWindowCenter": ("v2f", (0.0, 0.0)),
        "screenWindowWidth": ("float", 1.0),
        "type": ("string", "deepscanline"),
        "version": ("int", 1),
    }
    encoded = (
        _encoded(name, kind, value) for name, (kind, value) in sorted({**values, **attributes}.items())
    )
    return struct.pack("<iI", _MAGIC, _VERSION | _IS_DEEP) + b"".join(encoded) + b"\0"


def _encoded(name: str, kind: str, value: Any) -> bytes:
    """An attribute: name, type, size and value. Names have at most 31 bytes."""
    match kind:
        case "string":
            content = value.encode()
        case "chlist":
            content = b"".join(_channel(*item) for item in sorted(value.items())) + b"\0"
        case _:
            content = struct.pack(f"<{_FORMATS[kind]}", *(value if isinstance(value, tuple) else (value,)))
    return b"%b\0%b\0%b%b" % (name.encode(), kind.encode(), struct.pack("<i", len(content)), content)


def _channel(name: str, pixel_type: int) -> bytes:
    """Name, type, no perceptual flag, and a sample for each pixel."""
    return name.encode() + b"\0" + struct.pack("<iB3xii", pixel_type, 0, 1, 1)
