"""Read the params.npz of Dynamic3DGaussians: centers, rotations and colors of every moment in one archive.

Scales and opacities are constant in time; colors may be. Colors are RGB, 0 to 1, without view dependence.
Moments are 1/30 s apart, as in the captures that it was made for. Files of SplaTAM use the same names, and
have one moment. Source: Luiten et al. 2024, Dynamic 3D Gaussians; helpers.py, `save_params`.

Arrays are read piece by piece; nothing in the archive is evaluated or unpickled. Uncompressed members are
read in place; compressed ones are decompressed once, to a temporary file.
"""

import shutil
import tempfile
import warnings
import zipfile
from collections.abc import Iterable
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import Any, NamedTuple

import numpy as np
from numpy.lib import format as npy

from brushgs.errors import SceneError
from brushgs.formats.files import cut_off, open_plain, read_exactly
from brushgs.formats.moving.formula import NOMINAL_RATE, open_nothing
from brushgs.formats.moving.kept import Kept, Moments, keep_rows
from brushgs.formats.scenes.columns import STANDARD, Columns
from brushgs.formats.scenes.open_file import join_notes
from brushgs.formats.scenes.rows import SceneFile
from brushgs.formats.zip_file import open_member, open_zip
from brushgs.values.arrays import F32, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene
from brushgs.values.sh import C0

_LOCAL_HEADER = 30  # bytes before the name of a member
_LOCAL_MARK = b"PK\x03\x04"
# Decompression makes floats of scenes 1.1 to 2 times as large; constant ones up to a thousand times.
_MAX_GROWTH, _SMALL = 50, 64 << 20
_MOST_NAMES = 6  # member names in a message
# Exceptions of NumPy for an invalid header: it parses the text, then retries with its tokens.
_HEADER_FAULTS = (
    *(ValueError, KeyError, TypeError, AttributeError, SyntaxError, MemoryError, RecursionError),
    TokenError,
)
_CURE = "save it again with numpy.savez"


class StoredArray(NamedTuple):
    """An array of floats stored in a file."""

    path: Path  # the archive, for messages
    shape: tuple[int, ...]  # of the array
    dtype: np.dtype[Any]  # of the array
    start: int  # offset of its first byte in the file
    # memory map of a temporary file, deleted with the map; None for an array read from the archive itself
    unpacked: Array | None = None

    @property
    def moments(self) -> int | None:
        """Number of moments; None if the array is constant in time."""
        return self.shape[0] if len(self.shape) == 3 else None

    def read(self, index: int | None = None) -> F32:
        """The whole array, or one entry of its first axis. Raises SceneError if the file became shorter."""
        if self.unpacked is not None:
            return _float32(self.unpacked if index is None else self.unpacked[index])
        values = np.empty(self.shape if index is None else self.shape[1:], self.dtype)
        start = self.start + (index or 0) * values.nbytes
        with open_plain(self.path, "scene file", buffering=0) as file:
            read_exactly(self.path, file, start, memoryview(values.reshape(-1).view(np.uint8).data))
        return _float32(values)


def _float32(values: Array) -> F32:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.array(values, np.float32)


def open_npz(path: Path, names: Iterable[str]) -> tuple[dict[str, StoredArray], tuple[str, ...]]:
    """The arrays with these names, and the names of the other members.

    Raises SceneError if the archive is damaged, a name is missing, or an array does not hold floats (object
    arrays, which need a pickle, are refused).
    """
    with open_zip(path) as archive:
        found = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
        for name in names:
            if name not in found:
                shown = ", ".join(repr(other[:40]) for other in list(found)[:_MOST_NAMES]) or "none"
                fact = f"has no array {name!r} among: {shown}{', ...' if len(found) > _MOST_NAMES else ''}"
                raise SceneError(path, f"{fact}; it should be a params.npz of Dynamic3DGaussians")
        arrays = {name: _open_member(path, archive, found[name], name) for name in names}
    return arrays, tuple(name for name in found if name not in arrays)


def _open_member(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, name: str) -> StoredArray:
    with open_member(path, archive, member, f"array {name!r}", _CURE) as file:
        shape, dtype = _read_header(path, file, name)
        header = file.tell()
        size = header + prod(shape) * dtype.itemsize
        if size != member.file_size:
            fact = f"its array {name!r} has {member.file_size} bytes, and {size} by its header"
            raise SceneError(path, f"{fact}; {_CURE}")
        if member.compress_type != zipfile.ZIP_STORED:
            values = _unpacked(path, file, member, name, dtype)
            return StoredArray(path, shape, dtype, 0, values.reshape(shape))
    return StoredArray(path, shape, dtype, _start_of(path, member, name) + header)


