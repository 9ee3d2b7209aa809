""".splat files from values, and their values back; written apart from the reader."""

import math
from typing import Any

import numpy as np

C0 = 0.5 / math.sqrt(math.pi)
ROW = np.dtype([("means", "<f4", 3), ("scales", "<f4", 3), ("rgba", "u1", 4), ("quats", "u1", 4)])
Scene = dict[str, Any]


def make(num_rows: int, seed: int = 0) -> Scene:
    """Values as the format has them: standard deviations, colors and opacities of 0 to 1."""
    rng = np.random.default_rng([20251123, seed])
    quats = rng.normal(size=(num_rows, 4))
    means, scales = rng.normal(size=(num_rows, 3)) * 3, np.exp(rng.normal(-4, 1, size=(num_rows, 3)))
    colors, opacities = rng.random((num_rows, 3)), np.r_[0.0, 1.0, rng.random(num_rows)][:num_rows]
    found = {"means": means, "scales": scales, "colors": colors, "opacities": opacities}
    return found | {"quats": quats / np.linalg.norm(quats, axis=1, keepdims=True)}


def as_bytes(values: np.ndarray) -> np.ndarray:
    return np.clip(np.floor(values + 0.5), 0, 255).astype(np.uint8)


def encode(scene: Scene) -> bytes:
    rows = np.zeros(len(scene["means"]), ROW)
    rows["means"], rows["scales"] = scene["means"], scene["scales"]
    rows["rgba"] = as_bytes(255 * np.c_[scene["colors"], scene["opacities"]])
    rows["quats"] = as_bytes(128 * scene["quats"] + 128)
    return rows.tobytes()


def decode(data: bytes) -> dict[str, np.ndarray]:
    """Columns as the reader returns them."""
    rows = np.frombuffer(data, ROW)
    found = {"means": rows["means"], "scales": rows["scales"], "quats": (rows["quats"] - 128.0) / 128}
    return found | {"opacities": rows["rgba"][:, 3] / 255, "sh": (rows["rgba"][:, None, :3] / 255 - 0.5) / C0}
