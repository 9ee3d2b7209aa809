""".ksplat files from values, and their values back; written apart from the reader."""

import struct
from typing import Any

import numpy as np

from tests.io.scenes.splat_format import C0, as_bytes

NUM_REST = (0, 3, 8, 15)  # coefficients per channel, by degree
BUCKET_ROWS, BLOCK = 16, 5.0
LIMITS = -2.0, 1.0  # of coefficients, at level 2
Scene = dict[str, Any]
# By level: of centers, of sizes and turns, of coefficients.
TYPES = (("<f4", "<f4", "<f4"), ("<u2", "<f2", "<f2"), ("<u2", "<f2", "u1"))


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


def in_bands(rest: np.ndarray) -> np.ndarray:
    """[n, 3, k] -> [n, 3 k] in the order of the file: band by band, within a band channel by channel."""
    bands = (rest[:, :, band * band - 1 : (band + 1) ** 2 - 1] for band in (1, 2, 3))
    return np.concatenate([band.reshape(len(rest), -1) for band in bands], axis=1)


def row_type(level: int, degree: int) -> np.dtype:
    mean, size, rest = TYPES[level]
    columns = [("means", mean, 3), ("scales", size, 3), ("quats", size, 4), ("rgba", "u1", 4)]
    return np.dtype([*columns, ("rest", rest, (3 * NUM_REST[degree],))])


def _section(scene: Scene, level: int, room: int, partial, offsets, limits) -> tuple[bytes, bytes]:
    """Header and content; the last buckets hold so many Gaussians as `partial` says, all others 16."""
    means, num_rows = scene["means"], len(scene["means"])
    degree = NUM_REST.index(scene["rest"].shape[2])
    num_full = (num_rows - sum(partial)) // BUCKET_ROWS
    lengths = [BUCKET_ROWS] * num_full + partial
    rest, rows = in_bands(scene["rest"]), np.zeros(num_rows, row_type(level, degree))
    data = b""
    if level:
        bucket_of = np.repeat(np.arange(len(lengths)), lengths)
        sums = np.array([means[bucket_of == bucket].sum(axis=0) for bucket in range(len(lengths))])
        centers = (sums / np.maximum(lengths, 1)[:, None]).astype("<f4")
        means = np.rint((means - centers[bucket_of]) / (BLOCK / 2 / offsets)) + offsets
        data = struct.pack(f"<{len(partial)}I", *partial) + centers.tobytes()
    if level == 2:
        rest = np.clip(np.floor((rest - limits[0]) / (limits[1] - limits[0]) * 255), 0, 255)
    rows["means"], rows["scales"], rows["quats"], rows["rest"] = means, scene["scales"], scene["quats"], rest
    rows["rgba"] = as_bytes(255 * np.c_[scene["colors"], scene["opacities"]])
    data += rows.tobytes() + b"\xee" * rows.itemsize * (room - num_rows)
    buckets = (BUCKET_ROWS, len(lengths), BLOCK, 12) if level else (0, 0, 0.0, 0)
    ends = (num_full, len(partial)) if level else (0, 0)
    stored = 0 if offsets == 32767 else offsets  # 0 stands for the usual range
    header = struct.pack("<IIIIfHxxI", num_rows, room, *buckets, stored if level else 0)
    return (header + struct.pack("<IIIH", len(data), *ends, degree)).ljust(1024, b"\0"), data


def encode(scenes, level, *, room=0, partial=(), offsets=32767, limits=LIMITS, num_sections=0) -> bytes:
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


def decode(data: bytes) -> dict[str, np.ndarray]:
    """Columns as the reader returns them; coefficients of bands that a section has not are 0."""
    num_sections, level = struct.unpack_from("<I", data, 4)[0], struct.unpack_from("<H", data, 20)[0]
    low, high = struct.unpack_from("<2f", data, 36)
    low, high = low or -1.5, high or 1.5
    start, found = 4096 + 1024 * num_sections, []
    for section in range(num_sections):
        fields = struct.unpack_from("<IIIIfHxxIIIIH", data, 4096 + 1024 * section)
        count, room, bucket_rows, num_buckets, block, _, offsets, _, num_full, num_partial, degree = fields
        partial = np.frombuffer(data, "<u4", num_partial, start)
        centers = np.frombuffer(data, "<f4", 3 * num_buckets, start + 4 * num_partial).reshape(-1, 3)
        start += 4 * num_partial + 12 * num_buckets
        rows = np.frombuffer(data, row_type(level, degree), count, start)
        start += rows.itemsize * room
        means, rest, terms = rows["means"].astype(float), rows["rest"].astype(float), NUM_REST[degree]
        if level:
            bucket_of = np.repeat(np.arange(num_buckets), [bucket_rows] * num_full + partial.tolist())
            means = (means - (offsets or 32767)) * block / 2 / (offsets or 32767) + centers[bucket_of]
        if level == 2:
            rest = rest / 255 * (high - low) + low
        places = in_bands(np.arange(3 * terms).reshape(1, 3, terms))[0].argsort()
        sh = np.zeros((count, 16, 3))
        sh[:, 0] = (rows["rgba"][:, :3] / 255 - 0.5) / C0
        sh[:, 1 : 1 + terms] = rest[:, places].reshape(count, 3, terms).swapaxes(1, 2)
        found.append((degree, means, rows["scales"], rows["quats"], rows["rgba"][:, 3] / 255, sh))
    degrees, *columns = zip(*found, strict=True)
    means, scales, quats, opacities, sh = map(np.concatenate, columns)
    sh = sh[:, : 1 + NUM_REST[max(degrees)]]
    return {"means": means, "scales": scales, "quats": quats, "opacities": opacities, "sh": sh}
