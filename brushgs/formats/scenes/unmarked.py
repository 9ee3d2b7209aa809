"""How files of formats without an unmistakable beginning are recognised, also where they were renamed.

A .splat file is rows of 32 bytes without any header, so only plausible values reveal it; the header of a
.ksplat file begins with a version and counts. Imports nothing heavy: the table of formats reads it.
"""

import math
import os
import struct
from pathlib import Path

SPLAT_ROW_SIZE = 32  # position and scales as float32; red, green, blue, opacity and w, x, y, z as bytes
_ROW = struct.Struct("<6f4B4B")
_MIN_ROWS = 8  # fewer may be plausible by chance
_NUM_INSPECTED = 64  # rows, from the first to the last
_LARGEST = 1e6  # of a coordinate or a scale; scenes in metres stay far below
# Writers normalise rotations, then round them to steps of 1/128: in three files they are 0.986 to 1.015 long.
_LENGTHS = 0.95, 1.05
_KSPLAT = struct.Struct("<4s4IH")  # version, most sections, sections, most Gaussians, Gaussians, level
_KSPLAT_VERSION = b"\0\1\0\0"
_MAX_LEVEL = 2


def is_splat(path: Path, begin: bytes) -> bool:
    """Whether a file is a .splat scene: by its suffix or, if it was renamed, by plausible rows throughout.

    Random bytes pass with a probability of about 5e-4 for each of the rows that are inspected.
    """
    return not _is_text(begin) and (path.suffix.lower() == ".splat" or _has_plausible_rows(path))


def is_ksplat(path: Path, begin: bytes) -> bool:
    """Whether a file is a .ksplat scene: by its suffix or, if renamed, by version, counts and level."""
    if path.suffix.lower() == ".ksplat" or len(begin) < _KSPLAT.size:
        return path.suffix.lower() == ".ksplat" and not _is_text(begin)
    version, most_sections, sections, most_rows, rows, level = _KSPLAT.unpack_from(begin)
    are_counts_plausible = 0 < sections <= most_sections < 1 << 16 and 0 < rows <= most_rows < 1 << 31
    return bool(version == _KSPLAT_VERSION and are_counts_plausible and level <= _MAX_LEVEL)


def _is_text(begin: bytes) -> bool:
    """Whether this is a web page or the like: floats always have bytes that are no text."""
    return all(32 <= byte < 127 or byte in b"\t\r\n" for byte in begin)


def _has_plausible_rows(path: Path) -> bool:
    try:
        with path.open("rb", buffering=0) as file:
            size = os.fstat(file.fileno()).st_size
            num_rows = size // SPLAT_ROW_SIZE
            if size % SPLAT_ROW_SIZE or num_rows < _MIN_ROWS:
                return False
            for index in range(min(_NUM_INSPECTED, num_rows)):
                file.seek(SPLAT_ROW_SIZE * (index * num_rows // min(_NUM_INSPECTED, num_rows)))
                if not _is_plausible(file.read(SPLAT_ROW_SIZE)):
                    return False
    except OSError:
        return False
    return True


def _is_plausible(row: bytes) -> bool:
    if len(row) < SPLAT_ROW_SIZE:
        return False
    values = _ROW.unpack(row)
    length = math.hypot(*((byte - 128) / 128 for byte in values[10:]))
    return (
        all(abs(value) < _LARGEST for value in values[:3])  # False for NaN
        and all(0 <= value < _LARGEST for value in values[3:6])
        and max(values[3:6]) > 0
        and _LENGTHS[0] < length < _LENGTHS[1]
    )
