"""A made landscape of any number of Gaussians, written as a PLY file block by block."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

BLOCK = 1 << 18
NAMES = ("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity")
NAMES += ("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3")
SIDE = 20.0  # of the landscape, world units
LAYERS = 3.0  # of Gaussians on the ground, if these are half as wide as their scales are long


def write_landscape(path: Path, num_rows: int, *, num_rest: int = 0) -> None:
    """Hills with fields and stones: `num_rest` f_rest properties of small noise; z is up."""
    names = (*NAMES[:9], *(f"f_rest_{index}" for index in range(num_rest)), *NAMES[9:])
    lines = "".join(f"property float {name}\n" for name in names)
    begin = "ply\nformat binary_little_endian 1.0\ncomment vertical axis: z\n"
    with path.open("wb") as file:
        file.write(f"{begin}element vertex {num_rows}\n{lines}end_header\n".encode())
        for start in range(0, num_rows, BLOCK):
            rows = landscape_rows(min(BLOCK, num_rows - start), num_rows, num_rest, seed=start)
            file.write(rows.tobytes())


def landscape_rows(count: int, num_rows: int, num_rest: int, *, seed: int) -> NDArray[np.float32]:
    """[count, 17 + num_rest] rows anywhere in a landscape of `num_rows`, as the file has them."""
    rng = np.random.default_rng([20261123, seed])
    x, y = rng.uniform(-SIDE / 2, SIDE / 2, (2, count))
    height = np.sin(0.7 * x) * np.cos(0.5 * y) + 0.15 * np.sin(3 * x + 1) * np.sin(4 * y)
    fields = np.floor(1.5 * x) + 7 * np.floor(1.1 * y)
    color = 0.5 + 0.35 * np.stack([np.sin(fields * step) for step in (1.7, 2.3, 3.1)], axis=1)
    stones = np.sin(9 * x) * np.sin(8 * y + x) > 0.93
    height[stones] += 0.3 * rng.random(int(stones.sum()))
    color[stones] = 0.8
    spacing = SIDE / np.sqrt(num_rows / LAYERS)
    logs = np.log(0.5 * spacing) + rng.normal(0, 0.6, (count, 3))
    logs[:, 2] -= 1.5
    rest = 0.02 * rng.standard_normal((count, num_rest))
    columns = [
        np.stack([x, y, height + spacing * rng.normal(0, 0.3, count)], axis=1),
        np.zeros((count, 3)),
        (color + rng.normal(0, 0.05, (count, 3)) - 0.5) / 0.28209479177387814,
        rest,
        rng.normal(1, 2, (count, 1)),
        logs,
        np.array([1, 0, 0, 0]) + 0.2 * rng.standard_normal((count, 4)),
    ]
    return np.concatenate(columns, axis=1).astype(np.float32)
