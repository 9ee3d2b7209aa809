"""The container of a glTF 2.0 model: read JSON, nodes and arrays (untrusted), and write a .glb.

This is own code because pygltflib reads all bytes into memory and checks no bounds; here buffers are mapped
and checked first. Callers interpret the objects. Source: Khronos, glTF 2.0 Specification.
"""

import base64
import json
import mmap
import re
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, BinaryIO, Generic, Literal, NamedTuple, TypeVar
from urllib.parse import unquote

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.formats.files import cut_off, find_within, open_plain
from brushgs.formats.schema import MAX_BYTES, SMALL_OBJECT, as_count, decode, shown
from brushgs.values.arrays import F32, F64
from brushgs.values.quats import rotation_matrices
from brushgs.version import __version__

SCENE_NODE = "brushgs_scene"
_SCENE_NAME = re.compile(rf"{SCENE_NODE}([._]\d+)?")  # 3D programs append a number to duplicate names


def is_scene_name(name: object) -> bool:
    """Whether this is the name of the node of the painted scene."""
    return isinstance(name, str) and _SCENE_NAME.fullmatch(name) is not None


CURE = "export it again"
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_DATA_URI = re.compile(r"data:[^,;]*(;[^,;]*)*;base64,")
_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_MAX_NODES, _MAX_DEPTH = 10_000, 200  # models of splats or cameras have a few nodes

Index = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=0, le=10**12)]  # a count, or an offset in bytes: more than any file has
Extensions = dict[str, Any]
# Products of a few larger numbers would overflow.
_Length = Annotated[float, Meta(gt=-1e18, lt=1e18, description="a number below 1e18")]
_Three = tuple[_Length, _Length, _Length]
_Four = tuple[_Length, _Length, _Length, _Length]
_Sixteen = Annotated[list[_Length], Meta(min_length=16, max_length=16)]


class Asset(Struct):
    """The version of glTF, and the program that wrote the file."""

    version: Annotated[str, Meta(pattern="^2", description="2.0, as of glTF of version 2")]
    generator: Any = None


class Scene(Struct):
    """The root nodes of a scene."""

    nodes: list[Index] | None = None


class Node(Struct):
    """A node: its transform, and its camera or mesh."""

    name: Any = None
    children: list[Index] | None = None
    matrix: _Sixteen | None = None
    rotation: _Four | None = None
    scale: _Three | None = None
    translation: _Three | None = None
    camera: Index | None = None
    mesh: Index | None = None
    extensions: Extensions | None = None


class Accessor(Struct, rename="camel"):
    """An array."""

    component_type: int
    count: Count
    type: str
    buffer_view: Index | None = None
    byte_offset: Count | None = None
    normalized: bool | None = None
    sparse: Any = None


class BufferView(Struct, rename="camel"):
    """A part of a buffer."""

    buffer: Index
    byte_length: Count
    byte_offset: Count | None = None
    byte_stride: Count | None = None
    extensions: Extensions | None = None


class Buffer(Struct):
    """The source of a buffer: a data URI, a file beside the model, or None for the binary chunk."""

    uri: str | None = None


class Model(Struct, rename="camel", kw_only=True):
    """The part of the JSON that all readers need."""

    asset: Asset
    scene: Index | None = None
    scenes: list[Scene] | None = None
    nodes: list[Node] | None = None
    accessors: list[Accessor] | None = None
    buffer_views: list[BufferView] | None = None
    buffers: list[Buffer] | None = None


M = TypeVar("M", bound=Model)
T = TypeVar("T")


def _mapped(path: Path, what: str) -> memoryview:
    """The bytes of a file, memory-mapped. Raises SceneError as `open_plain` does, or if the file is empty."""
    with open_plain(path, what) as file:
        if not file.seek(0, 2):
            raise SceneError(path, "is empty; copy or download it again")
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


