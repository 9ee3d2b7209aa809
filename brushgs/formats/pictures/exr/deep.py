"""The strokes in each pixel go to a deep OpenEXR file, a scan line at a time.

Colours stay display-encoded, as strokes are blended: laid over each other in the order of the file, the
samples of a pixel are the picture, which they would not be in linear light.
"""

import struct
import zlib
from pathlib import Path

import numpy as np

from brushgs.formats.files import replacing
from brushgs.formats.pictures.exr.attributes import attributes_of
from brushgs.formats.pictures.exr.header import FLOAT, HALF, UINT, deep_header
from brushgs.formats.pictures.exr.planes import LARGEST_HALF
from brushgs.formats.pictures.shot import Shot
from brushgs.values.layers import DeepSamples

NOTES = {
    "RGBA": "display-encoded (sRGB), premultiplied: samples that are laid over each other as they are, the "
    "nearest first, are the picture; in linear light they differ from it",
    "Z": "camera z in world units",
    "id": "1 + the number of the stroke in the painting; 0 is no stroke",
}
_NAMES = "names of the strokes, id 1 first, stand in the file {}"
_CHANNELS = {"A": HALF, "B": HALF, "G": HALF, "R": HALF, "Z": FLOAT, "id": UINT}  # in the order of the file
_LEVEL = 4  # of zlib, as OpenEXR has it


def write_deep(deep: DeepSamples, path: str | Path, shot: Shot) -> None:
    """Write the samples; the background of the picture is not among them. See `write_frame`."""
    counts = np.diff(deep.starts)
    names = {} if shot.manifest is None else {"names": _NAMES.format(shot.manifest.as_posix())}
    attributes = attributes_of(shot, NOTES | names, is_linear=False)
    header = deep_header(deep.width, deep.height, int(counts.max(initial=0)), _CHANNELS, attributes)
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
            file.write(struct.pack("<iQQQ", y, len(packed_ends), len(packed), len(samples)))
            file.write(packed_ends)
            file.write(packed)
        file.seek(len(header))
        file.write(offsets.tobytes())


def _samples(deep: DeepSamples, rows: slice) -> bytes:
    """Samples of a scan line, one channel of `_CHANNELS` after the other."""
    halves = np.vstack([deep.alphas[rows], deep.colors[rows, ::-1].T])
    halves = np.clip(halves, -LARGEST_HALF, LARGEST_HALF).astype("<f2")
    return b"".join(values.tobytes() for values in (halves, deep.depths[rows].astype("<f4"), deep.ids[rows]))


def _packed(data: bytes) -> bytes:
    """Bytes as OpenEXR compresses them by ZIP: even ones before odd ones, differences, zlib.

    What does not become shorter stays as it is.
    """
    source = np.frombuffer(data, np.uint8)
    parted = np.concatenate([source[::2], source[1::2]])
    parted[1:] -= parted[:-1] + np.uint8(128)  # modulo 256
    packed = zlib.compress(parted.tobytes(), _LEVEL)
    return packed if len(packed) < len(data) else data
