"""Arrays of numbers in an .npz archive, read piece by piece; nothing in it is evaluated or unpickled.

What the archive stores as it is stays there; what it packs is unpacked once, to a temporary file.
"""

import shutil
import tempfile
import warnings
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain, read_exactly
from brushgs.formats.zip_file import ZIP_FAULTS, open_zip, why_not_read
from brushgs.values.arrays import F32

_LOCAL_HEADER = 30  # bytes before the name of a member
_LOCAL_MARK = b"PK\x03\x04"
# Packed floats of scenes become 1.1 to 2 times as large; constant ones up to a thousand times.
_MAX_GROWTH, _SMALL = 50, 64 << 20
_MOST_NAMES = 6  # of members in a message
# What NumPy raises for text that is no header: it parses it, and in a second try splits it into tokens.
_HEADER_FAULTS = (
    *(ValueError, KeyError, TypeError, AttributeError, SyntaxError, MemoryError, RecursionError),
    TokenError,
)
_CURE = "save it again with numpy.savez"


@dataclass(frozen=True, eq=False)
class StoredArray:
    """An array of floats that lies in a file.

    Attributes:
        path: of the archive, for messages.
        shape: of the array.
        dtype: of its numbers.
        start: its first byte in the file.
        unpacked: the numbers in a temporary file, which goes with them; None for those in the archive itself.
    """

    path: Path
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    start: int
    unpacked: NDArray[np.floating[Any]] | None = None

    def read(self, index: int | None = None) -> F32:
        """All of it, or one entry of its first axis.

        Raises:
            SceneError: if the file became shorter.
        """
        if self.unpacked is not None:
            return _float32(self.unpacked if index is None else self.unpacked[index])
        values = np.empty(self.shape if index is None else self.shape[1:], self.dtype)
        start = self.start + (index or 0) * values.nbytes
        with open_plain(self.path, "scene file", buffering=0) as file:
            read_exactly(self.path, file, start, memoryview(values.reshape(-1).view(np.uint8).data))
        return _float32(values)


def _float32(values: NDArray[np.floating[Any]]) -> F32:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array(values, np.float32)


def open_npz(path: Path, names: Iterable[str]) -> tuple[dict[str, StoredArray], tuple[str, ...]]:
    """The arrays of these names, and the names of the other members.

    Raises:
        SceneError: if the archive is damaged, a name is missing, or an array holds other than floats:
            objects, which only a pickle could give, are refused.
    """
    with open_zip(path) as archive:
        found = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
        for name in names:
            if name not in found:
                listed = list(found)
                shown = ", ".join(repr(other[:40]) for other in listed[:_MOST_NAMES]) or "none"
                more = ", ..." if len(listed) > _MOST_NAMES else ""
                fact = f"has no array {name!r} among: {shown}{more}"
                raise SceneError(path, f"{fact}; it should be a params.npz of Dynamic3DGaussians")
        arrays = {name: _open_member(path, archive, found[name], name) for name in names}
    return arrays, tuple(name for name in found if name not in arrays)


def _open_member(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> StoredArray:
    if how := why_not_read(member):
        raise SceneError(path, f"its array {name!r} {how}; {_CURE}")
    try:
        with archive.open(member) as file:
            shape, dtype = _read_header(path, file, name)
            header = file.tell()
            size = header + prod(shape) * dtype.itemsize
            if size != member.file_size:
                fact = f"its array {name!r} has {member.file_size} bytes, and {size} by its header"
                raise SceneError(path, f"{fact}; {_CURE}")
            if member.compress_type != zipfile.ZIP_STORED:
                values = _unpacked(path, file, member, name, dtype)
                return StoredArray(path, shape, dtype, 0, values.reshape(shape))
    except SceneError:
        raise
    except ZIP_FAULTS as error:
        fact = f"its array {name!r} is damaged ({error or 'it is cut off'})"
        raise SceneError(path, f"{fact}; download or copy it again") from None
    start = _start_of(path, member, name)
    return StoredArray(path, shape, dtype, start + header)


def _read_header(path: Path, file: Any, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of an array, of which NumPy evaluates no more than a literal of 10,000 characters."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = npy.read_magic(file)
            read = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}[version]
            shape, is_fortran, dtype = read(file)
    except _HEADER_FAULTS as error:
        fact = f"its array {name!r} has no header that can be read ({type(error).__name__})"
        raise SceneError(path, f"{fact}; {_CURE}") from None
    if dtype.hasobject:
        what = f"its array {name!r} holds Python objects, which only a pickle could give"
        raise SceneError(path, f"{what}: it is not opened; save it as an array of floats")
    if dtype.kind != "f" or dtype.itemsize > 8 or dtype.names or dtype.shape:
        raise SceneError(path, f"its array {name!r} must hold floats, got {str(dtype)[:40]}; {_CURE}")
    if min(shape, default=0) < 0 or not all(type(length) is int for length in shape):
        raise SceneError(path, f"its array {name!r} has the shape {str(shape)[:60]}; {_CURE}")
    if is_fortran and len(shape) > 1:
        cure = "save numpy.ascontiguousarray of it"
        raise SceneError(path, f"its array {name!r} is stored column by column; {cure}")
    return shape, dtype


def _start_of(path: Path, member: zipfile.ZipInfo, name: str) -> int:
    """Where the bytes of a stored member begin in the archive."""
    with open_plain(path, "scene file", buffering=0) as file:
        size = file.seek(0, 2)
        file.seek(member.header_offset)
        local = file.read(_LOCAL_HEADER)
    if len(local) == _LOCAL_HEADER and local.startswith(_LOCAL_MARK):
        lengths = int.from_bytes(local[26:28], "little") + int.from_bytes(local[28:30], "little")
        start = member.header_offset + _LOCAL_HEADER + lengths
        if start + member.file_size <= size:
            return start
    raise SceneError(path, f"its array {name!r} is cut off; download or copy it again")


def _unpacked(
    path: Path, file: Any, member: zipfile.ZipInfo, name: str, dtype: np.dtype[Any]
) -> NDArray[np.floating[Any]]:
    """The rest of a member as numbers in a temporary file."""
    if member.file_size > _MAX_GROWTH * member.compress_size + _SMALL:
        fact = f"its array {name!r} would grow from {member.compress_size} to {member.file_size} bytes"
        raise SceneError(path, f"{fact}; {_CURE}")
    with tempfile.TemporaryFile(prefix="brushgs-") as target:
        shutil.copyfileobj(file, target, 1 << 20)
        target.flush()
        return np.memmap(target, dtype, "r") if target.tell() else np.empty(0, dtype)