class GltfFile(Generic[M]):
    """A .glb or .gltf file.

    Attributes are `path`, `size` (bytes, including external buffers opened so far) and `top`, the JSON.
    `kind` is the struct that the JSON is decoded to; `what` names the expected file in messages.
    """

    def __init__(self, path: Path, kind: type[M], what: str = "scene file") -> None:
        self.path = path
        self._binary: memoryview | None = None
        self._buffers: dict[int, memoryview] = {}
        whole = _mapped(path, what)
        self.size = len(whole)
        text = self._split(whole) if bytes(whole[:4]) == b"glTF" else whole
        if len(text) > MAX_BYTES:
            raise SceneError(path, f"must have at most {MAX_BYTES >> 20} MiB of JSON; export it as .glb")
        self.top = decode(path, bytes(text), kind, CURE, object_bytes=SMALL_OBJECT, has_names=True)

    def _split(self, whole: memoryview) -> memoryview:
        """The JSON chunk of a .glb; keeps the binary chunk for `_open_buffer`."""
        version, length = struct.unpack("<II", bytes(whole[4:12]).ljust(8, b"\0"))
        if version != 2:
            raise SceneError(self.path, f"must be glTF of version 2, got version {version}; {CURE}")
        if length > len(whole):
            raise cut_off(self.path, f"{length - len(whole)} of {length} bytes are missing")
        chunks: dict[int, memoryview] = {}
        start = 12
        while start + 8 <= length and len(chunks) < 2:
            size, kind = struct.unpack("<II", whole[start : start + 8])
            if start + 8 + size > length:
                raise SceneError(self.path, "is damaged: a chunk is longer than the file; download it again")
            chunks.setdefault(kind, whole[start + 8 : start + 8 + size])
            start += 8 + size
        if JSON_CHUNK not in chunks:
            raise SceneError(self.path, f"is damaged: it has no JSON chunk; {CURE}")
        self._binary = chunks.get(BINARY_CHUNK)
        return chunks[JSON_CHUNK]

    def item(self, items: list[T] | None, index: object, who: str) -> T:
        """The object with number `index` in a top-level list; `who` describes the reference in messages.

        Raises SceneError if there is no such object.
        """
        number = as_count(index, len(items) - 1) if items else None
        if items is None or number is None:
            raise SceneError(self.path, f"{who} {shown(index)}, which is missing; {CURE}")
        return items[number]

    def view(self, index: object, used_by: str) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and its stride in bytes if it states one."""
        view = self.item(self.top.buffer_views, index, f"{used_by} refers to bufferViews")
        if view.extensions:
            names = ", ".join(name[:60] for name in list(view.extensions)[:3])
            raise SceneError(self.path, f"is compressed by {names}, which is not read; export it without")
        what = f"buffer view {shown(index)}"
        buffer = self._buffer(view.buffer, what)
        start, length = view.byte_offset or 0, view.byte_length
        if (missing := start + length - len(buffer)) > 0:
            raise SceneError(self.path, f"{what} lacks {missing} bytes of its buffer; download or {CURE}")
        return buffer[start : start + length], view.byte_stride

    def _buffer(self, number: int, used_by: str) -> memoryview:
        """The bytes of a buffer, opened on first use."""
        buffer = self.item(self.top.buffers, number, f"{used_by} refers to buffers")
        if number not in self._buffers:
            self._buffers[number] = self._open_buffer(buffer.uri, f"buffer {number}")
        return self._buffers[number]

    def _open_buffer(self, uri: str | None, what: str) -> memoryview:
        """The bytes of the binary chunk, a data URI, or a file beside this one."""
        if uri is None:
            if self._binary is None:
                raise SceneError(self.path, f"{what} has neither a uri nor a binary chunk; {CURE}")
            return self._binary
        if uri.startswith("data:"):
            found = _DATA_URI.match(uri[:200])
            try:
                content = base64.b64decode(uri[found.end() :] if found else "?", validate=True)
            except ValueError:
                raise SceneError(self.path, f"{what} is no base64 data URI; {CURE}") from None
            return memoryview(content)
        path = find_within(self.path.parent, unquote(uri), self.path)
        buffer = _mapped(path, "buffer of the glTF model")
        self.size += len(buffer)
        return buffer

    def array(self, index: object, used_by: str) -> "GltfArray":
        """The array of an accessor.

        Raises SceneError if it exceeds its buffer view, is sparse, or is not a scalar or vector of numbers.
        """
        accessor = self.item(self.top.accessors, index, f"{used_by} refers to accessors")
        if accessor.sparse is not None:
            raise SceneError(self.path, f"{used_by} is a sparse accessor, which is not read; {CURE} without")
        dtype, width = _DTYPES.get(accessor.component_type), _WIDTHS.get(accessor.type)
        if dtype is None or width is None:
            kind = f"{shown(accessor.type)} of {accessor.component_type}"
            rule = f"{used_by} must be a scalar or vector of numbers"
            raise SceneError(self.path, f"{rule}, got {kind}; {CURE}")
        data, stride = self.view(accessor.buffer_view, used_by)
        count, offset = accessor.count, accessor.byte_offset or 0
        number = np.dtype(dtype).itemsize
        item = number * width
        stride = item if stride is None else stride
        missing = offset + (count - 1) * stride + item - len(data) if count else 0
        if stride < item or missing > 0:
            fact = f"lacks {missing} bytes of its buffer view" if missing > 0 else f"has a stride of {stride}"
            raise SceneError(self.path, f"{used_by} {fact}; download or {CURE}")
        values: NDArray[Any] = np.ndarray((count, width), dtype, data, offset, (stride, number))
        return GltfArray(values, is_normalized=bool(accessor.normalized))

    def placed_nodes(self) -> Iterator["PlacedNode"]:
        """Yield the nodes of the default scene, or all nodes if there is no scene, parents first.

        Raises SceneError if nodes are missing, form a cycle, or are too many.
        """
        # Each entry: a node, the matrix of its parent, and the nodes above it.
        pending = [(root, np.eye(4), tuple[int, ...]()) for root in reversed(self._roots())]
        num_nodes = 0
        while pending:
            index, parent, above = pending.pop()
            node = self.node_at(index)
            num_nodes += 1
            if index in above or num_nodes > _MAX_NODES or len(above) > _MAX_DEPTH:
                raise SceneError(self.path, f"its nodes form a ring, or there are too many; {CURE}")
            with np.errstate(over="ignore", invalid="ignore"):
                matrix = parent @ self.local_matrices(index, {})[0]
            if not np.isfinite(matrix).all():
                raise SceneError(self.path, f"its nodes scale beyond all numbers; {CURE}")
            yield PlacedNode(node, (*above, index), matrix)
            pending.extend((child, matrix, (*above, index)) for child in reversed(node.children or []))

    def node_at(self, index: int) -> Node:
        """A node by its number. Raises SceneError if it does not exist."""
        return self.item(self.top.nodes, index, "a scene or node refers to nodes")

    def _roots(self) -> list[int]:
        """The root nodes of the default scene, or all nodes without a parent if there is no scene."""
        nodes = self.top.nodes or []
        if nodes and self.top.scenes:
            scene = self.item(self.top.scenes, self.top.scene or 0, "the model refers to scenes")
            return scene.nodes or []
        below = {child for node in nodes for child in node.children or ()}
        return [index for index in range(len(nodes)) if index not in below]

    def local_matrices(self, index: int, moved: Mapping[str, F64]) -> F64:
        """[T, 4, 4] parent from node: its matrix, or its rotation (x, y, z, w), scale and translation.

        `moved` holds the animated ones of these three, [T, 3 or 4]; T is 1 if none is animated.
        """
        node = self.node_at(index)
        if node.matrix is not None:
            if moved:
                raise SceneError(self.path, f"node {index} has a matrix, so it cannot be animated; {CURE}")
            matrix = np.array(node.matrix).reshape(4, 4).T
            if not np.array_equal(matrix[3], (0, 0, 0, 1)):
                raise SceneError(self.path, f"matrix of node {index} must be affine; {CURE}")
            return matrix[None]
        still = {"rotation": node.rotation or (0, 0, 0, 1), "scale": node.scale or (1, 1, 1)}
        still["translation"] = node.translation or (0, 0, 0)
        parts = {name: np.array([values], np.float64) for name, values in still.items()} | dict(moved)
        if not parts["rotation"].any(axis=1).all():
            raise SceneError(self.path, f"rotation of node {index} must not be zero; {CURE}")
        matrices = np.tile(np.eye(4), (max(map(len, parts.values())), 1, 1))
        turns = rotation_matrices(parts["rotation"][:, [3, 0, 1, 2]])
        matrices[:, :3, :3], matrices[:, :3, 3] = turns * parts["scale"][:, None], parts["translation"]
        return matrices


class GltfArray:
    """Numbers of an accessor, [count, width], converted to float32 when rows are read."""

    def __init__(self, values: NDArray[Any], *, is_normalized: bool) -> None:
        self.values = values
        self.count, self.width = values.shape
        is_integer = values.dtype.kind in "iu"
        self._divisor = np.float32(np.iinfo(values.dtype).max) if is_integer and is_normalized else None

    def read(self, start: int, stop: int) -> F32:
        """Rows as float32; normalized integers become 0 to 1 or -1 to 1."""
        rows = self.values[start:stop].astype(np.float32)
        if self._divisor is not None:
            rows /= self._divisor
            np.maximum(rows, -1, out=rows)
        return rows


class PlacedNode(NamedTuple):
    """A node with its place in the scene."""

    node: Node
    chain: tuple[int, ...]  # numbers of the nodes from the root down to this one
    matrix: F64  # [4, 4] world from node, without animations

    @property
    def is_scene(self) -> bool:
        """Whether this is the node of the painted scene."""
        return is_scene_name(self.node.name)


_TYPES = {width: name for name, width in _WIDTHS.items()}
_COMPONENTS = {np.dtype(dtype).name: number for number, dtype in _DTYPES.items()}
_TARGETS = {"vertices": 34962, "indices": 34963}
MOST_BYTES = 2**32 - 1  # of a file: the header has 32 bits for its size


class GlbWriter:
    """Build a .glb; objects keep the order in which they are added, and equal models give equal bytes.

    Attributes:
        top: the JSON; fields other than the lists of `add` are set here.
    """

    def __init__(self) -> None:
        self.top: dict[str, Any] = {"asset": {"version": "2.0", "generator": f"brushgs {__version__}"}}
        self._parts: list[memoryview] = []
        self._size = 0

    def add(self, kind: str, **fields: Any) -> int:
        """Append an object to a top-level list, such as "nodes"; return its number."""
        items = self.top.setdefault(kind, [])
        items.append(fields)
        return len(items) - 1

    def uses(self, extension: str) -> None:
        """Declare an extension as used but not required."""
        used = self.top.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def view(self, content: bytes | memoryview, **fields: Any) -> int:
        """Append bytes to the binary chunk, aligned to 4 bytes; return the number of their buffer view."""
        padding = -self._size % 4
        self._parts += [memoryview(bytes(padding)), memoryview(content)]
        start, self._size = self._size + padding, self._size + padding + len(content)
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(content), **fields)

    def accessor(
        self,
        values: NDArray[Any],
        of: Literal["vertices", "indices"],
        *,
        normalized: bool = False,
        has_bounds: bool = False,
    ) -> int:
        """Add an array with a buffer view of its own; return the number of its accessor.

        Args:
            values: [n] or [n, width] with n >= 1, of a dtype that glTF has. The row size of vertices must be
                a multiple of 4 bytes.
            of: the use of the array.
            normalized: whether integers are fractions of their largest value.
            has_bounds: whether to state the minimum and maximum of each column, which positions require.
        """
        rows = values.reshape(len(values), -1)
        component = _COMPONENTS[rows.dtype.name]
        rows = np.ascontiguousarray(rows, rows.dtype.newbyteorder("<"))
        fields: dict[str, Any] = {"normalized": True} if normalized else {}
        if has_bounds:
            fields |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        return self.add(
            "accessors",
            bufferView=self.view(rows.reshape(-1).view(np.uint8).data, target=_TARGETS[of]),
            componentType=component,
            count=len(rows),
            type=_TYPES[rows.shape[1]],
            **fields,
        )

    def write(self, file: BinaryIO) -> None:
        """Write the whole model.

        Raises ValueError if it takes 4 GiB or more, or a number in the JSON is not finite.
        """
        top = dict(self.top)
        if self._size:
            top["buffers"] = [{"byteLength": self._size}]
        text = json.dumps(top, allow_nan=False, separators=(",", ":")).encode("ascii")
        text += b" " * (-len(text) % 4)
        binary = self._size + -self._size % 4
        total = 12 + 8 + len(text) + (8 + binary if binary else 0)
        if total > MOST_BYTES:
            raise ValueError(f"a GLB file must have less than 4 GiB, got {total / 2**30:.1f}; write less")
        file.write(struct.pack("<4sIIII", b"glTF", 2, total, len(text), JSON_CHUNK) + text)
        if binary:
            file.write(struct.pack("<II", binary, BINARY_CHUNK))
            file.writelines([*self._parts, bytes(binary - self._size)])
