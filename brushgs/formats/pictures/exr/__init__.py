"""Write frames as OpenEXR: flat with the layers of the frame, or deep if it has deep samples.

`planes.py` makes the channels of a frame, `cryptomatte.py` those of a matte. A flat file is written a band of
rows at a time, to save memory. A deep file holds the strokes of each pixel, display-encoded as they are
blended: composited in file order, the samples of a pixel give the picture, which they would not in linear
light. OpenImageIO also writes deep files, but accepts samples only one by one from Python, which takes ten
times as long. Source: OpenEXR, File Layout (openexr.com).
"""

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.core.signals import defer_stop
from brushgs.formats.files import replacing
from brushgs.formats.pictures.exr import planes as channels
from brushgs.formats.pictures.exr.cryptomatte import cryptomattes_of
from brushgs.formats.pictures.exr.planes import LARGEST_HALF, Attribute, Plane
from brushgs.formats.pictures.oiio import NO_DATE, Background, not_written
from brushgs.options.choices import FileSpace
from brushgs.values.frame import Frame
from brushgs.values.layers import DeepSamples
from brushgs.values.shot import Shot

if TYPE_CHECKING:
    import OpenImageIO


UINT, HALF, FLOAT = range(3)  # pixel types of channels
_MAGIC = 20000630
_VERSION, _IS_DEEP = 2, 1 << 11
_ZIPS = 2  # ZIP compression of single scan lines, the only ZIP allowed in deep files
_FORMATS = {"int": "i", "float": "f", "rational": "iI", "chromaticities": "8f", "m44f": "16f"}
_FORMATS |= {"box2i": "4i", "v2f": "2f", "compression": "B", "lineOrder": "B"}


