"""JPEG: a frame on a background becomes a file of quality 95, with a chroma sample for every pixel.

On reading the size and the number of scans are checked before a decoder opens the file: a progressive JPEG
takes memory for all of its pixels as soon as it is opened, and one may be stored in thousands of scans over
the whole picture.
"""

import re
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import scratch_folder
from brushgs.formats.pictures.limits import check_pixels
from brushgs.formats.pictures.metadata import described
from brushgs.formats.pictures.oiio import Background, bytes_of, write_pixels
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame

_ATTRIBUTES = {"Compression": "jpeg:95", "jpeg:subsampling": "4:4:4"}
_MAX_SCANS = 100  # cameras and editors write 1 to 14
_START_OF_SCAN = b"\xff\xda"
_MAX_SEGMENTS = 10_000  # before the size; cameras write some tens
# Markers that state the size (all SOF, not DHT, JPG and DAC), and those without content.
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})
_MARKER = re.compile(rb"\xff([^\x00\xff])", re.DOTALL)
_PIECE = 1 << 20  # bytes searched at a time for scans,
_SMALL_PIECE = 1 << 12  # and for the next marker, which is mostly near


def write(frame: Frame, path: str | Path, background: Background, *, shot: Shot | None = None) -> None:
    """See `write_frame`."""
    if background is None:
        raise ValueError(f"write_frame: a JPEG holds no transparency, got {str(path)!r}; give a background")
    write_pixels(path, "jpeg", bytes_of(frame, background), ("R", "G", "B"), _ATTRIBUTES | described(shot))


def encode_jpeg(pixels: NDArray[np.uint8], quality: int) -> bytes:
    """The bytes of a picture [H, W, 3] of a quality of 1 to 100, with a chroma sample for four pixels.

    Raises:
        SceneError: if the folder for temporary files is full.
    """
    attributes = {"Compression": f"jpeg:{quality}", "jpeg:subsampling": "4:2:0"}
    with scratch_folder() as folder:  # OpenImageIO writes to named files only
        path = folder / "picture.jpg"
        write_pixels(path, "jpeg", pixels, ("R", "G", "B"), attributes)
        return path.read_bytes()


def check_file(path: Path, file: BinaryIO, max_pixels: int) -> None:
    """Refuse a JPEG of too many pixels or scans. Raises SceneError."""
    check_pixels(path, *_size(path, file), max_pixels)
    file.seek(0)
    num_scans, last = 0, b""
    while piece := file.read(_PIECE):
        num_scans += (last + piece).count(_START_OF_SCAN)
        last = piece[-1:]
    if num_scans > _MAX_SCANS:
        fact = f"must be stored in at most {_MAX_SCANS} scans, got {num_scans}"
        raise SceneError(path, f"{fact}; save it again as a plain JPEG or PNG")


def _size(path: Path, file: BinaryIO) -> tuple[int, int]:
    """Width and height in the header; (0, 0) where there is none, which the decoder refuses.

    Source: ITU T.81, annex B. Bytes between two segments are skipped, as decoders do.

    Raises:
        SceneError: if there are more than `_MAX_SEGMENTS` segments before it.
    """
    file.seek(2)
    for _ in range(_MAX_SEGMENTS):
        marker = _next_marker(file)
        if marker is None or marker == _START_OF_SCAN[1]:
            return 0, 0
        if marker in _BARE:
            continue
        begin = file.read(7)
        if marker in _FRAMES and len(begin) == 7:
            height, width = struct.unpack(">3xHH", begin)
            return width, height
        length = int.from_bytes(begin[:2], "big")
        file.seek(max(length, 2) - len(begin), 1)
    raise SceneError(path, f"states no size in its first {_MAX_SEGMENTS} segments; save it again as a PNG")


def _next_marker(file: BinaryIO) -> int | None:
    """The code of the next marker, read up to its end; None at the end of the file."""
    while piece := file.read(_SMALL_PIECE):
        match = _MARKER.search(piece)
        if match is not None:
            file.seek(match.end() - len(piece), 1)
            return match[1][0]
        if piece.endswith(b"\xff") and len(piece) > 1:  # its code is in the next piece
            file.seek(-1, 1)
    return None
