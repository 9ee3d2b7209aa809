"""Writes glTF models of splats, as exporters do."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

PREFIX = "KHR_gaussian_splatting:"
_TYPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
_CODES = {"int8": 5120, "uint8": 5121, "int16": 5122, "uint16": 5123, "uint32": 5125, "float32": 5126}
Attributes = dict[str, np.ndarray]


def make(num_rows: int, degree: int = 0, seed: int = 0) -> Attributes:
    """Attributes of one primitive as the extension has them, float32."""
    rng = np.random.default_rng([seed, num_rows, degree])
    quats = rng.normal(size=(num_rows, 4))
    opacities = rng.uniform(0, 1, (num_rows, 1))
    opacities[:2, 0] = 0, 1
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    attributes = {"POSITION": rng.normal(size=(num_rows, 3)), f"{PREFIX}ROTATION": quats}
    attributes[f"{PREFIX}SCALE"] = np.exp(rng.uniform(-6, -1, (num_rows, 3)))
    attributes[f"{PREFIX}OPACITY"] = opacities
    for band in range(degree + 1):
        for index in range(2 * band + 1):
            attributes[f"{PREFIX}SH_DEGREE_{band}_COEF_{index}"] = rng.normal(size=(num_rows, 3)) / (1 + band)
    return {name: values.astype(np.float32) for name, values in attributes.items()}


class Model:
    """A model under construction: `top` is its JSON, which tests may change before it is written."""

    def __init__(self) -> None:
        self.data = b""
        self.top: dict[str, Any] = {"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"]}
        self.top |= {"buffers": [{"byteLength": 0}], "bufferViews": [], "accessors": [], "meshes": []}

    def accessor(self, values: np.ndarray, normalized: bool = False) -> int:
        """Adds an array of its own; returns its number."""
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": values.nbytes}
        self.data += values.tobytes() + bytes(-values.nbytes % 4)
        self.top["bufferViews"].append(view)
        entry = {"bufferView": len(self.top["bufferViews"]) - 1, "componentType": _CODES[values.dtype.name]}
        entry |= {"count": len(values), "type": _TYPES[values.shape[1]]}
        self.top["accessors"].append(entry | ({"normalized": True} if normalized else {}))
        return len(self.top["accessors"]) - 1

    def mesh(self, attributes: Attributes, normalized: tuple[str, ...] = (), **extension: object) -> int:
        """Adds a mesh of splats; returns its number."""
        names = (*normalized, "COLOR_0")
        indices = {name: self.accessor(values, name in names) for name, values in attributes.items()}
        self.add_mesh(indices, **extension)
        return len(self.top["meshes"]) - 1

    def add_mesh(self, indices: dict[str, int], **extension: object) -> None:
        own = {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"} | extension
        extensions = {"KHR_gaussian_splatting": own}
        primitive = {"attributes": indices, "mode": 0, "extensions": extensions}
        self.top["meshes"].append({"primitives": [primitive]})

    def interleaved(self, attributes: Attributes) -> int:
        """Adds a mesh whose rows hold all attributes, one after the other."""
        rows = np.concatenate([values.view(np.uint8) for values in attributes.values()], axis=1)
        stride, start = rows.shape[1], len(self.data)
        view = {"buffer": 0, "byteOffset": start, "byteLength": rows.size, "byteStride": stride}
        self.top["bufferViews"].append(view)
        self.data += rows.tobytes() + bytes(-rows.size % 4)
        indices, offset = {}, 0
        for name, values in attributes.items():
            indices[name] = len(self.top["accessors"])
            entry = {"bufferView": len(self.top["bufferViews"]) - 1, "byteOffset": offset}
            entry |= {"componentType": 5126, "count": len(values), "type": _TYPES[values.shape[1]]}  # type: ignore[dict-item]
            self.top["accessors"].append(entry)
            offset += values.shape[1] * 4
        self.add_mesh(indices)
        return len(self.top["meshes"]) - 1

    def json(self) -> bytes:
        self.top["buffers"][0]["byteLength"] = len(self.data)
        text = json.dumps(self.top).encode()
        return text + b" " * (-len(text) % 4)

    def glb(self) -> bytes:
        """The whole model in one file."""
        text = self.json()
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self.data), 0x004E4942) + self.data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks

    def write(self, path: Path) -> Path:
        """The model as .glb, or as .gltf with a data URI."""
        if path.suffix == ".gltf":
            encoded = base64.b64encode(self.data).decode()
            self.top["buffers"][0]["uri"] = f"data:application/octet-stream;base64,{encoded}"
            path.write_bytes(self.json())
        else:
            path.write_bytes(self.glb())
        return path
