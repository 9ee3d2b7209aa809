"""Extensions of SPZ files: records of a type, a length and as many bytes.

Two are read: our own, which holds what `Stored` does, and the coordinate system
(SPZ_ADOBE_coordinate_system), which names the axes in which the numbers are stored. Numbers stay as they are,
and up is stated, except in a left-handed system: drawn as they are, such scenes would be mirrored, so their x
axis is turned.
"""

import struct
from dataclasses import dataclass
from pathlib import Path

from brushgs.errors import SceneError

_RECORD = struct.Struct("<II")  # type, bytes that follow
_COORDINATE_SYSTEM = 0xADBE0003
_NOTES = 0x42470001  # the upper half names who defines a record: "BG"
# What x, y and z point to (left or right, up or down, front or back), by number; 0 states nothing.
_AXES = (
    *("", "LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF"),
    *("LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"),
)
_OPPOSITE = str.maketrans("LDF", "RUB")
_SHOWN = 6  # types of records that are named


@dataclass(frozen=True)
class Extensions:
    """What the extensions of a file state.

    Attributes:
        up: axis that points up, "+x" to "-z"; None if none is stated.
        is_mirrored: whether the axes are left-handed.
        unknown: names of the extensions that are not read.
        notes: JSON text of what `Stored` holds; empty without.
    """

    up: str | None = None
    is_mirrored: bool = False
    unknown: tuple[str, ...] = ()
    notes: str = ""


def notes_record(text: bytes) -> bytes:
    """The record of our own, which holds a text."""
    return _RECORD.pack(_NOTES, len(text)) + text


NO_EXTENSIONS = Extensions()


def parse_extensions(path: Path, records: memoryview) -> Extensions:
    """Read the records of a file.

    Raises:
        SceneError: if a record is longer than what is left, or names a coordinate system that does not exist.
    """
    axes, notes, unknown = "", "", dict[str, None]()
    start = 0
    while start + _RECORD.size <= len(records):
        kind, size = _RECORD.unpack_from(records, start)
        start += _RECORD.size
        if size > len(records) - start:
            fact = f"extension 0x{kind:08X} has {size} bytes where {len(records) - start} are left"
            raise SceneError(path, f"is damaged: {fact}; copy or download it again")
        if kind == _COORDINATE_SYSTEM:
            axes = _read_axes(path, bytes(records[start : start + size]))
        elif kind == _NOTES:
            notes = bytes(records[start : start + size]).decode("latin-1")
        elif len(unknown) < _SHOWN:
            unknown[f"extension 0x{kind:08X}"] = None
        start += size
    return Extensions(_find_up(axes), _is_left_handed(axes), tuple(unknown), notes)


def _read_axes(path: Path, record: bytes) -> str:
    number = int.from_bytes(record[:4], "little")
    if len(record) < 4 or number >= len(_AXES):
        rule = f"the coordinate system must be a number from 0 to {len(_AXES) - 1}, got {number}"
        raise SceneError(path, f"{rule}; export the scene again")
    return _AXES[number]


def _find_up(axes: str) -> str | None:
    for axis, direction in zip("xyz", axes, strict=False):
        if direction in "UD":
            return f"{'+' if direction == 'U' else '-'}{axis}"
    return None


def _is_left_handed(axes: str) -> bool:
    """Whether x cross y is the opposite of z; right-up-back is right-handed.

    Each axis that is turned changes that, and so does an exchange of two.
    """
    turned = sum(direction in "LDF" for direction in axes)
    exchanged = axes.translate(_OPPOSITE) not in ("", "RUB")
    return (turned + exchanged) % 2 == 1