def _read_header(path: Path, file: Any, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and dtype of an array. NumPy evaluates only a literal, of at most 10,000 characters."""
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
    """Offset of the bytes of an uncompressed member in the archive."""
    with open_plain(path, "scene file", buffering=0) as file:
        size = file.seek(0, 2)
        file.seek(member.header_offset)
        local = file.read(_LOCAL_HEADER)
    if len(local) == _LOCAL_HEADER and local.startswith(_LOCAL_MARK):
        lengths = int.from_bytes(local[26:28], "little") + int.from_bytes(local[28:30], "little")
        start = member.header_offset + _LOCAL_HEADER + lengths
        if start + member.file_size <= size:
            return start
    raise cut_off(path, f"its array {name!r} is not complete")


def _unpacked(path: Path, file: Any, member: zipfile.ZipInfo, name: str, dtype: np.dtype[Any]) -> Array:
    """Decompress the rest of a member to a temporary file, as a memory map."""
    if member.file_size > _MAX_GROWTH * member.compress_size + _SMALL:
        fact = f"its array {name!r} would grow from {member.compress_size} to {member.file_size} bytes"
        raise SceneError(path, f"{fact}; {_CURE}")
    with tempfile.TemporaryFile(prefix="brushgs-") as target:
        shutil.copyfileobj(file, target, 1 << 20)
        target.flush()
        return np.memmap(target, dtype, "r") if target.tell() else np.empty(0, dtype)


_WIDTHS = {
    "means3D": (3,),
    "unnorm_rotations": (4,),
    "log_scales": (3, 1),  # 1 for isotropic Gaussians
    "logit_opacities": (1,),
    "rgb_colors": (3,),
}
# Other arrays that the trainers write: segmentation and cameras.
_KNOWN = {
    *("seg_colors", "cam_m", "cam_c", "cam_unnorm_rots", "cam_trans", "timestep", "intrinsics", "w2c"),
    *("org_width", "org_height", "gt_w2c_all_frames", "keyframe_time_indices"),
}


class Params:
    """An open params.npz."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._arrays, others = open_npz(path, _WIDTHS)
        self.num_rows = self._check_shapes()
        self.num_moments = max(array.moments or 1 for array in self._arrays.values())
        self.others = tuple(name for name in others if name not in _KNOWN)
        self._moments = Moments(self._read)
        self._has_told = False

    def sample(self, time: float) -> Gaussians:
        """The Gaussians at a time in seconds, interpolated between two moments."""
        return self._moments.at(min(time * NOMINAL_RATE, self.num_moments - 1))

    def _check_shapes(self) -> int:
        """The number of Gaussians. Raises SceneError if array shapes do not match."""
        means = self._arrays["means3D"]
        num_rows = means.shape[-2] if len(means.shape) in (2, 3) else 0
        count = 1 if means.moments is None else means.moments
        for name, widths in _WIDTHS.items():
            shape = self._arrays[name].shape
            rest = shape[-2:] if len(shape) in (2, 3) else ()
            is_in_time = len(shape) < 3 or shape[0] in (1, count)
            if rest not in [(num_rows, width) for width in widths] or not is_in_time:
                times = f"[{count}, {num_rows}, {widths[0]}] or [{num_rows}, {widths[0]}]"
                fact = f"its array {name!r} must have the shape {times}, as means3D says, got {list(shape)}"
                raise SceneError(self.path, f"{fact[:200]}; save it again")
        if num_rows == 0 or not count:
            raise SceneError(self.path, f"holds no Gaussians: means3D is {list(means.shape)}; train it again")
        return num_rows

    def _read(self, index: int) -> Kept:
        """Read one moment."""
        columns = Columns.empty(self.num_rows, 1)
        columns.means[:] = self._column("means3D", index)
        columns.quats[:] = self._column("unnorm_rotations", index)
        columns.scales[:] = self._column("log_scales", index)
        columns.opacities[:] = self._column("logit_opacities", index)[:, 0]
        with np.errstate(over="ignore"):  # infinity is found below
            columns.sh[:, 0] = (self._column("rgb_colors", index) - 0.5) / C0
        kept, dropped = keep_rows(columns, STANDARD, antialiased=False)
        if dropped.num_rows and (not self._has_told or dropped.num_rows == self.num_rows):
            dropped.report(self.path, self.num_rows)
            self._has_told = True
        return kept

    def _column(self, name: str, index: int) -> F32:
        array = self._arrays[name]
        return array.read(None if array.moments is None else min(index, array.moments - 1))

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the path alone: scenes are sent to other processes, temporary files cannot be."""
        return type(self), (self.path,)


def open_moving(path: Path) -> MovingScene:
    """Open a params.npz.

    Raises SceneError if it is damaged, or arrays are missing or do not match.
    """
    params = Params(path)
    count = params.num_moments
    name = f"Dynamic3DGaussians, {count:,} moment{'s' * (count > 1)}"
    file = SceneFile(path, name, params.num_rows, 1, open_nothing, unknown=params.others)
    notes = join_notes([file], rows_dropped=0, sh_degree_used=0)
    times = np.arange(count) / NOMINAL_RATE
    resting = np.ones(params.num_rows, bool) if count == 1 else None
    return MovingScene(float(times[-1]), True, params.sample, times=times, resting=resting, notes=notes)
