""".splat files from values, and their values back, one Gaussian at a time; written apart from the reader."""

import math
import struct
from typing import Any

import numpy as np

C0 = 0.5 / math.sqrt(math.pi)
Scene = dict[str, Any]


def make(num_rows: int, seed: int = 0) -> Scene:
    """Values as the format has them: standard deviations, colors and opacities of 0 to 1."""
    rng = np.random.default_rng([20251123, seed])
    quats = rng.normal(size=(num_rows, 4))
    return {
        "means": rng.normal(size=(num_rows, 3)) * 3,
        "scales": np.exp(rng.normal(-4, 1, size=(num_rows, 3))),
        "colors": rng.random((num_rows, 3)),
        "opacities": np.r_[0.0, 1.0, rng.random(num_rows)][:num_rows],
        "quats": quats / np.linalg.norm(quats, axis=1, keepdims=True),
    }


def byte(value: float) -> int:
    return min(max(math.floor(value + 0.5), 0), 255)


def encode(scene: Scene) -> bytes:
    rows = []
    for mean, scale, color, opacity, quat in zip(*scene.values(), strict=True):
        rgba = [byte(255 * value) for value in (*color, opacity)]
        rows.append(struct.pack("<6f8B", *mean, *scale, *rgba, *(byte(128 * value + 128) for value in quat)))
    return b"".join(rows)


def decode(data: bytes) -> dict[str, np.ndarray]:
    """Columns as the reader returns them."""
    rows = list(struct.iter_unpack("<6f8B", data))
    return {
        "means": np.array([row[:3] for row in rows]),
        "scales": np.array([row[3:6] for row in rows]),
        "sh": np.array([[[(byte / 255 - 0.5) / C0 for byte in row[6:9]]] for row in rows]),
        "opacities": np.array([row[9] / 255 for row in rows]),
        "quats": np.array([[(byte - 128) / 128 for byte in row[10:]] for row in rows]),
    }
