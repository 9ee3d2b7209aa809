"""The container of a glTF 2.0 model: its JSON, and the arrays that accessors describe; none is trusted.

Source: Khronos, glTF 2.0 Specification.
"""

import base64
import binascii
import mmap
import re
import struct
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from brushgs.errors import SceneError
from brushgs.io.files import find_within, open_plain
from brushgs.io.json_file import MAX_BYTES, SMALL_OBJECT, as_count, decode_json, shown

CURE = "export it again"
MOST = 1 << 40  # a count or an offset in bytes that no file reaches
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_DATA_URI = re.compile(r"data:[^,;]*(;[^,;]*)*;base64,")
_DTYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class GltfFile:
    """A .glb or .gltf file.

    Attributes:
        path: the file.
        size: bytes of it and of the files beside it that were opened.

    Args:
        path: the file.
        what: what is expected there, for messages.
    """

    def __init__(self, path: Path, what: str = "scene file") -> None:
        self.path = path
        self._binary: memoryview | None = None
        self._buffers: dict[int, memoryview] = {}
        with open_plain(path, what) as file:
            begin = file.read(12)
            self.size = file.seek(0, 2)
            if not self.size:
                raise SceneError(path, "is empty; copy or download it again")
            whole = memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        text = self._split(whole) if begin[:4] == b"glTF" else whole
        if len(text) > MAX_BYTES:
            cure = "export it as .glb, whose numbers are no text"
            raise SceneError(path, f"must have at most {MAX_BYTES >> 20} MiB of JSON; {cure}")
        top = decode_json(path, bytes(text), CURE, object_bytes=SMALL_OBJECT, has_names=True)
        if not isinstance(top, dict):
            raise SceneError(path, f"must be a JSON object, got {shown(top)}; {CURE}")
        self.top: dict[str, Any] = top
        asset = top.get("asset")
        version = asset.get("version") if isinstance(asset, dict) else None
        if not isinstance(version, str) or not version.startswith("2"):
            raise SceneError(path, f"must be glTF of version 2, got version {shown(version)}; {CURE}")

    def _split(self, whole: memoryview) -> memoryview:
        """The JSON of a .glb; its binary chunk is remembered."""
        version, length = struct.unpack("<II", bytes(whole[4:12]).ljust(8, b"\0"))
        if version != 2:
            raise SceneError(self.path, f"must be glTF of version 2, got version {version}; {CURE}")
        if length > len(whole):
            fact = f"is cut off: {length - len(whole)} of {length} bytes are missing"
            raise SceneError(self.path, f"{fact}; download or copy it again")
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

    def item(self, kind: str, index: object, used_by: str) -> dict[str, Any]:
        """An object of one of the lists at the top. Raises SceneError if there is none of that number.

        Args:
            kind: name of the list.
            index: the number.
            used_by: what refers to it, for the message.
        """
        items = self.top.get(kind)
        if isinstance(items, list) and (number := as_count(index, len(items) - 1)) is not None:
            found = items[number]
            if isinstance(found, dict):
                return found
        raise SceneError(self.path, f"{used_by} refers to {kind} {shown(index)}, which is missing; {CURE}")

    def count(self, owner: dict[str, Any], name: str, what: str, default: int | None = None) -> int:
        """A number of an object. Raises SceneError if it is missing or no whole number above or equal 0."""
        value = owner.get(name)
        if value is None and default is not None:
            return default
        number = as_count(value, MOST)
        if number is None:
            raise SceneError(
                self.path, f"{name} of {what} must be a whole number, got {shown(value)}; {CURE}"
            )
        return number

    def view(self, index: object, used_by: str) -> tuple[memoryview, int | None]:
        """The bytes of a buffer view, and the distance between its elements if it states one."""
        view = self.item("bufferViews", index, used_by)
        extensions = view.get("extensions")
        if extensions:
            names = (
                ", ".join(name[:60] for name in list(extensions)[:3]) if isinstance(extensions, dict) else ""
            )
            fact = f"is compressed by {names}, which is not read" if names else "has unusable extensions"
            raise SceneError(self.path, f"{fact}; export it without compression, or as .ply")
        what = f"buffer view {shown(index)}"
        buffer = self._buffer(view.get("buffer"), what)
        start, length = self.count(view, "byteOffset", what, 0), self.count(view, "byteLength", what)
        if start + length > len(buffer):
            missing = start + length - len(buffer)
            raise SceneError(self.path, f"{what} lacks {missing} bytes of its buffer; download or {CURE}")
        stride = None if view.get("byteStride") is None else self.count(view, "byteStride", what)
        return buffer[start : start + length], stride

    def _buffer(self, index: object, used_by: str) -> memoryview:
        """The bytes of a buffer: the binary chunk, a data URI, or a file beside this one."""
        buffer = self.item("buffers", index, used_by)
        number = int(index)  # type: ignore[call-overload]
        if number not in self._buffers:
            self._buffers[number] = self._open_buffer(buffer, f"buffer {number}")
        return self._buffers[number]

    def _open_buffer(self, buffer: dict[str, Any], what: str) -> memoryview:
        uri = buffer.get("uri")
        if uri is None:
            if self._binary is None:
                raise SceneError(self.path, f"{what} has neither a uri nor a binary chunk; {CURE}")
            return self._binary
        if not isinstance(uri, str):
            raise SceneError(self.path, f"uri of {what} must be text, got {shown(uri)}; {CURE}")
        if uri.startswith("data:"):
            found = _DATA_URI.match(uri[:200])
            try:
                content = base64.b64decode(uri[found.end() :] if found else "?", validate=True)
            except (binascii.Error, ValueError):
                raise SceneError(self.path, f"{what} is no base64 data URI; {CURE}") from None
            return memoryview(content)
        path = find_within(self.path.parent, unquote(uri), self.path)
        with open_plain(path, "buffer of the glTF model") as file:
            size = file.seek(0, 2)
            if not size:
                raise SceneError(path, "is empty; copy or download it again")
            self.size += size
            return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))

    def array(self, index: object, used_by: str) -> "GltfArray":
        """The array that an accessor describes.

        Raises:
            SceneError: if it does not lie within its buffer, or is sparse or of an unknown kind.
        """
        accessor = self.item("accessors", index, used_by)
        if accessor.get("sparse") is not None:
            raise SceneError(self.path, f"{used_by} is a sparse accessor, which is not read; {CURE} without")
        dtype = _DTYPES.get(as_count(accessor.get("componentType"), 1 << 16) or 0)
        width = _WIDTHS.get(accessor["type"]) if isinstance(accessor.get("type"), str) else None
        if dtype is None or width is None:
            kind = f"{shown(accessor.get('type'))} of {shown(accessor.get('componentType'))}"
            raise SceneError(
                self.path, f"{used_by} must be a scalar or vector of numbers, got {kind}; {CURE}"
            )
        data, stride = self.view(accessor.get("bufferView"), used_by)
        count = self.count(accessor, "count", used_by)
        offset = self.count(accessor, "byteOffset", used_by, 0)
        item = np.dtype(dtype).itemsize * width
        stride = item if stride is None else stride
        missing = offset + (count - 1) * stride + item - len(data) if count else 0
        if stride < item or missing > 0:
            fact = f"lacks {missing} bytes of its buffer view" if missing > 0 else f"has a stride of {stride}"
            raise SceneError(self.path, f"{used_by} {fact}; download or {CURE}")
        values: NDArray[Any] = np.ndarray(
            (count, width), dtype, data, offset, (stride, np.dtype(dtype).itemsize)
        )
        return GltfArray(values, is_normalized=accessor.get("normalized") is True)


class GltfArray:
    """Numbers of an accessor, [count, width], converted where they are read."""

    def __init__(self, values: NDArray[Any], *, is_normalized: bool) -> None:
        self.values = values
        self.count, self.width = values.shape
        is_integer = values.dtype.kind in "iu"
        self._divisor = np.float32(np.iinfo(values.dtype).max) if is_integer and is_normalized else None

    def read(self, start: int, stop: int) -> NDArray[np.float32]:
        """Rows as float32; normalized integers in 0 to 1 or -1 to 1."""
        rows = self.values[start:stop].astype(np.float32)
        if self._divisor is not None:
            rows /= self._divisor
            np.maximum(rows, -1, out=rows)
        return rows
