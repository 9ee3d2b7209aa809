"""Small clips in the formats that are formulas, and their moments by float64 arithmetic.

Written apart from the readers: nothing here comes from brushgs.
"""

import json
import math
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.io.ply_maker import decoded, scene_columns, write_scene

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


FREETIME = "ftgs_version 1,time_units normalized,use_velocity 1,min_duration 0.02,n_frames 61"
FREETIME_COMMENTS = [f"comment {words}" for words in FREETIME.split(",")]


def write_freetime(path: Path, columns: Columns, comments: Sequence[str] = FREETIME_COMMENTS) -> Path:
    return write_scene(path, columns, comments=comments)


SPLATV = {"xyz": [*"xyz"], "rot": [f"rot_{i}" for i in range(4)], "motion": [f"motion_{i}" for i in range(9)]}
SPLATV |= {"omega": [f"omega_{i}" for i in range(4)], "center": ["trbf_center"]}
SPLATV_ROW = "<f4:xyz:3 <f2:rot:4 <f2:scale:3 <f2:_:1 u1:rgba:4"
SPLATV_ROW += " <f2:motion:9 <f2:__:1 <f2:omega:4 <f2:center:1 <f2:width:1"


def splatv_rows(columns: Columns) -> np.ndarray:
    """The rows of a splaTV file, of the columns of a SpaceTimeGaussian PLY."""
    parts = [part.split(":") for part in SPLATV_ROW.split()]
    rows = np.zeros(len(columns["x"]), [(name, kind, (int(count),)) for kind, name, count in parts])
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    for part, names in SPLATV.items():
        rows[part] = np.stack([c[name] for name in names], 1)
    rows["scale"] = np.exp(np.stack([c[f"scale_{i}"] for i in range(3)], 1))
    colors = [c[f"f_dc_{i}"] for i in range(3)]
    rows["rgba"] = np.clip(255 * np.stack([*colors, 1 / (1 + np.exp(-c["opacity"]))], 1), 0, 255)
    with np.errstate(over="ignore"):
        rows["width"][:, 0] = np.exp(columns["trbf_scale"])
    return rows


def encode_splatv(columns: Columns, *, texwidth: int = 16, padded: bool = False, **fields: object) -> bytes:
    """A splaTV file; with `padded` the whole texture is in it."""
    data = splatv_rows(columns).tobytes()
    texheight = -(-len(data) // (16 * texwidth))
    size = 16 * texwidth * texheight
    chunk = {"type": "splat", "size": size, "texwidth": texwidth, "texheight": texheight, "cameras": []}
    header = json.dumps([chunk | fields]).encode()
    return struct.pack("<II", 0x674B, len(header)) + header + (data.ljust(size, b"\0") if padded else data)


def spacetime_at(columns: Columns, time: float) -> Moment:
    """The moment of a SpaceTimeGaussian PLY at a time of 0 to 1."""
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    widths = np.exp(c["trbf_scale"])
    scales = np.exp(np.stack([c[f"scale_{i}"] for i in range(3)], 1))
    return _moment(c, time, widths, scales, 1 / (1 + np.exp(-c["opacity"])), 1.0)


def splatv_at(columns: Columns, time: float) -> Moment:
    """The moment of a splaTV file of these columns: of halves and bytes, scales no logarithms."""
    stored = splatv_rows(columns)
    rows = {name: stored[name].astype(np.float64) for name in stored.dtype.names}
    c = {name: rows[part][:, i] for part, names in SPLATV.items() for i, name in enumerate(names)}
    c |= {f"f_dc_{i}": rows["rgba"][:, i] for i in range(3)}
    return _moment(c, time, rows["width"][:, 0], rows["scale"], rows["rgba"][:, 3] / 255, 255.0)


def _moment(c: Columns, time: float, widths, scales, opacities, full: float) -> Moment:
    since, means = time - c["trbf_center"], [c[axis] for axis in "xyz"]
    for i in range(9):
        means[i % 3] = means[i % 3] + c[f"motion_{i}"] * since ** (i // 3 + 1)
    quats = np.stack([c[f"rot_{i}"] + c[f"omega_{i}"] * since for i in range(4)], 1)
    sh = (np.stack([c[f"f_dc_{i}"] for i in range(3)], 1)[:, None] / full - 0.5) / C0
    found = {"means": np.stack(means, 1), "quats": quats, "scales": scales, "sh": sh}
    return found | {"opacities": opacities * np.exp(-((since / widths) ** 2))}


def freetime_at(columns: Columns, time: float, *, shortest: float = 0.02) -> Moment:
    """The moment of a FreeTimeGS PLY at a time of 0 to 1."""
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    since = time - c["time"]
    durations = np.maximum(np.exp(c["log_duration"]), shortest)
    still = decoded(columns)
    velocities = np.stack([c[f"velocity_{i}"] for i in range(3)], 1)
    seen = np.exp(-0.5 * (since / durations) ** 2)
    moved = {"means": still["means"] + velocities * since[:, None], "opacities": still["opacities"] * seen}
    return still | moved
