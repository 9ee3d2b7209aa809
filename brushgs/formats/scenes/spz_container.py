"""The container of an SPZ file: its header, its extensions, and a block of plain bytes for each attribute.

Versions 1 to 3 are one gzip stream: 16 bytes of header, the blocks in order, extensions. Version 4 is 32
bytes of header, extensions, a table of contents, and a zstd stream for each block. Only as many bytes are
decompressed as the row count of the header needs; the caller has checked this count against the file size.

Extensions are records: type, length, content. Two are read: our own, which holds `Stored`, and the coordinate
system (SPZ_ADOBE_coordinate_system), which names the axes of the stored numbers. Numbers are kept as stored
and `up` is set; only in a left-handed system the x axis is negated, since the scene would be mirrored.
"""

import struct
import zlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from brushgs.core.threads import num_threads_or_default
from brushgs.errors import NoGaussiansError, SceneError
from brushgs.formats.files import cut_off, damaged
from brushgs.values.arrays import U8

_RECORD = struct.Struct("<II")  # type, number of bytes that follow
_COORDINATE_SYSTEM = 0xADBE0003
_NOTES = 0x42470001  # the upper half identifies who defines the record: "BG"
# Directions of x, y and z (left or right, up or down, front or back), by number; 0 states nothing.
_AXES = (
    *("", "LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF"),
    *("LFD", "RFD", "LFU", "RFU", "LBD", "RBD", "LBU", "RBU"),
)
_OPPOSITE = str.maketrans("LDF", "RUB")
_SHOWN = 6  # unknown types of records that are reported


class Extensions(NamedTuple):
    """The content of the extensions of a file."""

    up: str | None = None  # up axis, "+x" to "-z"
    is_mirrored: bool = False  # whether the axes are left-handed
    unknown: tuple[str, ...] = ()  # names of the extensions that are not read
    notes: str = ""  # JSON text of a `Stored`


def notes_record(text: bytes) -> bytes:
    """Our own record, holding a text."""
    return _RECORD.pack(_NOTES, len(text)) + text


def _parse_extensions(path: Path, records: memoryview) -> Extensions:
    axes, notes, unknown, start = "", "", dict[str, None](), 0
    while start + _RECORD.size <= len(records):
        kind, size = _RECORD.unpack_from(records, start)
        start += _RECORD.size
        if size > len(records) - start:
            left = len(records) - start
            raise damaged(path, f"extension 0x{kind:08X} has {size} bytes where {left} are left")
        if kind == _COORDINATE_SYSTEM:
            axes = _read_axes(path, bytes(records[start : start + size]))
        elif kind == _NOTES:
            notes = bytes(records[start : start + size]).decode("latin-1")
        elif len(unknown) < _SHOWN:
            unknown[f"extension 0x{kind:08X}"] = None
        start += size
    ups = {"U": "+", "D": "-"}
    up = next((ups[to] + axis for axis, to in zip("xyz", axes, strict=False) if to in ups), None)
    return Extensions(up, _is_left_handed(axes), tuple(unknown), notes)


def _read_axes(path: Path, record: bytes) -> str:
    number = int.from_bytes(record[:4], "little")
    if len(record) < 4 or number >= len(_AXES):
        rule = f"the coordinate system must be a number from 0 to {len(_AXES) - 1}, got {number}"
        raise SceneError(path, f"{rule}; export the scene again")
    return _AXES[number]


def _is_left_handed(axes: str) -> bool:
    """Whether x cross y is -z; right-up-back is right-handed.

    Each reversed axis changes the handedness, and so does an exchange of two axes.
    """
    turned = sum(direction in "LDF" for direction in axes)
    exchanged = axes.translate(_OPPOSITE) not in ("", "RUB")
    return (turned + exchanged) % 2 == 1


_GZIP, _MAGIC = b"\x1f\x8b", b"NGSP"
_HEADER = struct.Struct("<4sIIBBBB")  # magic, version, rows, degree, fractional bits, flags, streams
_HEADER_4_SIZE = 32
_TABLE_OFFSET = struct.Struct("<I")  # in version 4, at byte 16
_STREAM = struct.Struct("<QQ")  # compressed and decompressed size of a stream, bytes
_LATEST = 4
NUM_HEADER_BYTES = 1 << 12  # first bytes of a file that contain its header, compressed or not
ANTIALIASED, HAS_EXTENSIONS, _IS_TREE = 0x1, 0x2, 0x80  # flags
_MAX_DEGREE, _MAX_USED_DEGREE = 4, 3
MAX_FRACTIONAL_BITS = 24
_MAX_TRAILER = 1 << 19  # most bytes of extensions read after the blocks of versions 1 to 3
_MAX_THREADS = 4  # streams decompressed at a time
_BYTES_PER_THREAD = 1 << 20  # below this, a thread costs more than it saves


