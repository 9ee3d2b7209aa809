"""Writes SOG scenes from the bytes that they store, and decodes those as the specification says.

Nothing here is shared with the reader: an error in one of them shows.
"""

import io
import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

TERMS = {0: 0, 1: 3, 2: 8, 3: 15}


def webp(pixels: np.ndarray, **options: Any) -> bytes:
    """A picture of bytes; exact: colors under an alpha of 0 are kept."""
    stream = io.BytesIO()
    options = {"lossless": True, "exact": True, "quality": 1, "method": 0} | options
    Image.fromarray(pixels).save(stream, "WEBP", **options)
    return stream.getvalue()


def make(num_rows: int, degree: int = 0, version: int = 2, seed: int = 0) -> dict[str, Any]:
    """A scene as it is stored: "meta" and an array of bytes for each picture, by name."""
    rng = np.random.default_rng([seed, num_rows, degree, version])
    width = max(4, math.ceil(math.sqrt(num_rows) / 4) * 4)
    height = max(4, math.ceil(num_rows / width / 4) * 4)
    pixels = {
        name: rng.integers(0, 256, (height, width, channels), dtype=np.uint8)
        for name, channels in (("means_l", 3), ("means_u", 3), ("scales", 3), ("quats", 4), ("sh0", 4))
    }
    pixels["quats"][..., 3] = rng.integers(252, 256, (height, width))
    # Most opacities of a scene are 0 or 255: the exact ends must be there.
    pixels["sh0"][..., 3].reshape(-1)[:num_rows] = rng.choice([0, 1, 100, 254, 255], num_rows)
    meta: dict[str, Any] = {"means": {"mins": [-1.5, -0.5, 0.25], "maxs": [2.0, 0.75, 3.5]}}
    if version == 2:
        meta = {"version": 2, "count": num_rows} | meta
        meta["scales"] = {"codebook": np.sort(rng.uniform(-9, -1, 256)).tolist()}
        meta["sh0"] = {"codebook": np.sort(rng.uniform(-2, 2, 256)).tolist()}
    else:
        meta["means"] |= {"shape": [num_rows, 3], "dtype": "float32"}
        meta["scales"] = {"mins": [-9.0, -8.0, -7.0], "maxs": [-1.0, -2.0, -1.5]}
        meta["sh0"] = {"mins": [-2.0, -1.5, -1.0, -5.0], "maxs": [2.0, 1.5, 1.0, 9.0]}
    meta["quats"] = {"encoding": "quaternion_packed"} if version == 1 else {}
    if degree:
        num_entries = 150
        shape = (-(-num_entries // 64), 64 * TERMS[degree], 3)
        pixels["shN_centroids"] = rng.integers(0, 256, shape, dtype=np.uint8)
        labels = rng.integers(0, num_entries, (height, width))
        blue = np.zeros_like(labels)
        pixels["shN_labels"] = np.stack([labels & 255, labels >> 8, blue], axis=-1).astype(np.uint8)
        if version == 2:
            codebook = np.sort(rng.uniform(-1, 1, 256)).tolist()
            meta["shN"] = {"count": num_entries, "bands": degree, "codebook": codebook}
        else:
            meta["shN"] = {"mins": -1.0, "maxs": 1.5, "quantization": 8}
    for key in ("means", "scales", "quats", "sh0", "shN"):
        if key in meta:
            names = [f"{name}.webp" for name in pixels if name.split("_")[0] == key]
            meta[key]["files"] = names
    return {"meta": meta, **pixels}


def files_of(scene: dict[str, Any]) -> dict[str, bytes]:
    """The files of a scene by name, `meta.json` last as splat-transform writes it."""
    files = {f"{name}.webp": webp(pixels) for name, pixels in scene.items() if name != "meta"}
    return files | {"meta.json": json.dumps(scene["meta"]).encode()}


def write_folder(folder: Path, scene: dict[str, Any]) -> Path:
    """A scene as files in a folder, which is made."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files_of(scene).items():
        (folder / name).write_bytes(content)
    return folder


def zipped(files: dict[str, bytes], packing: int = zipfile.ZIP_STORED) -> bytes:
    """A zip archive of some files."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", packing) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return stream.getvalue()


def write_bundle(path: Path, scene: dict[str, Any], **options: Any) -> Path:
    """A scene as a zip archive."""
    path.write_bytes(zipped(files_of(scene), **options))
    return path


def decode(scene: dict[str, Any], rows: Any) -> dict[str, np.ndarray]:
    """Columns of some Gaussians, in float64: means, quats (w x y z), scales, opacities, sh [n, terms, 3]."""
    meta, is_v2 = scene["meta"], scene["meta"].get("version") == 2

    def pixels(name: str) -> np.ndarray:
        return scene[name].reshape(-1, scene[name].shape[2])[rows].astype(np.int64)

    def levels(name: str, stored: np.ndarray) -> np.ndarray:
        if is_v2:
            return np.array(meta[name]["codebook"])[stored]
        low, high = (np.array(meta[name][end]) for end in ("mins", "maxs"))
        return low + (high - low) * stored / 255

    least, most = (np.array(meta["means"][end]) for end in ("mins", "maxs"))
    stored = least + (most - least) * (pixels("means_u") * 256 + pixels("means_l")) / 65535
    *small, tags = pixels("quats").T
    small = (np.stack(small, axis=1) / 255 * 2 - 1) / np.sqrt(2)
    is_small = np.arange(4) != tags[:, None] - 252
    quats = np.empty(is_small.shape)
    quats[is_small], quats[~is_small] = small.ravel(), np.sqrt(np.maximum(0, 1 - (small**2).sum(axis=1)))
    rgba = pixels("sh0")
    sh, opacities = levels("sh0", rgba)[:, None, :3], rgba[:, 3] / 255
    if not is_v2:
        opacities = 1 / (1 + np.exp(-levels("sh0", rgba)[:, 3]))
    if "shN" in meta:
        height, width, _ = scene["shN_centroids"].shape
        labels = pixels("shN_labels") @ (1, 256, 0)
        entries = scene["shN_centroids"].reshape(height * 64, width // 64, 3)[labels]
        sh = np.concatenate([sh, levels("shN", entries)], axis=1)
    means, scales = np.sign(stored) * np.expm1(np.abs(stored)), np.exp(levels("scales", pixels("scales")))
    return {"means": means, "quats": quats, "scales": scales, "opacities": opacities, "sh": sh}
