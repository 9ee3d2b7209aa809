"""The plane of each stroke, and directions in it.

A direction without sign, at an angle t from the long axis of a stroke, is the pair w (cos 2t, sin 2t) with
weight w: pairs can be added, and perpendicular directions cancel. Between different planes it is the tensor w
d d^T in space, of which six numbers are kept.
"""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

_ROWS, _COLUMNS = np.array([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]).T  # of the six numbers
_TIMES = np.where(_ROWS == _COLUMNS, 1.0, 2.0)  # how often each occurs in the matrix


@dataclass(frozen=True, eq=False)
class Planes:
    """The planes of n strokes, perpendicular to their shortest axes.

    Attributes:
        means: [n, 3] centers, world units.
        order: [n, 3] columns of the longest, middle and shortest axis in the rotation matrices.
        axes: [n, 3, 3] these unit axes as rows, in that order: the last is the normal.
        scales: [n, 3] standard deviations in that order, world units.
        sizes: [n] geometric mean of the first two.
        aspects: [n] their ratio, >= 1: infinite where the second is 0, 1 where both are.
    """

    means: F64
    order: NDArray[np.intp]
    axes: F64
    scales: F64
    sizes: F64
    aspects: F64

    @classmethod
    def of(cls, strokes: Gaussians) -> "Planes":
        """The planes of strokes."""
        rotations = rotation_matrices(strokes.quats)
        order = np.argsort(-strokes.scales, axis=1, kind="stable")  # of equal ones the first, as `project`
        axes = np.take_along_axis(rotations.transpose(0, 2, 1), order[:, :, None], axis=1)
        scales = np.take_along_axis(strokes.scales.astype(np.float64), order, axis=1)
        longest, middle = scales[:, 0], scales[:, 1]
        aspects = np.where(longest > 0, np.inf, 1.0)
        with np.errstate(over="ignore"):
            np.divide(longest, middle, out=aspects, where=middle > 0)
        sizes = np.sqrt(longest) * np.sqrt(middle)
        return cls(strokes.means.astype(np.float64), order, axes, scales, sizes, aspects)

    def __len__(self) -> int:
        return len(self.means)

    def take(self, rows: slice) -> "Planes":
        """The planes of some of the strokes."""
        return Planes(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

    def project(self, vectors: F64) -> F64:
        """Coordinates [n, 2] of vectors in space [n, 3], along the long axis and across it."""
        return np.asarray(np.einsum("nij,nj->ni", self.axes[:, :2], vectors))

    def lift(self, pairs: F64, weights: F64) -> F64:
        """The tensors in space, [n, 6], of sums of directions: their pairs [n, 2] and weights [n]."""
        along, across = self.axes[:, 0], self.axes[:, 1]
        first = 0.5 * (weights + pairs[:, 0])[:, None] * along + 0.5 * pairs[:, 1:] * across
        second = 0.5 * (weights - pairs[:, 0])[:, None] * across + 0.5 * pairs[:, 1:] * along
        return np.asarray(first[:, _ROWS] * along[:, _COLUMNS] + second[:, _ROWS] * across[:, _COLUMNS])

    def lower(self, tensors: F64) -> tuple[F64, F64]:
        """The components of tensors in space [n, 6] within the planes, as pairs [n, 2] and weights [n]."""
        along, across = self.axes[:, 0], self.axes[:, 1]
        parts = tensors * _TIMES
        xx = np.einsum("nk,nk,nk->n", parts, along[:, _ROWS], along[:, _COLUMNS])
        yy = np.einsum("nk,nk,nk->n", parts, across[:, _ROWS], across[:, _COLUMNS])
        mixed = along[:, _ROWS] * across[:, _COLUMNS] + across[:, _ROWS] * along[:, _COLUMNS]
        return np.stack([xx - yy, np.einsum("nk,nk->n", parts, mixed)], axis=1), xx + yy


@dataclass(frozen=True, eq=False)
class Wish:
    """The directions that the user requests for n strokes.

    Attributes:
        pairs: [n, 2] directions in the planes of the strokes; weight 0 to 1, 0 for none.
        headings: [n, 3] directions with sign, any length; 0 for none.
    """

    pairs: F64
    headings: F64


def pairs_of(vectors: F64) -> F64:
    """Pairs [n, 2] of directions in a plane [n, 2]; their weights are the squared lengths."""
    x, y = vectors.T
    return np.stack([x * x - y * y, 2 * x * y], axis=1)


def unit_pairs(pairs: F64) -> tuple[F64, F64]:
    """Pairs [n, 2] of weight 1, and their former weights [n]; (0, 0) stays."""
    lengths = np.hypot(pairs[:, 0], pairs[:, 1])
    return pairs / np.where(lengths > 0, lengths, 1.0)[:, None], lengths


def ramp(values: F64, low: float, high: float) -> F64:
    """0 up to `low`, 1 from `high` on, linear in between."""
    return np.clip((values - low) / (high - low), 0.0, 1.0)