class Header(NamedTuple):
    """The header of an SPZ file."""

    version: int  # 1 to 4
    num_rows: int  # number of Gaussians, >= 1
    sh_degree: int  # degree of the stored spherical harmonics, 0 to 4
    fractional_bits: int  # of positions, from version 2 on
    flags: int
    num_streams: int = 0  # in version 4

    @property
    def used_degree(self) -> int:
        """Degree of the spherical harmonics that are read."""
        return min(self.sh_degree, _MAX_USED_DEGREE)

    @property
    def num_terms(self) -> int:
        """Spherical-harmonic terms that are read for each Gaussian."""
        return (self.used_degree + 1) ** 2

    @property
    def widths(self) -> tuple[int, ...]:
        """Bytes per Gaussian in each block, in the order of the file."""
        rest = 3 * ((self.sh_degree + 1) ** 2 - 1)
        return 6 if self.version == 1 else 9, 1, 3, 3, 3 if self.version < 3 else 4, rest

    @property
    def row_size(self) -> int:
        """Bytes per Gaussian in all blocks."""
        return sum(self.widths)


class Blocks(NamedTuple):
    """Plain bytes of n Gaussians, one array for each attribute."""

    positions: U8  # [n x width + 1 or more], with an extra byte so that the last three can be read as four
    alphas: U8  # [n]
    colors: U8  # [n, 3]
    scales: U8  # [n, 3]
    rotations: U8  # [n, width]
    sh: U8  # [n, 3 x terms above the first]


def read_header(path: Path, begin: bytes) -> Header:
    """Read the header of a file from its first `NUM_HEADER_BYTES` bytes or more.

    Raises SceneError if it is damaged, of an unknown version, or gzip data of another kind.
    """
    is_packed = begin.startswith(_GZIP)
    if is_packed:
        begin = _peek(path, begin)
    if not _MAGIC.startswith(begin[: len(_MAGIC)]):
        what = "a PLY file" if begin.startswith(b"ply") else f"no SPZ scene: it begins with {begin[:8]!r}"
        cure = "unpack it first, for example with gunzip" if is_packed else "export it again"
        raise SceneError(path, f"{'is gzip data that ' * is_packed}holds {what}; {cure}")
    if len(begin) < _HEADER.size:
        raise cut_off(path, "within its header")
    _, version, num_rows, degree, bits, flags, num_streams = _HEADER.unpack_from(begin)
    if not 1 <= version <= _LATEST:
        rule = f"must have a version from 1 to {_LATEST}, got {version}"
        raise SceneError(path, f"is an SPZ scene that {rule}; export it as PLY or an earlier version of SPZ")
    if is_packed and version == _LATEST:
        raise SceneError(path, f"is an SPZ scene of version {version} within gzip data; unpack it first")
    if num_rows == 0:
        raise NoGaussiansError(path, "holds no Gaussians: its header says 0; export the scene again")
    if degree > _MAX_DEGREE:
        raise damaged(path, f"spherical harmonics must have a degree from 0 to {_MAX_DEGREE}, got {degree}")
    if bits > MAX_FRACTIONAL_BITS:
        raise damaged(path, f"positions must have at most {MAX_FRACTIONAL_BITS} fractional bits, got {bits}")
    if flags & _IS_TREE and version < _LATEST:
        raise SceneError(path, "holds a tree of levels of detail; export the scene without levels of detail")
    return Header(version, num_rows, degree, bits, flags, num_streams)


def read_extensions(path: Path, data: bytes, header: Header) -> Extensions:
    """Read the extensions of a file. Raises SceneError if they are damaged."""
    if not header.flags & HAS_EXTENSIONS:
        return Extensions()
    if header.version < _LATEST:
        # The blocks are inflated again later, but few files of these versions have extensions.
        records = _inflate(path, data, header)[0][_HEADER.size + header.num_rows * header.row_size :]
    else:
        records = memoryview(data)[_HEADER_4_SIZE : _table_offset(path, data, header)]
    return _parse_extensions(path, records)


def read_blocks(path: Path, data: bytes, header: Header) -> tuple[Blocks, int]:
    """The blocks of a file, and the number of surplus bytes after them.

    Raises SceneError if the file is cut off or damaged.
    """
    read = _read_stream if header.version < _LATEST else _read_streams
    contents, surplus = read(path, data, header)
    arrays = [np.frombuffer(content, np.uint8) for content in contents]
    sized = zip(arrays[1:], header.widths[1:], strict=True)
    shaped = [array[: header.num_rows * width].reshape(header.num_rows, width) for array, width in sized]
    return Blocks(arrays[0], shaped[0][:, 0], *shaped[1:]), surplus


