"""SPZ files from values, and their values back, one Gaussian at a time as the specification has it.

Both are written apart from the reader: plain Python numbers, no arrays.
"""

import gzip
import math
import struct
from itertools import pairwise
from typing import Any

import numpy as np
import zstandard

ANTIALIASED, EXTENSIONS = 1, 2
COORDINATE_SYSTEM = 0xADBE0003
NUM_REST = (0, 3, 8, 15, 24)  # coefficients per channel, by degree
Scene = dict[str, Any]


def make(num_rows: int, degree: int = 0, seed: int = 0) -> Scene:
    """Values as a PLY has them: log-scales, unit quaternions w x y z; opacities of 0 to 1."""
    rng = np.random.default_rng([20251122, seed])
    quats = rng.normal(size=(num_rows, 4))
    return {
        "means": rng.normal(size=(num_rows, 3)) * 3,
        "log_scales": rng.uniform(-9.9, 5.8, size=(num_rows, 3)),
        "quats": quats / np.linalg.norm(quats, axis=1, keepdims=True),
        "opacities": np.r_[0.0, 1.0, rng.random(num_rows)][:num_rows],
        "sh0": rng.uniform(-3.2, 3.2, size=(num_rows, 3)),
        "rest": rng.uniform(-0.99, 0.98, size=(num_rows, NUM_REST[degree], 3)),
    }


def _byte(value: float) -> int:
    return min(max(math.floor(value + 0.5), 0), 255)


def _position(row: Any, version: int, bits: int) -> bytes:
    if version == 1:
        return struct.pack("<3e", *row)
    return b"".join(round(value * 2**bits).to_bytes(3, "little", signed=True) for value in row)


def _rotation(row: Any, version: int) -> bytes:
    w, x, y, z = (float(value) for value in row)
    if version < 3:
        sign = -1 if w < 0 else 1
        return bytes(_byte(127.5 + 127.5 * sign * value) for value in (x, y, z))
    components = [x, y, z, w]
    largest = max(range(4), key=lambda index: abs(components[index]))
    word = largest
    for index, value in enumerate(components):
        if index != largest:
            is_negative = (value < 0) != (components[largest] < 0)
            word = word << 10 | is_negative << 9 | math.floor(511 * abs(value) * math.sqrt(2) + 0.5)
    return struct.pack("<I", word)


def blocks(scene: Scene, version: int, bits: int = 12) -> list[bytes]:
    """Positions, opacities, colors, scales, rotations, spherical harmonics."""
    return [
        b"".join(_position(row, version, bits) for row in scene["means"]),
        bytes(_byte(value * 255) for value in scene["opacities"]),
        bytes(_byte((0.5 + 0.15 * value) * 255) for value in scene["sh0"].ravel()),
        bytes(_byte((value + 10) * 16) for value in scene["log_scales"].ravel()),
        b"".join(_rotation(row, version) for row in scene["quats"]),
        bytes(_byte(128 + 128 * value) for value in scene["rest"].ravel()),
    ]


def record(kind: int, payload: bytes) -> bytes:
    """An extension."""
    return struct.pack("<II", kind, len(payload)) + payload


def encode(
    scene: Scene,
    version: int,
    *,
    bits: int = 12,
    flags: int = 0,
    extensions: bytes = b"",
    packed: bool = True,
) -> bytes:
    """A whole file; without gzip if it is not to be packed."""
    parts = blocks(scene, version, bits)
    degree = NUM_REST.index(scene["rest"].shape[1])
    flags |= EXTENSIONS if extensions else 0
    num_rows = len(scene["means"])
    if version < 4:
        header = struct.pack("<4sIIBBBB", b"NGSP", version, num_rows, degree, bits, flags, 0)
        content = b"".join([header, *parts, extensions])
        return gzip.compress(content, mtime=0) if packed else content
    return encode_4(num_rows, degree, parts, bits=bits, flags=flags, extensions=extensions)


