"""Small clips of a file a moment."""

from pathlib import Path

import numpy as np

from tests.io.ply_maker import scene_columns, write_scene

Columns = dict[str, np.ndarray]


def columns_at(moment: float, num_rows: int = 200, seed: int = 0) -> Columns:
    """A thing that moves to the right, turns about z, and fades, while its colors and sizes stay."""
    columns = scene_columns(num_rows, seed=seed)
    columns["x"] = (columns["x"] + 0.05 * moment).astype(np.float32)
    columns["opacity"] = (columns["opacity"] + 0.1 * moment).astype(np.float32)
    cos, sin = np.cos(0.1 * moment), np.sin(0.1 * moment)
    quats = np.stack([columns[f"rot_{i}"] for i in range(4)])
    turned = cos * quats + sin * np.array([[-1], [-1], [1], [1]]) * quats[::-1]
    return columns | {f"rot_{i}": values.astype(np.float32) for i, values in enumerate(turned)}


def shuffled(columns: Columns, seed: int, dropped: float = 0.0) -> Columns:
    """The same Gaussians in another order, without a share of them."""
    num_rows = len(columns["x"])
    rows = np.random.default_rng([20261122, seed]).permutation(num_rows)[round(dropped * num_rows) :]
    return {name: values[rows] for name, values in columns.items()}


def write_frames(folder, moments, name="frame_{:03}.ply", columns=columns_at, comments=()) -> list[Path]:
    """A file for each moment, numbered by its place in the list."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name.format(index) for index in range(len(moments))]
    rows = zip(paths, moments, strict=True)
    return [write_scene(path, columns(moment), comments=comments) for path, moment in rows]
