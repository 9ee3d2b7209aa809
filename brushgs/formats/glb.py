"""A glTF 2.0 model under construction: lists of objects, and one binary chunk; written as .glb.

What the objects mean is the business of who adds them. Source: Khronos, glTF 2.0 Specification.
"""

import json
import struct
from typing import Any, BinaryIO, Literal

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.gltf_file import BINARY_CHUNK, JSON_CHUNK
from brushgs.version import __version__

_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_COMPONENTS = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
_TARGETS = {"vertices": 34962, "indices": 34963}
MOST_BYTES = 2**32 - 1  # the header counts them in 32 bits


class GlbWriter:
    """Objects in the order in which they are added; equal ones give equal bytes.

    Attributes:
        top: the JSON; what `add` has no list for is set here.
    """

    def __init__(self) -> None:
        self.top: dict[str, Any] = {"asset": {"version": "2.0", "generator": f"brushgs {__version__}"}}
        self._parts: list[memoryview] = []
        self._size = 0

    def add(self, kind: str, **fields: Any) -> int:
        """Add an object to the list of a kind, such as "nodes"; returns its number."""
        items = self.top.setdefault(kind, [])
        items.append(fields)
        return len(items) - 1

    def uses(self, extension: str) -> None:
        """Name an extension that some object has, and that a reader may ignore."""
        used = self.top.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def view(self, content: bytes | memoryview, **fields: Any) -> int:
        """Add bytes to the binary chunk, at a multiple of four; returns the number of their buffer view."""
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
        """Add an array with a view of its own; returns the number of its accessor.

        Args:
            values: [n] or [n, width] with n >= 1, of a dtype that glTF has. A row of vertices takes a
                multiple of four bytes.
            of: what it is used for.
            normalized: whether integers are shares of their largest value.
            has_bounds: whether the smallest and the largest value of each column are stated, as those of
                positions must be.
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

        Raises:
            ValueError: if it has more bytes than the format can count, or a number is not finite.
        """
        top = dict(self.top)
        if self._size:
            top["buffers"] = [{"byteLength": self._size}]
        text = json.dumps(top, allow_nan=False, separators=(",", ":")).encode("ascii")
        text += b" " * (-len(text) % 4)
        binary = self._size + -self._size % 4
        total = 12 + 8 + len(text) + (8 + binary if binary else 0)
        if total > MOST_BYTES:
            raise ValueError(
                f"a GLB file must have less than 4 GiB, got {total / 2**30:.1f}; write less into it"
            )
        file.write(struct.pack("<4sII", b"glTF", 2, total))
        file.write(struct.pack("<II", len(text), JSON_CHUNK) + text)
        if binary:
            file.write(struct.pack("<II", binary, BINARY_CHUNK))
            for part in self._parts:
                file.write(part)
            file.write(bytes(binary - self._size))
