"""A value and arrays in one file: a JSON header and plain arrays, which are mapped into memory."""

import json
import mmap
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

_WORD, _ALIGNED = 8, 64  # bytes of a word of the checksum; and the multiples at which arrays start


def write_arrays(path: Path, value: Any, arrays: Mapping[str, np.ndarray[Any, Any]]) -> None:
    """Write a new file: checksum and length of the header as words, the header, and the arrays.

    Raises:
        OSError: if it cannot be written.
    """
    layout, parts, start = {}, [], 0
    for name, array in arrays.items():
        is_fortran = array.flags.f_contiguous and not array.flags.c_contiguous
        layout[name] = array.dtype.str, array.shape, "F" if is_fortran else "C", start
        parts.append(np.ascontiguousarray(array.T if is_fortran else array).reshape(-1).view(np.uint8))
        start += -(-array.nbytes // _ALIGNED) * _ALIGNED
    header = json.dumps({"value": value, "arrays": layout}).encode()
    header += b" " * (-(len(header) + 2 * _WORD) % _ALIGNED)
    head = np.frombuffer(len(header).to_bytes(_WORD, sys.byteorder) + header, np.uint8)
    with path.open("xb") as file:
        file.write(bytes(_WORD))
        total = 0
        for part in (head, *parts):
            file.write(part.data)
            file.write(bytes(-file.tell() % _ALIGNED))
            whole = len(part) // _WORD * _WORD
            total += int(part[:whole].view(np.uint64).sum(dtype=np.uint64))
            total += int.from_bytes(part[whole:].tobytes(), sys.byteorder)
        file.seek(0)
        file.write((total % (1 << 8 * _WORD)).to_bytes(_WORD, sys.byteorder))


def read_arrays(path: Path) -> tuple[Any, dict[str, np.ndarray[Any, Any]]]:
    """The header's value and the arrays of a file; changes of these arrays do not reach it.

    Raises:
        OSError: if there is none.
        ValueError: if it is damaged.
    """
    with path.open("rb") as file:
        mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_COPY)
    words = np.frombuffer(mapped, np.uint64)
    if words[0] != words[1:].sum(dtype=np.uint64):
        raise ValueError("the checksum is wrong")
    start = 2 * _WORD + int(words[1])
    header = json.loads(mapped[2 * _WORD : start])
    arrays = {
        name: np.ndarray(shape, dtype, mapped, start + offset, order=order)
        for name, (dtype, shape, order, offset) in header["arrays"].items()
    }
    return header["value"], arrays
