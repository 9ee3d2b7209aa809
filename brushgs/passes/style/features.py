"""Features of strokes that mean the same in every scene.

Colors are taken as they are. Lengths are shares of the subject's size, stroke sizes are ranks, and directions
are relative to up: so features do not depend on the unit of a scene, its position, or its rotation about up.
All features but color are bounded: beyond a limit of distance, height or gloss, strokes count as at the
limit.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.color.color_space import Space
from brushgs.passes.reduce.contribution import projected_areas, visible_shares
from brushgs.values.arrays import F64, Rows
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices
from brushgs.values.sh import C0, used_sh_degree

NUM_NEIGHBORS = 8
ROWS_AT_A_TIME = 1 << 15  # limits the memory for neighbors
LOWEST, HIGHEST = -0.5, 1.5  # in heights of the subject: strokes beyond count as at the limit
FARTHEST = 3.0  # radii of the subject
FLATTEST = 1e-3  # least height of a subject, in its radii
MOST_GLOSS = 2.0  # trained scenes have up to 1, rarely more
COLOR_FEATURES = ("lightness", "green_red", "blue_yellow")


@dataclass(frozen=True, eq=False)
class StrokeFeatures:
    """Features of strokes by name.

    Attributes:
        names: of the F features.
        values: [N, F] finite.
    """

    names: tuple[str, ...]
    values: F64

    def __len__(self) -> int:
        return len(self.values)

    def take(self, rows: Rows | slice | NDArray[np.bool_]) -> "StrokeFeatures":
        """The features of some strokes."""
        return StrokeFeatures(self.names, self.values[rows])

    def columns(self, names: tuple[str, ...]) -> F64:
        """[N, len(names)] the named features, in this order.

        Raises:
            KeyError: if a name is unknown.
        """
        row_of = {name: row for row, name in enumerate(self.names)}
        return self.values[:, [row_of[name] for name in names]]


def color_features(rgb: F64) -> F64:
    """[N, 3] features of display-encoded colors [N, 3] alone: CIELAB divided by 100.

    Unlike in OKLab the slope is bounded at black, so view-dependent terms of dark strokes stay small.
    """
    return Space("lab").to(rgb)


def stroke_features(
    strokes: Gaussians, first_view: FirstView, names: Sequence[str] | None = None
) -> StrokeFeatures:
    """Compute features of strokes, or of the Gaussians of a scene.

    Args:
        strokes: N strokes.
        first_view: of their scene; its up axis and its subject are used.
        names: of the features, see `FEATURES`; only what these need is computed. None for all.

    Raises:
        ValueError: if a name is unknown.
    """
    chosen = tuple(FEATURES) if names is None else tuple(names)
    if unknown := [name for name in chosen if name not in FEATURES]:
        raise ValueError(f"stroke_features: names must be of {', '.join(FEATURES)}, got {unknown[0]!r}")
    context = _Context(strokes, first_view)
    values = np.empty((len(strokes), len(chosen)))
    for column, name in enumerate(chosen):
        values[:, column] = FEATURES[name](context) if len(strokes) else 0.0
    return StrokeFeatures(chosen, values)


@dataclass(frozen=True, eq=False)
class _Context:
    """Intermediate values shared by features, each computed once, when first needed."""

    strokes: Gaussians
    first_view: FirstView

    @cached_property
    def lab(self) -> F64:
        return color_features(0.5 + C0 * self.strokes.sh[:, 0].astype(np.float64))

    @cached_property
    def order(self) -> NDArray[np.intp]:
        return np.argsort(-self.strokes.scales, axis=1, kind="stable")

    @cached_property
    def scales(self) -> F64:
        """[N, 3] scales, descending and > 0 so that ratios exist, relative to the largest of all."""
        sorted_scales = np.take_along_axis(self.strokes.scales, self.order, axis=1).astype(np.float64)
        largest = max(float(sorted_scales.max()), np.finfo(np.float64).tiny)
        return np.maximum(sorted_scales / largest, 1e-12)

    @cached_property
    def normals(self) -> F64:
        """[N, 3] the shortest axes, of arbitrary sign."""
        rotations = rotation_matrices(self.strokes.quats)
        return np.take_along_axis(rotations, self.order[:, None, 2:], axis=2)[..., 0]

    @cached_property
    def neighbors(self) -> NDArray[np.int32]:
        count = max(0, min(NUM_NEIGHBORS, len(self.strokes) - 1))
        rows = np.empty((len(self.strokes), count), dtype=np.int32)
        if count:
            means = np.ascontiguousarray(self.strokes.means, dtype=np.float64)
            _core.neighbors(means, rows, num_threads_or_default(None))
        return rows

    @cached_property
    def subject(self) -> tuple[F64, float, float, float]:
        """Center [3] and radius of the subject, and its lower and upper end along up."""
        points = self.first_view.points
        heights = points @ self.first_view.up
        low, high = float(heights.min()), float(heights.max())
        center = points.mean(axis=0)
        radius = float(np.linalg.norm(points - center, axis=1).max())
        radius = max(radius, 1e-9 * float(np.abs(points).max())) or 1.0  # for a single point
        return center, radius, low, max(high, low + FLATTEST * radius)

    def of_neighbors(self, measure: Callable[[slice, NDArray[np.int32]], F64]) -> F64:
        """[N] a measure of strokes and their neighbors, computed block by block; 0 without neighbors."""
        found = np.zeros(len(self.strokes))
        if self.neighbors.shape[1]:
            for first in range(0, len(found), ROWS_AT_A_TIME):
                some = slice(first, first + ROWS_AT_A_TIME)
                found[some] = measure(some, self.neighbors[some])
        return found


def _gloss(context: _Context) -> F64:
    """View dependence of the color: root of the sum of squares of the view-dependent terms."""
    sh = context.strokes.sh
    if used_sh_degree(context.strokes) == 0:
        return np.zeros(len(sh))
    squares = np.einsum("nkc,nkc->n", sh[:, 1:], sh[:, 1:], dtype=np.float64)
    return np.asarray(np.minimum(np.sqrt(squares), MOST_GLOSS))


def _size(context: _Context) -> F64:
    """Rank of the size by painted area: the share of smaller strokes, plus half of equal ones, 0 to 1."""
    sizes = context.scales[:, 0] * context.scales[:, 1]
    areas = context.strokes.opacities * projected_areas(context.scales)
    if not areas.sum() > 0:
        areas = np.ones(len(sizes))
    _, which = np.unique(sizes, return_inverse=True)  # ascending
    totals = np.bincount(which, areas)
    return np.asarray(((np.cumsum(totals) - 0.5 * totals) / totals.sum())[which])


def _bend(context: _Context) -> F64:
    """Mean squared sine of the angles between a stroke's normal and its neighbors', 0 (flat) to 1."""
    normals = context.normals

    def measure(some: slice, rows: NDArray[np.int32]) -> F64:
        cosines = np.einsum("nki,ni->nk", normals[rows], normals[some])
        return np.asarray(1 - np.minimum((cosines**2).mean(axis=1), 1))

    return context.of_neighbors(measure)


def _contrast(context: _Context) -> F64:
    """Root mean squared color difference from the neighbors, CIELAB over 100, at most 1."""
    lab = context.lab

    def measure(some: slice, rows: NDArray[np.int32]) -> F64:
        away = lab[rows] - lab[some, None]
        return np.asarray(np.minimum(np.sqrt(np.einsum("nki,nki->n", away, away) / rows.shape[1]), 1))

    return context.of_neighbors(measure)


def _height(context: _Context) -> F64:
    """Height above the foot of the subject, in its heights: 0 on the ground, 1 at its top."""
    _, _, low, high = context.subject
    heights = context.strokes.means.astype(np.float64) @ context.first_view.up
    return np.asarray(np.clip((heights - low) / (high - low), LOWEST, HIGHEST))


def _distance(context: _Context) -> F64:
    """Distance from the middle of the subject, in its radii."""
    center, radius, _, _ = context.subject
    away = np.linalg.norm(context.strokes.means - center, axis=1)
    return np.asarray(np.minimum(away / radius, FARTHEST))


def _visible(context: _Context) -> F64:
    """Share of directions from which a stroke is visible, 0 to 1."""
    return visible_shares(replace(context.strokes, sh=context.strokes.sh[:, :1]))


FEATURES: dict[str, Callable[[_Context], F64]] = {
    "lightness": lambda context: context.lab[:, 0],
    "green_red": lambda context: context.lab[:, 1],
    "blue_yellow": lambda context: context.lab[:, 2],
    "gloss": _gloss,
    "size": _size,
    "elongation": lambda context: 1 - context.scales[:, 1] / context.scales[:, 0],
    "flatness": lambda context: 1 - context.scales[:, 2] / context.scales[:, 1],
    "level": lambda context: np.minimum(np.abs(context.normals @ context.first_view.up), 1),
    "bend": _bend,
    "height": _height,
    "distance": _distance,
    "visible": _visible,
    "contrast": _contrast,
}
