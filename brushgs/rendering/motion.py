"""How strokes move: one rigid motion per stroke and moment, which all that is made of a stroke follows.

Strokes are made once, at a reference moment of each; a `StrokeMotion` then says of every stroke that moves
where it is at each moment, which way it has turned, how much larger, more opaque and lighter it is. Marks of
any coat have the id of the stroke that they were made of, and move with it.
"""

import tempfile
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F32, F64, Array, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized, quat_products, rotation_matrices
from brushgs.values.sh import C0

# What a row of a motion holds, 12 numbers: slices of its last axis.
SHIFT, TURN, SIZE, OPACITY, COLOR = slice(0, 3), slice(3, 7), 7, 8, slice(9, 12)
NUM_NUMBERS = 12
AT_REST = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
IN_MEMORY = 1 << 26  # bytes of a table; a larger one lies in a file, so that memory does not grow with time


@dataclass(frozen=True, eq=False)
class Pose:
    """Where strokes are at one moment.

    Attributes:
        ids: [M] int32, ascending: the strokes that move.
        pivots: [M, 3] float64: the points that they turn around, at their reference moments, world units.
        numbers: [M, 12] float32: `SHIFT` of the pivot, world units; `TURN` since the reference moment, a
            quaternion w, x, y, z; `SIZE`, the logarithm of the factor of lengths; `OPACITY`, a factor >= 0;
            `COLOR`, added to RGB, display-encoded.
    """

    ids: NDArray[np.int32]
    pivots: F64
    numbers: F32

    def moved(self, strokes: Gaussians, *, has_color: bool = True) -> Gaussians:
        """Strokes as they are at this moment; those that rest, or have no ids, as they were.

        Args:
            strokes: at their reference moments.
            has_color: whether they take part in changes of colour: marks in a colour of their own do not.
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

    def turned(self, strokes: Gaussians, normals: Array) -> Array:
        """Directions [N, 3] that are fixed to strokes, at this moment."""
        rows, found = match(strokes, self.ids)
        if len(rows) == 0:
            return normals
        normals = normals.copy()
        normals[rows] = np.einsum(
            "nij,nj->ni", rotation_matrices(self.numbers[found, TURN]), normals[rows].astype(np.float64)
        )
        return normals


@dataclass(frozen=True, eq=False)
class StrokeMotion:
    """How strokes move over a clip.

    Attributes:
        times: [T] seconds, ascending: the moments at which poses are known.
        ids: [M] see `Pose`.
        pivots: [M, 3] see `Pose`.
        table: [T, M, 12] float32, see `Pose`; quaternions of consecutive moments lie in one half of the
            sphere, so that those between are along the shorter way.
    """

    times: F64
    ids: NDArray[np.int32]
    pivots: F64
    table: F32

    def positions(self, times: F64) -> F64:
        """[n] where times lie among the moments, 0 to T - 1."""
        return np.asarray(np.interp(times, self.times, np.arange(len(self.times))))

    def pose(self, position: float) -> Pose:
        """Where strokes are at a moment, or between two.

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
    """The rows of strokes that move, and of each the row among the `ids` of a `StrokeMotion`."""
    if strokes.ids is None or len(ids) == 0:
        return np.arange(0), np.arange(0)
    found = np.minimum(np.searchsorted(ids, strokes.ids), len(ids) - 1)
    rows = np.flatnonzero(ids[found] == strokes.ids)
    return rows, found[rows]


def new_table(num_times: int, num_strokes: int) -> F32:
    """A table of a `StrokeMotion` in which nothing moves."""
    table: F32 = zeros_over_time((num_times, num_strokes, NUM_NUMBERS), np.float32)
    table[...] = AT_REST
    return table


def zeros_over_time(shape: tuple[int, ...], dtype: type[np.generic]) -> NDArray[Any]:
    """An array of zeros: in memory, or if it is large in a file that goes with it.

    So memory does not grow with the length of a clip.
    """
    if prod(shape) * np.dtype(dtype).itemsize <= IN_MEMORY:
        return np.zeros(shape, dtype)
    with tempfile.TemporaryFile() as file:  # which stays while it is mapped
        return np.memmap(file, dtype, "w+", shape=shape)
