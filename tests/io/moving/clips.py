"""Small clips in the formats that are formulas, and their moments by float64 arithmetic, row by row.

Written apart from the readers: nothing here comes from brushgs.
"""

import json
import math
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tests.io.ply_maker import scene_columns, write_scene

C0 = 0.5 / math.sqrt(math.pi)
Columns = dict[str, np.ndarray]
Moment = dict[str, np.ndarray]


def spacetime_columns(num_rows: int, seed: int = 0) -> Columns:
    """Properties of a SpaceTimeGaussian lite PLY, as its trainer writes them: float32."""
    rng = np.random.default_rng([20261122, seed])
    columns = scene_columns(num_rows, 0, seed)
    more = {"trbf_center": rng.random(num_rows), "trbf_scale": rng.normal(0, 1.5, num_rows)}
    more |= {f"motion_{i}": rng.normal(0, 0.7, num_rows) for i in range(9)}
    more |= {f"f_dc_{i}": rng.random(num_rows) for i in range(3)}
    more |= {f"omega_{i}": rng.normal(0, 0.2, num_rows) for i in range(4)}
    return columns | {name: values.astype(np.float32) for name, values in more.items()}


def freetime_columns(num_rows: int, degree: int = 0, seed: int = 0) -> Columns:
    """Properties of a FreeTimeGS PLY."""
    rng = np.random.default_rng([20261123, seed])
    more = {"time": rng.random(num_rows), "log_duration": rng.normal(-1.5, 1, num_rows)}
    more |= {f"velocity_{i}": rng.normal(0, 2, num_rows) for i in range(3)}
    columns = scene_columns(num_rows, degree, seed)
    return columns | {name: values.astype(np.float32) for name, values in more.items()}


FREETIME_COMMENTS = (
    *("comment ftgs_version 1", "comment time_units normalized", "comment use_velocity 1"),
    *("comment min_duration 0.02", "comment opacity_floor 0.0001", "comment n_frames 61"),
)


def write_freetime(path: Path, columns: Columns, comments: Sequence[str] = FREETIME_COMMENTS) -> Path:
    return write_scene(path, columns, comments=comments)


def splatv_rows(columns: Columns) -> list[tuple[Any, ...]]:
    """The values of each row of a splaTV file, of the columns of a SpaceTimeGaussian PLY."""
    rows = []
    with np.errstate(over="ignore"):
        widths = np.exp(columns["trbf_scale"]).astype(np.float16)
    for i in range(len(columns["x"])):
        value = {name: float(values[i]) for name, values in columns.items()}
        rgba = [255 * value[f"f_dc_{j}"] for j in range(3)]
        rgba.append(255 / (1 + math.exp(-value["opacity"])))
        rows.append(
            (
                *(value[axis] for axis in "xyz"),
                *(value[f"rot_{j}"] for j in range(4)),
                *(math.exp(value[f"scale_{j}"]) for j in range(3)),
                0.0,
                *(int(min(max(v, 0), 255)) for v in rgba),
                *(value[f"motion_{j}"] for j in range(9)),
                0.0,
                *(value[f"omega_{j}"] for j in range(4)),
                value["trbf_center"],
                widths[i],
            )
        )
    return rows


SPLATV_ROW = struct.Struct("<3f4e3ee4B9ee4eee")


def encode_splatv(columns: Columns, *, texwidth: int = 16, padded: bool = False, **fields: object) -> bytes:
    """A splaTV file; with `padded` the whole texture is in it."""
    data = b"".join(SPLATV_ROW.pack(*row) for row in splatv_rows(columns))
    texheight = -(-len(data) // (16 * texwidth))
    size = 16 * texwidth * texheight
    chunk = {"type": "splat", "size": size, "texwidth": texwidth, "texheight": texheight, "cameras": []}
    header = json.dumps([chunk | fields]).encode()
    return struct.pack("<II", 0x674B, len(header)) + header + (data.ljust(size, b"\0") if padded else data)


def as_stored(columns: Columns) -> Columns:
    """What is left of the columns in a splaTV file: values of halves and bytes, scales no logarithms."""
    rows = [SPLATV_ROW.unpack(SPLATV_ROW.pack(*row)) for row in splatv_rows(columns)]
    names = [*"xyz", *(f"rot_{i}" for i in range(4)), *(f"scale_{i}" for i in range(3)), "zero"]
    names += [*(f"f_dc_{i}" for i in range(3)), "opacity", *(f"motion_{i}" for i in range(9)), "zero"]
    names += [*(f"omega_{i}" for i in range(4)), "trbf_center", "width"]
    return {
        name: np.array(values, np.float64)
        for name, values in zip(names, zip(*rows, strict=True), strict=True)
    }


def spacetime_at(columns: Columns, time: float) -> Moment:
    """The moment of a SpaceTimeGaussian PLY at a time of 0 to 1."""
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    widths = np.exp(c["trbf_scale"])
    scales = np.exp(np.stack([c[f"scale_{i}"] for i in range(3)], 1))
    return _moment(c, time, widths, scales, 1 / (1 + np.exp(-c["opacity"])), 1.0)


def splatv_at(columns: Columns, time: float) -> Moment:
    """The moment of a splaTV file of these columns at a time of 0 to 1."""
    c = as_stored(columns)
    scales = np.stack([c[f"scale_{i}"] for i in range(3)], 1)
    return _moment(c, time, c["width"], scales, c["opacity"] / 255, 255.0)


def _moment(
    c: Columns, time: float, widths: np.ndarray, scales: np.ndarray, opacities: np.ndarray, full: float
) -> Moment:
    since = time - c["trbf_center"]
    means = []
    for i, axis in enumerate("xyz"):
        first, second, third = (c[f"motion_{i + 3 * k}"] for k in range(3))
        means.append(c[axis] + first * since + second * since**2 + third * since**3)
    return {
        "means": np.stack(means, 1),
        "quats": np.stack([c[f"rot_{i}"] + c[f"omega_{i}"] * since for i in range(4)], 1),
        "scales": scales,
        "opacities": opacities * np.exp(-((since / widths) ** 2)),
        "sh": (np.stack([c[f"f_dc_{i}"] for i in range(3)], 1)[:, None] / full - 0.5) / C0,
    }


def freetime_at(columns: Columns, time: float, *, shortest: float = 0.02) -> Moment:
    """The moment of a FreeTimeGS PLY at a time of 0 to 1."""
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    since = time - c["time"]
    durations = np.maximum(np.exp(c["log_duration"]), shortest)
    rest = sum(name.startswith("f_rest_") for name in c) // 3
    dc = np.stack([c[f"f_dc_{i}"] for i in range(3)], 1)[:, None]
    bands = [np.stack([c[f"f_rest_{i * rest + k}"] for i in range(3)], 1)[:, None] for k in range(rest)]
    return {
        "means": np.stack([c[axis] + c[f"velocity_{i}"] * since for i, axis in enumerate("xyz")], 1),
        "quats": np.stack([c[f"rot_{i}"] for i in range(4)], 1),
        "scales": np.exp(np.stack([c[f"scale_{i}"] for i in range(3)], 1)),
        "opacities": 1 / (1 + np.exp(-c["opacity"])) * np.exp(-0.5 * (since / durations) ** 2),
        "sh": np.concatenate([dc, *bands], 1),
    }
