"""Motion of strokes: one similarity transform per stroke and moment, with changes of opacity and color.

Strokes are made once, each at a reference moment. A `StrokeMotion` gives shift, turn, size, opacity and
color of every moving stroke at each moment. Marks of other coats have the id of the stroke they were made
of, and follow it.
"""

import tempfile
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, F64, Array, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import conjugates, normalized, quat_products, rotation_matrices
from brushgs.values.sh import C0

# The 12 numbers of a row: slices of the last axis.
SHIFT, TURN, SIZE, OPACITY, COLOR = slice(0, 3), slice(3, 7), 7, 8, slice(9, 12)
NUM_NUMBERS = 12
FAINT = 0.05  # least opacity factor that `at_rest` divides by
AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
IN_MEMORY = 1 << 26  # bytes; larger tables are stored in a file, so that memory does not grow with duration


@dataclass(frozen=True, eq=False)
class Pose:
    """Poses of strokes at one moment.

    Attributes:
        ids: [M] int32, ascending: the moving strokes.
        pivots: [M, 3] float64 centers of rotation at the reference moments, world units.
        numbers: [M, 12] float32: `SHIFT` of the pivot, world units; `TURN` since the reference moment, a
            quaternion w, x, y, z; `SIZE`, the logarithm of the factor of lengths; `OPACITY`, a factor >= 0;
            `COLOR`, added to RGB, display-encoded.
    """

    ids: NDArray[np.int32]
    pivots: F64
    numbers: F32

    def moved(self, strokes: Gaussians, *, has_color: bool = True) -> Gaussians:
        """Strokes at this moment; strokes that do not move, or have no ids, are unchanged.

        Args:
            strokes: at their reference moments.
            has_color: whether strokes follow color changes; False for marks with a color of their own.
        """
        rows, found = match(strokes, self.ids)
        if len(rows) == 0:
            return strokes
        numbers = self.numbers[found].astype(np.float64)
        columns = {name: column.copy() for name, column in strokes.columns().items()}
        size = np.exp(numbers[:, SIZE])[:, None]
        from_pivot = strokes.means[rows] - self.pivots[found]
        turned = np.einsum("nij,nj->ni", rotation_matrices(numbers[:, TURN]), from_pivot)
        columns["means"][rows] = self.pivots[found] + numbers[:, SHIFT] + size * turned
        columns["quats"][rows] = quat_products(numbers[:, TURN], strokes.quats[rows])
        columns["scales"][rows] *= size
        columns["opacities"][rows] = np.clip(strokes.opacities[rows] * numbers[:, OPACITY], 0, 1)
        if has_color:
            columns["sh"][rows, 0] += numbers[:, COLOR] / C0
        return replace(strokes, **columns)

    def at_rest(self, strokes: Gaussians) -> Gaussians:
        """Strokes at their reference moments, from strokes at this moment: the inverse of `moved`.

        Args:
            strokes: at this moment. Strokes with opacity 0 here keep opacity 0.
        """
        rows, found = match(strokes, self.ids)
        if len(rows) == 0:
            return strokes
        numbers = self.numbers[found].astype(np.float64)
        columns = {name: column.copy() for name, column in strokes.columns().items()}
        size, turns = np.exp(-numbers[:, SIZE])[:, None], conjugates(normalized(numbers[:, TURN]))
        away = strokes.means[rows] - self.pivots[found] - numbers[:, SHIFT]
        turned = np.einsum("nij,nj->ni", rotation_matrices(turns), away)
        columns["means"][rows] = self.pivots[found] + size * turned
        columns["quats"][rows] = quat_products(turns, strokes.quats[rows])
        columns["scales"][rows] *= size
        shown = np.maximum(numbers[:, OPACITY], FAINT)
        columns["opacities"][rows] = np.clip(strokes.opacities[rows] / shown, 0, 1)
        columns["sh"][rows, 0] -= numbers[:, COLOR] / C0
        return replace(strokes, **columns)

    def turned(self, strokes: Gaussians, normals: Array, *, is_back: bool = False) -> Array:
        """Directions [N, 3] fixed to strokes, at this moment; `is_back`: from this moment to rest."""
        rows, found = match(strokes, self.ids)
        if len(rows) == 0:
            return normals
        normals, turns = normals.copy(), rotation_matrices(self.numbers[found, TURN])
        turns = turns.transpose(0, 2, 1) if is_back else turns
        normals[rows] = np.einsum("nij,nj->ni", turns, normals[rows].astype(np.float64))
        return normals


@dataclass(frozen=True, eq=False)
class StrokeMotion:
    """Poses of strokes over a clip.

    Attributes:
        times: [T] seconds, ascending: moments of the poses.
        ids: [M] see `Pose`.
        pivots: [M, 3] see `Pose`.
        table: [T, M, 12] float32, see `Pose`; quaternions of consecutive moments have a dot product >= 0, so
            that interpolation takes the shorter way.
    """

    times: F64
    ids: NDArray[np.int32]
    pivots: F64
    table: F32

    def positions(self, times: F64) -> F64:
        """[n] positions of times among the moments, 0 to T - 1."""
        return np.asarray(np.interp(times, self.times, np.arange(len(self.times))))

    def pose(self, position: float) -> Pose:
        """The pose at a moment, or between two.

        Args:
            position: among the moments, 0 to T - 1: 2.5 is halfway from the third to the fourth.
        """
        before = min(max(int(position), 0), len(self.times) - 1)
        share = np.float32(position - before)
        numbers = np.array(self.table[before])
        if share > 0:
            numbers += share * (self.table[before + 1] - numbers)
            if len(numbers):
                numbers[:, TURN] = normalized(numbers[:, TURN])
        return Pose(self.ids, self.pivots, numbers)


def match(strokes: Gaussians, ids: NDArray[np.int32]) -> tuple[Rows, Rows]:
    """Rows of moving strokes, and for each its row in the `ids` of a `StrokeMotion`."""
    if strokes.ids is None or len(ids) == 0:
        return np.arange(0), np.arange(0)
    found = np.minimum(np.searchsorted(ids, strokes.ids), len(ids) - 1)
    rows = np.flatnonzero(ids[found] == strokes.ids)
    return rows, found[rows]


def new_table(num_times: int, num_strokes: int) -> F32:
    """A table of a `StrokeMotion` without motion."""
    table: F32 = zeros_over_time((num_times, num_strokes, NUM_NUMBERS), np.float32)
    table[...] = AT_REST
    return table


def zeros_over_time(shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """An array of zeros, in memory or, if large, in a temporary file that lives as long."""
    if prod(shape) * np.dtype(dtype).itemsize <= IN_MEMORY:
        return np.zeros(shape, dtype)
    with tempfile.TemporaryFile() as file:  # lives while it is mapped
        return np.memmap(file, dtype, "w+", shape=shape)