def pack_stream(header: Header, blocks: Sequence[U8], extensions: bytes) -> bytes:
    """The content of a file of versions 1 to 3, before gzip.

    `blocks` are [n, width] or [n], in the order of `Header.widths`; `extensions` are the encoded records.
    """
    head = _HEADER.pack(
        *(_MAGIC, header.version, header.num_rows, header.sh_degree, header.fractional_bits),
        *(header.flags, header.num_streams),
    )
    assert [block.size for block in blocks] == [header.num_rows * width for width in header.widths]
    return b"".join([head, *(block.tobytes() for block in blocks), extensions])


def _peek(path: Path, begin: bytes) -> bytes:
    """The first bytes of gzip data, decompressed."""
    try:
        # Pass only a part: zlib copies unused input, which takes 25 ms for a large file.
        return zlib.decompressobj(wbits=31).decompress(begin[:NUM_HEADER_BYTES], _HEADER.size)
    except zlib.error as error:
        raise _damaged(path, error) from None


def _inflate(path: Path, data: bytes, header: Header) -> tuple[memoryview, int]:
    """Content of a file of versions 1 to 3, with up to `_MAX_TRAILER` bytes after the blocks; and surplus.

    Content without gzip is accepted too: some tools keep it so in memory and within other files.
    """
    needed = _HEADER.size + header.num_rows * header.row_size
    if not data.startswith(_GZIP):
        content, is_whole, surplus = memoryview(data), True, 0
    else:
        inflater = zlib.decompressobj(wbits=31)
        try:
            content = memoryview(inflater.decompress(data, needed + _MAX_TRAILER))
        except zlib.error as error:
            raise _damaged(path, error) from None
        # Content of the full requested length goes on, but extensions never take so much.
        is_whole = inflater.eof or len(content) == needed + _MAX_TRAILER
        surplus = len(inflater.unused_data)
    if len(content) < needed or not is_whole:
        raise cut_off(path, f"after {len(content)} of {needed} bytes")
    return content, surplus


def _read_stream(path: Path, data: bytes, header: Header) -> tuple[list[memoryview], int]:
    """Blocks of a file of versions 1 to 3, each followed by the rest of the content; and the surplus."""
    content, surplus = _inflate(path, data, header)
    parts, start = [], _HEADER.size
    for width in header.widths:
        parts.append(content[start:])
        start += header.num_rows * width
    if not header.flags & HAS_EXTENSIONS:
        surplus += len(content) - start
    return parts, surplus


def _table_offset(path: Path, data: bytes, header: Header) -> int:
    """Byte offset of the table of contents of a file of version 4."""
    if len(data) < _HEADER_4_SIZE:
        raise cut_off(path, "within its header")
    (offset,) = _TABLE_OFFSET.unpack_from(data, _HEADER.size)
    if not _HEADER_4_SIZE <= offset <= len(data) - header.num_streams * _STREAM.size:
        raise cut_off(path, f"its table of contents is said to begin at byte {offset} of {len(data)}")
    return int(offset)


def _read_streams(path: Path, data: bytes, header: Header) -> tuple[list[bytes], int]:
    """Blocks of a file of version 4, the first with one extra byte; and the surplus."""
    sizes = [header.num_rows * width for width in header.widths if width]
    if header.num_streams != len(sizes):
        rule = f"must have {len(sizes)} streams for degree {header.sh_degree}, got {header.num_streams}"
        raise damaged(path, f"it {rule}")
    offset = _table_offset(path, data, header)
    start, streams = offset + header.num_streams * _STREAM.size, []
    for number, size in enumerate(sizes):
        packed, unpacked = _STREAM.unpack_from(data, offset + number * _STREAM.size)
        if unpacked != size:
            rule = f"stream {number} must hold {size} bytes for {header.num_rows} Gaussians, got {unpacked}"
            raise damaged(path, rule)
        if (missing := packed - (len(data) - start)) > 0:
            raise cut_off(path, f"{missing} bytes before the end of stream {number}")
        streams.append((memoryview(data)[start : start + packed], size))
        start += packed
    most = min(num_threads_or_default(None), _MAX_THREADS, sum(sizes) // _BYTES_PER_THREAD)
    with ThreadPoolExecutor(max(most, 1)) as pool:  # zstd releases the lock of the interpreter
        contents = list(pool.map(lambda stream: _decompress(path, *stream), streams))
    contents[0] += b"\0"
    return contents if header.widths[-1] else [*contents, b""], len(data) - start


def _decompress(path: Path, packed: memoryview, size: int) -> bytes:
    """Decompress one zstd frame of a known size; its stated size is checked before memory is allocated."""
    import zstandard

    try:
        stated = zstandard.get_frame_parameters(packed).content_size
        if stated not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise _damaged(path, f"a stream of {size} bytes is said to hold {stated}")
        content = zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
    except zstandard.ZstdError as error:
        raise _damaged(path, error) from None
    if len(content) != size:
        raise _damaged(path, f"a stream of {size} bytes held {len(content)}")
    return content


def _damaged(path: Path, fact: object) -> SceneError:
    return SceneError(path, f"cannot be decompressed ({fact}); it is damaged: copy or download it again")