def _window(shot: Shot, width: int, height: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """(left, top) of the upper left pixel in the whole picture, and (width, height) of the whole picture."""
    if shot.part is None or shot.camera is None:
        return (0, 0), (width, height)
    return (shot.part.left, shot.part.top), (shot.camera.width, shot.camera.height)


def _deep_header(deep: DeepSamples, most_samples: int, shot: Shot, attributes: dict[str, Attribute]) -> bytes:
    """The file up to its table of line offsets: required attributes and the given ones."""
    (left, top), (width, height) = _window(shot, deep.width, deep.height)
    values: dict[str, tuple[str, Any]] = {
        "channels": ("chlist", _CHANNELS),
        "chunkCount": ("int", deep.height),
        "compression": ("compression", _ZIPS),
        "dataWindow": ("box2i", (left, top, left + deep.width - 1, top + deep.height - 1)),
        "displayWindow": ("box2i", (0, 0, width - 1, height - 1)),
        "lineOrder": ("lineOrder", 0),  # increasing y
        "maxSamplesPerPixel": ("int", most_samples),
        "pixelAspectRatio": ("float", 1.0),
        "screenWindowCenter": ("v2f", (0.0, 0.0)),
        "screenWindowWidth": ("float", 1.0),
        "type": ("string", "deepscanline"),
        "version": ("int", 1),
    }
    encoded = (_encoded(name, *value) for name, value in sorted({**values, **attributes}.items()))
    return struct.pack("<iI", _MAGIC, _VERSION | _IS_DEEP) + b"".join(encoded) + b"\0"


def _encoded(name: str, kind: str, value: Any) -> bytes:
    """Encode an attribute: name, type, size and value. Names have at most 31 bytes."""
    match kind:
        case "string":
            content = value.encode()
        case "chlist":
            content = b"".join(_channel(*item) for item in sorted(value.items())) + b"\0"
        case _:
            content = struct.pack(f"<{_FORMATS[kind]}", *(value if isinstance(value, tuple) else (value,)))
    return b"%b\0%b\0%b%b" % (name.encode(), kind.encode(), struct.pack("<i", len(content)), content)


def _channel(name: str, pixel_type: int) -> bytes:
    """Encode a channel: name, type, no perceptual flag, no subsampling."""
    return name.encode() + b"\0" + struct.pack("<iB3xii", pixel_type, 0, 1, 1)


_DEEP_NOTES = {
    "RGBA": "display-encoded (sRGB), premultiplied: samples that are laid over each other as they are, the "
    "nearest first, are the picture; in linear light they differ from it",
    "Z": "camera z in world units",
    "id": "1 + the number of the stroke in the painting; 0 is no stroke",
}
_NAMES = "names of the strokes, id 1 first, stand in the file {}"
_CHANNELS = {"A": HALF, "B": HALF, "G": HALF, "R": HALF, "Z": FLOAT, "id": UINT}  # in the order of the file
_LEVEL = 4  # of zlib, the default of OpenEXR


def write_deep(deep: DeepSamples, path: str | Path, shot: Shot) -> None:
    """Write deep samples, without the background of the picture. See `write_frame`."""
    counts = np.diff(deep.starts)
    names = {} if shot.manifest is None else {"names": _NAMES.format(shot.manifest.as_posix())}
    attributes = channels.attributes_of(shot, _DEEP_NOTES | names, "srgb")
    (_, top), _ = _window(shot, deep.width, deep.height)
    header = _deep_header(deep, int(counts.max(initial=0)), shot, attributes)
    offsets = np.empty(deep.height, "<u8")
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(header)
        file.write(offsets.tobytes())
        for y in range(deep.height):
            offsets[y] = file.tell()
            pixels = slice(y * deep.width, (y + 1) * deep.width)
            samples = _samples(deep, slice(deep.starts[pixels.start], deep.starts[pixels.stop]))
            ends = np.cumsum(counts[pixels], dtype="<i4").tobytes()
            packed_ends, packed = _packed(ends), _packed(samples)
            file.write(struct.pack("<iQQQ", top + y, len(packed_ends), len(packed), len(samples)))
            file.write(packed_ends)
            file.write(packed)
        file.seek(len(header))
        file.write(offsets.tobytes())


def _samples(deep: DeepSamples, rows: slice) -> bytes:
    """Encode the samples of a scan line, one channel of `_CHANNELS` after the other."""
    halves = np.vstack([deep.alphas[rows], deep.colors[rows, ::-1].T])
    halves = np.clip(halves, -LARGEST_HALF, LARGEST_HALF).astype("<f2")
    return b"".join(values.tobytes() for values in (halves, deep.depths[rows].astype("<f4"), deep.ids[rows]))


def _packed(data: bytes) -> bytes:
    """Compress bytes as the ZIP of OpenEXR: even ones before odd ones, differences, zlib.

    Data that does not become shorter is stored uncompressed.
    """
    source = np.frombuffer(data, np.uint8)
    parted = np.concatenate([source[::2], source[1::2]])
    parted[1:] -= parted[:-1] + np.uint8(128)  # modulo 256
    packed = zlib.compress(parted.tobytes(), _LEVEL)
    return packed if len(packed) < len(data) else data


_MOST_HEADER = 1 << 17  # bytes of the attributes of a flat file; the description is the longest
_NUM_ROWS = 16  # written at a time: a block of the ZIP compression, small enough for caches
_TYPES = {"chromaticities": "float[8]", "m44f": "matrix"}  # types whose name differs in OpenImageIO


def write_flat(frame: Frame, path: str | Path, background: Background, shot: Shot, space: FileSpace) -> None:
    """Write a flat file with the layers of a frame. See `write_frame`."""
    import OpenImageIO

    planes = channels.planes_of(frame, background, space)
    words = channels.SPACES[space].words
    notes = {plane.layer: channels.NOTES[plane.layer].format(space=words) for plane in planes}
    attributes = channels.attributes_of(shot, notes, space)
    for planes_of_matte, attributes_of_matte in cryptomattes_of(frame, shot):
        planes += planes_of_matte
        attributes |= attributes_of_matte
    height, width = frame.alpha.shape
    spec = OpenImageIO.ImageSpec(width, height, len(planes), "half")
    spec.channelnames = tuple(plane.name for plane in planes)
    spec.channelformats = tuple(plane.kind for plane in planes)
    spec.alpha_channel = spec.channelnames.index("A")
    spec.z_channel = spec.channelnames.index("Z") if "Z" in spec.channelnames else -1
    (spec.x, spec.y), (spec.full_width, spec.full_height) = _window(shot, width, height)
    spec.attribute("DateTime", NO_DATE)
    spec.attribute("compression", "zip")
    for name, (kind, value) in attributes.items():
        spec.attribute(name, _TYPES.get(kind, kind), value)
    out = OpenImageIO.ImageOutput.create("openexr")
    assert out is not None, "the formats of the table are part of every build of OpenImageIO"
    # An interrupted encoder prints errors to the terminal.
    with defer_stop(), replacing(path) as temporary:
        is_written = out.open(str(temporary), spec) and _write_bands(out, planes, (width, height), spec.y)
        if not (out.close() and is_written):
            raise not_written(path, temporary, out)
        if "envmap" in attributes:
            with temporary.open("r+b") as file:
                header = channels.mark_latlong(file.read(_MOST_HEADER))
                file.seek(0)
                file.write(header)


def _write_bands(
    out: "OpenImageIO.ImageOutput", planes: Sequence[Plane], size: tuple[int, int], top: int
) -> bool:
    """Write all rows, the first as row `top`; returns whether that succeeded."""
    width, height = size
    band = np.empty((min(_NUM_ROWS, height), width, len(planes)), np.float32)
    for start in range(0, height, _NUM_ROWS):
        stop = min(start + _NUM_ROWS, height)
        pixels = band[: stop - start]
        for i, plane in enumerate(planes):
            values = plane.rows(slice(start, stop))
            if plane.kind == "half":
                np.clip(values, -LARGEST_HALF, LARGEST_HALF, out=pixels[..., i])
            else:
                pixels[..., i] = values
        if not out.write_scanlines(top + start, top + stop, 0, pixels):
            return False
    return True


def write(
    frame: Frame,
    path: str | Path,
    background: Background,
    shot: Shot | None = None,
    colorspace: FileSpace | None = None,
) -> None:
    """See `write_frame`."""
    shot = Shot() if shot is None else shot
    if frame.deep is None:
        write_flat(frame, path, background, shot, colorspace or channels.DEFAULT)
    else:
        write_deep(frame.deep, path, shot)
