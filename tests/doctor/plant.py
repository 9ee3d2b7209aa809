"""Faults planted into scenes: columns of a file in, columns of a worse file out, and what must be found.

Columns are those of the file, by property: logs, logits, coefficients. Rows are appended or changed at random
places; equal seeds give equal files.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import expit, logit

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
    """

    columns: Columns
    rows: np.ndarray


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


def _each(names: list[str], change: Callable) -> Callable[[Columns], Planted]:
    """The same change of several columns."""
    return lambda columns: _whole(columns, {name: change(columns[name]) for name in names})


def _sigmoid(values: np.ndarray) -> np.ndarray:
    return expit(values.astype(np.float64))


def _rgb(values: np.ndarray) -> np.ndarray:
    return np.clip(0.5 + C0 * values, 0, 1)


linear_scales = _each(SCALES, np.exp)
linear_opacities = _each(["opacity"], _sigmoid)
byte_opacities = _each(["opacity"], lambda logits: np.round(255 * _sigmoid(logits)))
linear_colors = _each(BASE, _rgb)
byte_colors = _each(BASE, lambda values: np.round(255 * _rgb(values)))
dark = _each(BASE, lambda values: 0.02 * (values - 1.78) - 1.75)
# Four times as bright: colors of a scene that was trained in linear light, or over-exposed.
bright = _each(BASE, lambda values: 4 * values + 1.5 / C0)
faint = _each(["opacity"], lambda logits: logit(0.05 * _sigmoid(logits)))


def xyzw(columns: Columns) -> Planted:
    return _whole(columns, dict(zip(QUATS, [columns[QUATS[i]] for i in (1, 2, 3, 0)], strict=True)))


def unnormalised(columns: Columns) -> Planted:
    lengths = np.random.default_rng(1).uniform(0.4, 3, len(columns["x"]))
    return _whole(columns, {name: columns[name] * lengths for name in QUATS})


def faint_bands(columns: Columns, size: float = 1e-4) -> Planted:
    """Bands of degree 1 to 3 that hold next to nothing."""
    rng = np.random.default_rng(2)
    others = {name: values for name, values in columns.items() if not name.startswith("f_rest")}
    return _whole(others, {f"f_rest_{i}": rng.normal(0, size, len(columns["x"])) for i in range(45)})


def zero_bands(columns: Columns) -> Planted:
    return faint_bands(columns, 0.0)


def broken(columns: Columns, share: float = 0.01) -> Planted:
    """NaN or infinity in one column of some rows, without which they cannot be drawn."""
    rng, rows = _some(columns, share, 3)
    new = {name: values.copy() for name, values in columns.items()}
    names = ["x", "y", "z", *QUATS, *BASE]
    for row in np.flatnonzero(rows):
        new[str(rng.choice(names))][row] = rng.choice([np.nan, np.inf, -np.inf])
    return Planted(new, rows)


def unrotated(columns: Columns, share: float = 0.01) -> Planted:
    _, rows = _some(columns, share, 4)
    new = {name: np.where(rows, 0, columns[name]).astype(np.float32) for name in QUATS}
    return Planted(columns | new, rows)


def copies(columns: Columns, share: float = 0.01) -> Planted:
    """Rows that stand a second time at the end."""
    return _appended(columns, _copied(columns, share, 5)[1])


def outliers(columns: Columns, share: float = 0.01) -> Planted:
    """Rows 100 to 1e7 radii away."""
    rng, added, center, radius = _copied(columns, share, 6)
    count = len(added["x"])
    away = radius * 10 ** rng.uniform(2, 7, (count, 1)) * _directions(rng, count)
    for axis, name in enumerate("xyz"):
        added[name] = center[axis] + away[:, axis]
    return _appended(columns, added)


def fillers(columns: Columns, share: float = 0.001) -> Planted:
    """Rows of 1.5 to 20 radii, somewhere in the scene."""
    rng, added, _, radius = _copied(columns, share, 7)
    for name in SCALES:
        added[name] = np.log(radius * rng.uniform(1.5, 20, len(added["x"])))
    return _appended(columns, added)


def needles(columns: Columns, share: float = 0.01) -> Planted:
    """Rows 0.15 to 0.6 radii long, a thousandth as wide."""
    rng, added, _, radius = _copied(columns, share, 8)
    lengths = radius * rng.uniform(0.15, 0.6, len(added["x"]))
    for name, factor in zip(SCALES, (1.0, 1e-3, 1e-3), strict=True):
        added[name] = np.log(factor * lengths)
    return _appended(columns, added)


def floaters(columns: Columns, share: float = 0.01) -> Planted:
    """Gaussians of 0.3 to 4 % of the radius, of any opacity, color and turn, evenly in a ball around."""
    rng, added, center, radius = _copied(columns, share, 9)
    count = len(added["x"])
    places = 1.5 * radius * rng.uniform(0, 1, (count, 1)) ** (1 / 3) * _directions(rng, count)
    size = rng.uniform(np.log(0.003), np.log(0.04), count) + np.log(radius)
    opacities = rng.uniform(0.05, 0.99, count)
    for axis, name in enumerate("xyz"):
        added[name] = center[axis] + places[:, axis]
        added[SCALES[axis]] = size + rng.normal(0, 0.4, count)
        added[BASE[axis]] = rng.uniform(-1.5, 1.5, count)
    added |= {name: rng.normal(size=count) for name in QUATS}
    added |= {name: np.zeros(count) for name in columns if name.startswith("f_rest")}
    added["opacity"] = logit(opacities)
    return _appended(columns, added)


# Name of the finding -> how to plant it, and whether the rows may be few.
WHOLE: dict[str, list[Callable[[Columns], Planted]]] = {  # other encodings first
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
FAULTS = {*list(WHOLE)[:6], "non-finite-rows", "zero-quaternions"}  # of encodings, and rows without a place


def _whole(columns: Columns, new: Columns) -> Planted:
    changed = columns | {name: np.asarray(values, np.float32) for name, values in new.items()}
    return Planted(changed, np.ones(len(columns["x"]), bool))


def _appended(columns: Columns, added: Columns) -> Planted:
    count, extra = len(columns["x"]), len(added["x"])
    whole = {name: np.append(values, np.float32(added[name])) for name, values in columns.items()}
    return Planted(whole, np.arange(count + extra) >= count)


def _some(columns: Columns, share: float, seed: int) -> tuple[np.random.Generator, np.ndarray]:
    """A generator, and a mask of at least three rows."""
    rng = np.random.default_rng(seed)
    count = len(columns["x"])
    rows = np.zeros(count, bool)
    rows[rng.permutation(count)[: max(3, round(share * count))]] = True
    return rng, rows


def _copied(columns: Columns, share: float, seed: int) -> tuple:
    """A generator, copies of some rows, and the center and the radius of the scene."""
    rng, rows = _some(columns, share, seed)
    frame = robust_frame(np.stack([columns[name] for name in "xyz"], 1))
    return rng, {name: values[rows] for name, values in columns.items()}, *frame


def _directions(rng: np.random.Generator, count: int) -> np.ndarray:
    lines = rng.normal(size=(count, 3))
    return lines / np.linalg.norm(lines, axis=1, keepdims=True)