def encode_4(
    num_rows: int, degree: int, parts: list[bytes], *, bits: int = 12, flags: int = 0, extensions: bytes = b""
) -> bytes:
    """A file of version 4."""
    parts = [part for part in parts if part]
    streams = [zstandard.ZstdCompressor().compress(part) for part in parts]
    header = struct.pack("<4sIIBBBB", b"NGSP", 4, num_rows, degree, bits, flags, len(parts))
    header += struct.pack("<I12x", 32 + len(extensions))
    table = b"".join(
        struct.pack("<QQ", len(stream), len(part)) for stream, part in zip(streams, parts, strict=True)
    )
    return b"".join([header, extensions, table, *streams])


def streams(data: bytes) -> list[bytes]:
    """The compressed streams of a file of version 4."""
    table = struct.unpack_from("<I", data, 16)[0]
    start, found = table + 16 * data[15], []
    for stream in range(data[15]):
        size = struct.unpack_from("<Q", data, table + 16 * stream)[0]
        found.append(data[start : start + size])
        start += size
    return found


def _parts(content: bytes, version: int, sizes: list[int]) -> list[bytes]:
    if version < 4:
        return [content[start:end] for start, end in pairwise(np.cumsum([16, *sizes]))]
    parts = [zstandard.ZstdDecompressor().decompress(stream) for stream in streams(content)]
    return parts + [b""] * (6 - len(parts))


def decode(data: bytes, most: int | None = None) -> dict[str, np.ndarray]:
    """Columns of a file, or of its first Gaussians, as the reader returns them."""
    content = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    _, version, count, degree, bits = struct.unpack_from("<4sIIBB", content)
    per_row = [6 if version == 1 else 9, 1, 3, 3, 3 if version < 3 else 4, 3 * NUM_REST[degree]]
    parts = _parts(content, version, [size * count for size in per_row])
    rows = [
        [part[size * row : size * (row + 1)] for part, size in zip(parts, per_row, strict=True)]
        for row in range(min(count, most or count))
    ]
    scene: Scene = {name: [] for name in ("means", "opacities", "sh0", "log_scales", "quats", "rest")}
    for position, alpha, color, scale, rotation, rest in rows:
        scene["means"].append(_decode_position(position, bits))
        scene["opacities"].append(alpha[0] / 255)
        scene["sh0"].append([(byte / 255 - 0.5) / 0.15 for byte in color])
        scene["log_scales"].append([byte / 16 - 10 for byte in scale])
        scene["quats"].append(_decode_rotation(rotation))
        scene["rest"].append(((np.frombuffer(rest, np.uint8) - 128.0) / 128).reshape(-1, 3).tolist())
    sh = [[color, *rest] for color, rest in zip(scene.pop("sh0"), scene.pop("rest"), strict=True)]
    scene["scales"] = np.exp(scene.pop("log_scales"))
    return {name: np.array(values) for name, values in (scene | {"sh": sh}).items()}


def _decode_position(packed: bytes, bits: int) -> Any:
    if len(packed) == 6:
        return struct.unpack("<3e", packed)
    integers = [int.from_bytes(packed[i : i + 3], "little", signed=True) for i in (0, 3, 6)]
    return [value / 2**bits for value in integers]


def _decode_rotation(packed: bytes) -> list[float]:
    if len(packed) == 3:
        x, y, z = (byte / 127.5 - 1 for byte in packed)
        return [math.sqrt(max(0, 1 - x * x - y * y - z * z)), x, y, z]
    word = int.from_bytes(packed, "little")
    largest = word >> 30
    components = [0.0] * 4  # x, y, z, w
    for index in (3, 2, 1, 0):
        if index != largest:
            magnitude, is_negative = word & 511, word >> 9 & 1
            components[index] = (-1) ** is_negative * magnitude / 511 * math.sqrt(0.5)
            word >>= 10
    components[largest] = math.sqrt(max(0, 1 - sum(value * value for value in components)))
    return [components[3], *components[:3]]
