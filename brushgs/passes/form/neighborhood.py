"""The neighbors of each stroke, for smoothing directions, agreement of signs, and curvature."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.color.color_space import Space
from brushgs.passes.form.planes import Planes, blocks, unit_pairs
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

NUM_NEIGHBORS = 10
ROUNDS = 4
COLOR_SPREAD = 0.03  # squared difference of colors, CIELAB / 100, at which a neighbor counts 1/e
HALF_BEND = 0.03  # squared difference of normals, as sines, that counts half


@dataclass(frozen=True, eq=False)
class Neighborhood:
    """The neighbors of strokes, with weights.

    Attributes:
        rows: [n, k] the k nearest others.
        weights: [n, k] their weights, sum 1 or 0: more for neighbors of the same plane and color that are
            not smaller.
    """

    rows: NDArray[np.int32]
    weights: F64

    @classmethod
    def of(cls, planes: Planes, strokes: Gaussians) -> "Neighborhood":
        """The neighbors of strokes."""
        rows = np.empty((len(planes), max(0, min(NUM_NEIGHBORS, len(planes) - 1))), dtype=np.int32)
        _core.neighbors(planes.means, rows, num_threads_or_default(None))
        normals, colors = planes.axes[:, 2], Space("lab").to(base_colors(strokes.sh))
        units = np.where(planes.sizes > 0, planes.sizes, 1.0)[:, None]
        weights = np.empty(rows.shape)
        for some in blocks(len(planes)):
            others = rows[some]
            away = colors[others] - colors[some, None]
            with np.errstate(over="ignore"):
                shares = np.minimum(planes.sizes[others] / units[some], 1) ** 2
            shares *= np.einsum("nki,ni->nk", normals[others], normals[some]) ** 2
            weights[some] = shares * np.exp(-np.einsum("nki,nki->nk", away, away) / COLOR_SPREAD)
        totals = weights.sum(axis=1, keepdims=True)
        return cls(rows, weights / np.where(totals > 0, totals, 1.0))

    def smoothed(self, values: F64) -> F64:
        """Columns [n, c], repeatedly averaged with the mean of the neighbors."""
        for _ in range(ROUNDS):
            values = 0.5 * values + 0.5 * self.mean(values)
        return values

    def mean(self, values: F64) -> F64:
        """The weighted mean of the neighbors' columns [n, c]."""
        means = np.empty_like(values)
        for some in blocks(len(values)):
            means[some] = (self.weights[some, None] @ values[self.rows[some]])[:, 0]
        return means

    def agreed(self, directions: F64, headings: F64) -> F64:
        """Directions [n, 3], flipped to agree with their neighbors, starting from `headings` [n, 3].

        The stroke image runs from left to right along the longest axis, in the sign of the quaternion's
        matrix: the anchor direction of the lock.
        """
        for _ in range(ROUNDS):
            is_against = np.einsum("ni,ni->n", directions, headings) < 0
            directions = np.where(is_against[:, None], -directions, directions)
            headings = directions + self.mean(directions)
        return directions

    def least_curvature(self, planes: Planes) -> F64:
        """Pairs [n, 2] along which normals change least; weight 0 to 1, 1/2 at a spread of 10 degrees."""
        normals, moments = planes.axes[:, 2], np.empty((len(planes), 2, 2))
        for some in blocks(len(planes)):
            others, weights = normals[self.rows[some]], self.weights[some, None]
            facing = np.sign(np.einsum("nki,ni->nk", others, normals[some]))
            bends = (facing[:, :, None] * others) @ planes.axes[some, :2].transpose(0, 2, 1)
            bends -= weights @ bends
            moments[some] = (weights.transpose(0, 2, 1) * bends).transpose(0, 2, 1) @ bends
        most, bend = unit_pairs(np.stack([moments[:, 0, 0] - moments[:, 1, 1], 2 * moments[:, 0, 1]], axis=1))
        return -most * (bend / (bend + HALF_BEND))[:, None]
