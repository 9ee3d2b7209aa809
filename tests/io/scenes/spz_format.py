"""SPZ files from values, and their values back, by the specification; written apart from the reader."""

import gzip
import struct
from itertools import pairwise
from typing import Any

import numpy as np
import zstandard

from tests.io.scenes.splat_format import as_bytes

ANTIALIASED, EXTENSIONS = 1, 2
COORDINATE_SYSTEM = 0xADBE0003
NUM_REST = (0, 3, 8, 15, 24)  # coefficients per channel, by degree
SMALL = np.array([20, 10, 0])  # places of the three smaller components in a word
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


def _places(means: np.ndarray, version: int, bits: int) -> bytes:
    if version == 1:
        return means.astype("<f2").tobytes()
    return np.rint(means * 2**bits).astype("<i4").reshape(-1, 1).view(np.uint8)[:, :3].tobytes()


def _turns(quats: np.ndarray, version: int) -> bytes:
    xyzw = np.roll(quats, -1, axis=1)
    if version < 3:
        return as_bytes(127.5 + 127.5 * np.where(quats[:, :1] < 0, -1, 1) * xyzw[:, :3]).tobytes()
    largest = np.abs(xyzw).argmax(axis=1)[:, None]
    small = xyzw[np.arange(4) != largest].reshape(-1, 3)
    is_negative = (small < 0) != (np.take_along_axis(xyzw, largest, 1) < 0)
    parts = is_negative * 512 + np.floor(511 * np.abs(small) * np.sqrt(2) + 0.5).astype(np.int64)
    return ((largest[:, 0] << 30) + (parts << SMALL).sum(axis=1)).astype("<u4").tobytes()


def blocks(scene: Scene, version: int, bits: int = 12) -> list[bytes]:
    """Positions, opacities, colors, scales, rotations, spherical harmonics."""
    colors, scales = (0.5 + 0.15 * scene["sh0"]) * 255, (scene["log_scales"] + 10) * 16
    values = scene["opacities"] * 255, colors, scales, 128 + 128 * scene["rest"]
    *stored, rest = (as_bytes(some).tobytes() for some in values)
    return [_places(scene["means"], version, bits), *stored, _turns(scene["quats"], version), rest]


def record(kind: int, payload: bytes) -> bytes:
    """An extension."""
    return struct.pack("<II", kind, len(payload)) + payload


def encode(scene: Scene, version: int, *, bits=12, flags=0, extensions=b"", packed=True) -> bytes:
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


def encode_4(num_rows: int, degree: int, parts: list[bytes], *, bits=12, flags=0, extensions=b"") -> bytes:
    """A file of version 4."""
    parts = [part for part in parts if part]
    streams = [zstandard.ZstdCompressor().compress(part) for part in parts]
    header = struct.pack("<4sIIBBBB", b"NGSP", 4, num_rows, degree, bits, flags, len(parts))
    header += struct.pack("<I12x", 32 + len(extensions))
    sizes = zip(map(len, streams), map(len, parts), strict=True)
    return b"".join([header, extensions, *(struct.pack("<QQ", *size) for size in sizes), *streams])


def streams(data: bytes) -> list[bytes]:
    """The compressed streams of a file of version 4."""
    table = struct.unpack_from("<I", data, 16)[0]
    start, found = table + 16 * data[15], []
    for stream in range(data[15]):
        size = struct.unpack_from("<Q", data, table + 16 * stream)[0]
        found.append(data[start : start + size])
        start += size
    return found


def decode(data: bytes, most: int | None = None) -> dict[str, np.ndarray]:
    """Columns of a file, or of its first Gaussians, as the reader returns them."""
    content = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    _, version, count, degree, bits = struct.unpack_from("<4sIIBB", content)
    widths = [6 if version == 1 else 9, 1, 3, 3, 3 if version < 3 else 4, 3 * NUM_REST[degree]]
    if version < 4:
        ends = np.cumsum([16, *(width * count for width in widths)])
        parts = [content[start:end] for start, end in pairwise(ends)]
    else:
        parts = [zstandard.ZstdDecompressor().decompress(stream) for stream in streams(content)]
        parts += [b""] * (6 - len(parts))
    rows = zip([np.frombuffer(part, np.uint8) for part in parts], widths, strict=True)
    means, alphas, colors, scales, turns, rest = (part.reshape(count, n)[:most] for part, n in rows)
    if version == 1:
        means = np.ascontiguousarray(means).view("<f2").astype(float)
    else:
        words = np.pad(means.reshape(-1, 3), ((0, 0), (1, 0))).view("<i4") >> 8
        means = words.reshape(-1, 3) / 2**bits
    sh = [((colors / 255 - 0.5) / 0.15)[:, None], (rest.reshape(len(rest), -1, 3) - 128.0) / 128]
    found = {"means": means, "opacities": alphas[:, 0] / 255, "scales": np.exp(scales / 16 - 10)}
    return found | {"quats": _decode_turns(turns), "sh": np.concatenate(sh, axis=1)}


def _decode_turns(packed: np.ndarray) -> np.ndarray:
    if packed.shape[1] == 3:
        small, largest = packed / 127.5 - 1, np.full((len(packed), 1), 3)
    else:
        words = np.ascontiguousarray(packed).view("<u4").astype(np.int64)
        parts, largest = words >> SMALL & 1023, words >> 30
        small = np.where(parts > 511, -1, 1) * (parts & 511) / 511 * np.sqrt(0.5)
    xyzw = np.zeros((len(small), 4))
    xyzw[np.arange(4) != largest] = small.ravel()
    np.put_along_axis(xyzw, largest, np.sqrt(np.maximum(0, 1 - (small**2).sum(axis=1)))[:, None], 1)
    return np.roll(xyzw, 1, axis=1)
