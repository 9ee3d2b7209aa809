"""Reads .glb files by the text of the specification, and knows nothing of how they were written."""

import io
import json
import struct

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

TYPES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}


class Glb:
    """A model: `top` is its JSON, `binary` its second chunk."""

    def __init__(self, content):
        magic, version, length = struct.unpack_from("<4sII", content)
        assert (magic, version, length) == (b"glTF", 2, len(content))
        chunks, start = [], 12
        while start < length:
            size, kind = struct.unpack_from("<I4s", content, start)
            assert size % 4 == 0
            assert start + 8 + size <= length
            chunks.append((kind, content[start + 8 : start + 8 + size]))
            start += 8 + size
        assert start == length
        assert [kind for kind, _ in chunks] == [b"JSON", b"BIN\0"]
        self.text, self.binary = chunks[0][1], chunks[1][1]
        self.top = json.loads(self.text, parse_constant=lambda word: 1 / 0)

    def array(self, index):
        accessor = self.top["accessors"][index]
        view = self.top["bufferViews"][accessor["bufferView"]]
        width, dtype = TYPES[accessor["type"]], np.dtype(COMPONENTS[accessor["componentType"]])
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        stop = start + accessor["count"] * width * dtype.itemsize
        assert stop <= view.get("byteOffset", 0) + view["byteLength"]
        values = np.frombuffer(self.binary[start:stop], dtype).reshape(-1, width)
        if accessor.get("normalized"):
            values = values / np.iinfo(dtype).max
        return values

    def image(self, number=0):
        """[h, w, 4] of the brushes; 1 is that of their normals, where paint is lit."""
        image = self.top["images"][number]
        view = self.top["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        return np.asarray(Image.open(io.BytesIO(self.binary[start : start + view["byteLength"]])))

    def world_matrices(self):
        """[4, 4] of each node, by its number: its own times those of its parents."""
        found, open_nodes = {}, [(node, np.eye(4)) for node in self.top["scenes"][self.top["scene"]]["nodes"]]
        while open_nodes:
            number, parent = open_nodes.pop()
            node = self.top["nodes"][number]
            found[number] = parent @ local_matrix(node)
            open_nodes += [(child, found[number]) for child in node.get("children", [])]
        return found

    def meshes(self):
        """Name, vertices in the world [n, 3], faces [f, 3], texture coordinates and colors of each node."""
        matrices = self.world_matrices()
        for number, node in enumerate(self.top["nodes"]):
            if "mesh" not in node:
                continue
            (primitive,) = self.top["meshes"][node["mesh"]]["primitives"]
            attributes = {name: self.array(at) for name, at in primitive["attributes"].items()}
            matrix = matrices[number]
            vertices = attributes["POSITION"].astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
            faces = self.array(primitive["indices"]).reshape(-1, 3).astype(np.int64)
            yield node["name"], vertices, faces, attributes["TEXCOORD_0"], attributes["COLOR_0"]


def local_matrix(node):
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix()
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix
