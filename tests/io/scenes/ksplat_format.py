""".ksplat files from values, and their values back, one Gaussian at a time; written apart from the reader."""

import math
import struct
from typing import Any

import numpy as np

from tests.io.scenes.splat_format import C0, byte

NUM_REST = (0, 3, 8, 15)  # coefficients per channel, by degree
BUCKET_ROWS, BLOCK = 16, 5.0
LIMITS = -2.0, 1.0  # of coefficients, at level 2
Scene = dict[str, Any]
BASE = (struct.Struct("<3f3f4f4B"), struct.Struct("<3H3e4e4B"), struct.Struct("<3H3e4e4B"))
REST = "feB"  # type of a coefficient, by level


def make(num_rows: int, degree: int = 0, seed: int = 0) -> Scene:
    """Values as the format has them; all Gaussians lie within a block around the origin."""
    rng = np.random.default_rng([20251125, seed])
    quats = rng.normal(size=(num_rows, 4))
    return {
        "means": rng.uniform(-0.24, 0.24, size=(num_rows, 3)) * BLOCK,
        "scales": np.exp(rng.normal(-4, 1, size=(num_rows, 3))),
        "quats": quats / np.linalg.norm(quats, axis=1, keepdims=True),
        "colors": rng.random((num_rows, 3)),
        "opacities": np.r_[0.0, 1.0, rng.random(num_rows)][:num_rows],
        "rest": rng.uniform(*LIMITS, size=(num_rows, 3, NUM_REST[degree])),  # channel by channel
    }


def in_bands(rest: Any) -> list[float]:
    """[3, coefficients] -> in the order of the file: band by band, within a band channel by channel."""
    found: list[float] = []
    for band in (1, 2, 3):
        for channel in rest:
            found += list(channel[band * band - 1 : (band + 1) ** 2 - 1])
    return found


def _row(scene: Scene, row: int, mean: Any, level: int, limits: tuple[float, float]) -> bytes:
    rgba = [byte(255 * value) for value in (*scene["colors"][row], scene["opacities"][row])]
    rest = in_bands(scene["rest"][row])
    if level == 2:
        low, high = limits
        rest = [min(max(math.floor((value - low) / (high - low) * 255), 0), 255) for value in rest]
    base = BASE[level].pack(*mean, *scene["scales"][row], *scene["quats"][row], *rgba)
    return base + struct.pack(f"<{len(rest)}{REST[level]}", *rest)


def _section(
    scene: Scene, level: int, room: int, partial: list[int], offsets: int, limits: tuple[float, float]
) -> tuple[bytes, bytes]:
    """Header and content; the last buckets hold so many Gaussians as `partial` says, all others 16."""
    num_rows = len(scene["means"])
    degree = NUM_REST.index(scene["rest"].shape[2])
    num_full = (num_rows - sum(partial)) // BUCKET_ROWS
    lengths = [BUCKET_ROWS] * num_full + partial
    assert sum(lengths) == num_rows
    bucket_of = [bucket for bucket, length in enumerate(lengths) for _ in range(length)]
    centers = [
        np.float32(scene["means"][[b == bucket for b in bucket_of]].mean(axis=0)) if length else np.zeros(3)
        for bucket, length in enumerate(lengths)
    ]
    rows = []
    for row, mean in enumerate(scene["means"]):
        if level:
            away = mean - centers[bucket_of[row]]
            mean = [round(d / (BLOCK / 2 / offsets)) + offsets for d in away]
        rows.append(_row(scene, row, mean, level, limits))
    size = BASE[level].size + struct.calcsize(f"<{3 * NUM_REST[degree]}{REST[level]}")
    data = b"".join(rows) + b"\xee" * size * (room - num_rows)
    if level:
        table = struct.pack(f"<{len(partial)}I", *partial)
        data = table + b"".join(struct.pack("<3f", *center) for center in centers) + data
    buckets = (BUCKET_ROWS, len(lengths), BLOCK, 12, offsets) if level else (0, 0, 0.0, 0, 0)
    ends = (num_full, len(partial)) if level else (0, 0)
    stored = 0 if offsets == 32767 else offsets  # 0 stands for the usual range
    header = struct.pack("<IIIIfHxxI", num_rows, room, *buckets[:4], stored if level else 0)
    return (header + struct.pack("<IIIH", len(data), *ends, degree)).ljust(1024, b"\0"), data


def encode(
    scenes: list[Scene],
    level: int,
    *,
    room: int = 0,
    partial: tuple[int, ...] = (),
    offsets: int = 32767,
    limits: tuple[float, float] = LIMITS,
    num_sections: int = 0,
) -> bytes:
    """A file with a section for each scene, each with room for so many more Gaussians."""
    sections = []
    for scene in scenes:
        num_rows = len(scene["means"])
        lengths = list(partial) or ([num_rows % BUCKET_ROWS] if num_rows % BUCKET_ROWS else [])
        sections.append(_section(scene, level, num_rows + room, lengths, offsets, limits))
    total = sum(len(scene["means"]) for scene in scenes)
    most = max(num_sections, len(scenes))
    header = struct.pack("<BBxxIIIIHxx3f", 0, 1, most, len(scenes), total + room, total, level, 0, 0, 0)
    header += struct.pack("<2f", *((0, 0) if limits == (-1.5, 1.5) else limits))
    parts = [header.ljust(4096, b"\0"), *(part for part, _ in sections)]
    parts += [b"\0" * 1024] * (most - len(scenes))
    return b"".join([*parts, *(data for _, data in sections)])


def _terms(rest: list[float], degree: int) -> list[list[float]]:
    """The opposite of `in_bands`: one coefficient of all channels after the other."""
    terms = []
    for band in range(1, degree + 1):
        width, first = 2 * band + 1, 3 * (band * band - 1)
        terms += [[rest[first + width * channel + m] for channel in range(3)] for m in range(width)]
    return terms


def decode(data: bytes) -> dict[str, np.ndarray]:
    """Columns as the reader returns them; coefficients of bands that a section has not are 0."""
    num_sections, level = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<H", data, 20)[0]
    low, high = struct.unpack_from("<2f", data, 36)
    low, high = low or -1.5, high or 1.5
    start = 4096 + 1024 * num_sections
    found: dict[str, list[Any]] = {name: [] for name in ("means", "scales", "quats", "opacities", "sh")}
    for section in range(num_sections):
        fields = struct.unpack_from("<IIIIfHxxIIIIH", data, 4096 + 1024 * section)
        count, room, bucket_rows, num_buckets, block, _, offsets, _, num_full, num_partial, degree = fields
        offsets = offsets or 32767
        lengths = [bucket_rows] * num_full + list(struct.unpack_from(f"<{num_partial}I", data, start))
        start += 4 * num_partial
        centers = np.frombuffer(data, "<f4", 3 * num_buckets, start).reshape(-1, 3).astype(float)
        start += 12 * num_buckets
        bucket_of = np.repeat(np.arange(len(lengths)), lengths)
        num_rest = NUM_REST[degree]
        kind = f"<{3 * num_rest}{REST[level]}"
        size = BASE[level].size + struct.calcsize(kind)
        for row in range(count):
            values = BASE[level].unpack_from(data, start + size * row)
            mean = values[:3]
            if level:
                mean = (np.array(mean) - offsets) * block / 2 / offsets + centers[bucket_of[row]]
            found["means"].append(mean)
            found["scales"].append(values[3:6])
            found["quats"].append(values[6:10])
            found["opacities"].append(values[13] / 255)
            rest = list(struct.unpack_from(kind, data, start + size * row + BASE[level].size))
            if level == 2:
                rest = [value / 255 * (high - low) + low for value in rest]
            color = [(value / 255 - 0.5) / C0 for value in values[10:13]]
            found["sh"].append([color, *_terms(rest, degree)])
        start += size * room
    most = max(map(len, found["sh"]))
    found["sh"] = [terms + [[0.0] * 3] * (most - len(terms)) for terms in found["sh"]]
    return {name: np.array(values) for name, values in found.items()}
