"""Faults planted into scenes: columns of a file in, columns of a worse file out, and what must be found.

Columns are those of the file, by property: logs, logits, coefficients. Rows are appended or changed at random
places; equal seeds give equal files.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.passes.extent import robust_frame
from brushgs.values.sh import C0
from tests.io.ply_maker import write_scene

Columns = dict[str, np.ndarray]
SCALES, QUATS = [f"scale_{i}" for i in range(3)], [f"rot_{i}" for i in range(4)]
BASE = [f"f_dc_{i}" for i in range(3)]


@dataclass(frozen=True)
class Planted:
    """A file with a fault.

    Attributes:
        columns: all of it.
        rows: those that were changed or added, a mask; all True where the whole file is at fault.
        num_before: rows of the sound file.
    """

    columns: Columns
    rows: np.ndarray
    num_before: int


def columns_of(gaussians: bg.Gaussians, tmp: Path) -> Columns:
    """The columns that a scene has in a file."""
    bg.save(gaussians, tmp / "sound.ply")
    header, data = (tmp / "sound.ply").read_bytes().split(b"end_header\n", 1)
    names = [line.split()[2] for line in header.decode().splitlines() if line.startswith("property")]
    table = np.frombuffer(data, "<f4").reshape(-1, len(names))
    return {name: np.array(table[:, index]) for index, name in enumerate(names)}


def write(planted: Planted, path: Path) -> Path:
    """The file."""
    return write_scene(path, planted.columns)


def nothing(columns: Columns) -> Planted:
    return _whole(columns, {})


def linear_scales(columns: Columns) -> Planted:
    return _whole(columns, {name: np.exp(columns[name]) for name in SCALES})


def linear_opacities(columns: Columns) -> Planted:
    return _whole(columns, {"opacity": _sigmoid(columns["opacity"])})


def byte_opacities(columns: Columns) -> Planted:
    return _whole(columns, {"opacity": np.round(255 * _sigmoid(columns["opacity"]))})


def xyzw(columns: Columns) -> Planted:
    return _whole(columns, dict(zip(QUATS, [columns[QUATS[i]] for i in (1, 2, 3, 0)], strict=True)))


def linear_colors(columns: Columns) -> Planted:
    return _whole(columns, {name: np.clip(0.5 + C0 * columns[name], 0, 1) for name in BASE})


def byte_colors(columns: Columns) -> Planted:
    return _whole(columns, {name: np.round(255 * np.clip(0.5 + C0 * columns[name], 0, 1)) for name in BASE})


def unnormalised(columns: Columns) -> Planted:
    lengths = np.random.default_rng(1).uniform(0.4, 3, len(columns["x"]))
    return _whole(columns, {name: columns[name] * lengths for name in QUATS})


def dark(columns: Columns) -> Planted:
    return _whole(columns, {name: 0.02 * (columns[name] - 1.78) - 1.75 for name in BASE})


def bright(columns: Columns) -> Planted:
    """Colours four times as bright: those of a scene that was trained in linear light, or over-exposed."""
    return _whole(columns, {name: 4 * columns[name] + 1.5 / 0.28209479 for name in BASE})


def faint(columns: Columns) -> Planted:
    opacities = 0.05 * _sigmoid(columns["opacity"]).astype(np.float64)
    return _whole(columns, {"opacity": np.log(opacities / (1 - opacities))})


def faint_bands(columns: Columns) -> Planted:
    """Bands of degree 1 to 3 that hold next to nothing."""
    rng = np.random.default_rng(2)
    others = {name: values for name, values in columns.items() if not name.startswith("f_rest")}
    bands = {f"f_rest_{i}": rng.normal(0, 1e-4, len(columns["x"])) for i in range(45)}
    return _whole(others, bands)


def zero_bands(columns: Columns) -> Planted:
    others = {name: values for name, values in columns.items() if not name.startswith("f_rest")}
    return _whole(others, {f"f_rest_{i}": np.zeros(len(columns["x"])) for i in range(45)})


def broken(columns: Columns, share: float = 0.01) -> Planted:
    """NaN or infinity in one column of some rows, without which they cannot be drawn."""
    rng, rows = _some(columns, share, 3)
    new = {name: values.copy() for name, values in columns.items()}
    names = ["x", "y", "z", *QUATS, *BASE]
    for row in np.flatnonzero(rows):
        new[str(rng.choice(names))][row] = rng.choice([np.nan, np.inf, -np.inf])
    return Planted(new, rows, len(rows))


def unrotated(columns: Columns, share: float = 0.01) -> Planted:
    _, rows = _some(columns, share, 4)
    new = {name: np.where(rows, 0, columns[name]).astype(np.float32) for name in QUATS}
    return Planted(columns | new, rows, len(rows))


def copies(columns: Columns, share: float = 0.01) -> Planted:
    """Rows that stand a second time at the end."""
    _, rows = _some(columns, share, 5)
    return _appended(columns, {name: values[rows] for name, values in columns.items()})


def outliers(columns: Columns, share: float = 0.01) -> Planted:
    """Rows 100 to 1e7 radii away."""
    rng, rows = _some(columns, share, 6)
    added = {name: values[rows] for name, values in columns.items()}
    center, radius = _frame(columns)
    away = radius * 10 ** rng.uniform(2, 7, (rows.sum(), 1)) * _directions(rng, rows.sum())
    for axis, name in enumerate("xyz"):
        added[name] = center[axis] + away[:, axis]
    return _appended(columns, added)


def fillers(columns: Columns, share: float = 0.001) -> Planted:
    """Rows of 1.5 to 20 radii, somewhere in the scene."""
    rng, rows = _some(columns, share, 7)
    added = {name: values[rows] for name, values in columns.items()}
    _, radius = _frame(columns)
    for name in SCALES:
        added[name] = np.log(radius * rng.uniform(1.5, 20, rows.sum()))
    return _appended(columns, added)


def needles(columns: Columns, share: float = 0.01) -> Planted:
    """Rows 0.15 to 0.6 radii long, a thousandth as wide."""
    rng, rows = _some(columns, share, 8)
    added = {name: values[rows] for name, values in columns.items()}
    _, radius = _frame(columns)
    lengths = radius * rng.uniform(0.15, 0.6, rows.sum())
    for name, factor in zip(SCALES, (1.0, 1e-3, 1e-3), strict=True):
        added[name] = np.log(factor * lengths)
    return _appended(columns, added)


def floaters(columns: Columns, share: float = 0.01) -> Planted:
    """Gaussians of 0.3 to 4 % of the radius, of any opacity, colour and turn, evenly in a ball around."""
    rng, rows = _some(columns, share, 9)
    count = int(rows.sum())
    added = {name: values[rows] for name, values in columns.items()}
    center, radius = _frame(columns)
    places = 1.5 * radius * rng.uniform(0, 1, (count, 1)) ** (1 / 3) * _directions(rng, count)
    size = rng.uniform(np.log(0.003), np.log(0.04), count) + np.log(radius)
    opacities = rng.uniform(0.05, 0.99, count)
    for axis, name in enumerate("xyz"):
        added[name] = center[axis] + places[:, axis]
        added[SCALES[axis]] = size + rng.normal(0, 0.4, count)
        added[BASE[axis]] = rng.uniform(-1.5, 1.5, count)
    for name in QUATS:
        added[name] = rng.normal(size=count)
    for name in columns:
        if name.startswith("f_rest"):
            added[name] = np.zeros(count)
    added["opacity"] = np.log(opacities / (1 - opacities))
    return _appended(columns, added)


# Name of the finding -> how to plant it, and whether the rows may be few.
WHOLE: dict[str, list[Callable[[Columns], Planted]]] = {
    "linear-scales": [linear_scales],
    "linear-opacities": [linear_opacities],
    "byte-opacities": [byte_opacities],
    "xyzw-quaternions": [xyzw],
    "linear-colors": [linear_colors],
    "byte-colors": [byte_colors],
    "unnormalised-quaternions": [unnormalised],
    "all-dark": [dark],
    "all-faint": [faint],
    "over-bright": [bright],
    "empty-sh-bands": [faint_bands, zero_bands],
}
SOME: dict[str, Callable[[Columns, float], Planted]] = {
    "non-finite-rows": broken,
    "zero-quaternions": unrotated,
    "duplicate-rows": copies,
    "far-outliers": outliers,
    "screen-fillers": fillers,
    "needles": needles,
    "floaters": floaters,
}
FAULTS = {
    "linear-scales", "linear-opacities", "byte-opacities", "xyzw-quaternions", "linear-colors", "byte-colors",
    "non-finite-rows", "zero-quaternions",
}  # fmt: skip


def _whole(columns: Columns, new: Columns) -> Planted:
    changed = columns | {name: np.asarray(values, np.float32) for name, values in new.items()}
    count = len(columns["x"])
    return Planted(changed, np.ones(count, bool), count)


def _appended(columns: Columns, added: Columns) -> Planted:
    count, extra = len(columns["x"]), len(added["x"])
    whole = {
        name: np.concatenate([values, np.asarray(added[name], np.float32)])
        for name, values in columns.items()
    }
    return Planted(whole, np.arange(count + extra) >= count, count)


def _some(columns: Columns, share: float, seed: int) -> tuple[np.random.Generator, np.ndarray]:
    """A generator, and a mask of at least three rows."""
    rng = np.random.default_rng(seed)
    count = len(columns["x"])
    rows = np.zeros(count, bool)
    rows[rng.permutation(count)[: max(3, round(share * count))]] = True
    return rng, rows


def _frame(columns: Columns) -> tuple[np.ndarray, float]:
    return robust_frame(np.stack([columns[name] for name in "xyz"], 1))


def _directions(rng: np.random.Generator, count: int) -> np.ndarray:
    lines = rng.normal(size=(count, 3))
    return lines / np.linalg.norm(lines, axis=1, keepdims=True)


def _sigmoid(values: np.ndarray) -> np.ndarray:
    return (1 / (1 + np.exp(-values.astype(np.float64)))).astype(np.float32)
