"""Small PLY files made by the tests, with an encoder of its own: nothing here comes from brushgs."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.special import expit

LITTLE = "binary_little_endian"
NAMES = ("char", "uchar", "short", "ushort", "int", "uint", "float", "double")
FORMATS = dict(zip(NAMES, ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8"), strict=True))


def scene_columns(num_rows: int, degree: int = 0, seed: int = 0) -> dict[str, np.ndarray]:
    """Properties of a scene as a trainer writes them: name -> values, in the usual order."""
    rng = np.random.default_rng([20250612, seed])
    rest = 3 * ((degree + 1) ** 2 - 1)
    names = [*"xyz", "nx", "ny", "nz", *(f"f_dc_{i}" for i in range(3))]
    names += [f"f_rest_{i}" for i in range(rest)]
    names += ["opacity", *(f"scale_{i}" for i in range(3)), *(f"rot_{i}" for i in range(4))]
    columns = {name: rng.normal(size=num_rows).astype(np.float32) for name in names}
    for index in range(3):
        columns[f"scale_{index}"] -= 4
    return columns


def element_bytes(name, columns, encoding=LITTLE, types=None, count=None, newline="\n") -> tuple:
    """Header lines and data of one element; `types` overrides "float" by property."""
    types = types or {}
    kinds = [types.get(column, "float") for column in columns]
    num_rows = len(next(iter(columns.values()))) if columns else 0
    lines = [f"element {name} {num_rows if count is None else count}"]
    lines += [f"property {kind} {column}" for kind, column in zip(kinds, columns, strict=True)]
    header = "".join(line + newline for line in lines).encode()
    if encoding == "ascii":
        rows = zip(*(values.tolist() for values in columns.values()), strict=True)
        return header, "".join(" ".join(map(repr, row)) + newline for row in rows).encode()
    order = "<" if encoding == LITTLE else ">"
    dtype = [(column, order + FORMATS[kind]) for kind, column in zip(kinds, columns, strict=True)]
    table = np.empty(num_rows, dtype=dtype)
    for column, values in columns.items():
        table[column] = values
    return header, table.tobytes()


def write_ply_file(path, elements, encoding="binary_little_endian", comments=(), newline="\n") -> Path:
    """A PLY file of the elements given."""
    lines = ["ply", f"format {encoding} 1.0", *comments]
    head = "".join(line + newline for line in lines).encode() + b"".join(header for header, _ in elements)
    path.write_bytes(head + f"end_header{newline}".encode() + b"".join(data for _, data in elements))
    return path


def write_scene(path, columns, encoding=LITTLE, types=None, comments=(), newline="\n", count=None) -> Path:
    """A PLY file with one element `vertex`."""
    vertex = element_bytes("vertex", columns, encoding, types, count, newline)
    return write_ply_file(path, [vertex], encoding, comments, newline)


def decoded(columns: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """What the columns of a scene mean, in float64: the definition."""
    c = {name: values.astype(np.float64) for name, values in columns.items()}
    num_rest = sum(name.startswith("f_rest_") for name in c)
    colors = np.stack([c[f"f_dc_{i}"] for i in range(3)], 1)[:, None]
    channels = 3, num_rest // 3, len(c["x"])
    rest = np.reshape([c[f"f_rest_{i}"] for i in range(num_rest)], channels)
    means, quats = np.stack([c[axis] for axis in "xyz"], 1), np.stack([c[f"rot_{i}"] for i in range(4)], 1)
    scales, sh = np.stack([c[f"scale_{i}"] for i in range(3)], 1), np.concatenate([colors, rest.T], 1)
    found = {"means": means, "quats": quats, "scales": np.exp(scales), "sh": sh}
    return found | {"opacities": expit(c["opacity"])}
