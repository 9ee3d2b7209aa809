"""Nested partitions of points by halving the worst cells: a fast estimate of k-means at many counts.

One pass gives all counts, while k-means needs a run for each, and takes a fifth of the time of one k-means.
The error of strokes merged from its cells equals that of k-means at 0.5 to 1.6 times the count, in the median
0.9 (four real scenes, two strokes).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.values.arrays import Rows, check

NEAR_WORST = 0.25  # of the largest inertia: cells above it are halved in one round


class _Moments(NamedTuple):
    """Moments of each cell: inertia, the axis of largest variance, and the mean along that axis."""

    inertia: NDArray[np.float64]
    axis: Rows
    mean: NDArray[np.float64]


def halve(
    points: NDArray[np.float32], weights: NDArray[np.float64], counts: Sequence[int]
) -> list[NDArray[np.int32]]:
    """Labels of nested partitions, one for each count.

    In each round the cells of largest inertia (sum of weight x squared distance to the weighted mean) are
    split at their mean, perpendicular to the axis of largest variance.
    Source: Wan, Wong and Prusinkiewicz 1988, An algorithm for multidimensional data clustering.

    Args:
        points: [N, D].
        weights: [N], > 0.
        counts: ascending, >= 1.

    Returns:
        For each count [N] labels from 0 on, each in use: as many cells as the count, or fewer if there are
        fewer distinct points. Each cell lies within one cell of every coarser partition.

    Raises:
        ValueError: if shapes differ or counts do not ascend from 1 on.
    """
    check("halve", points=(points, "N D"), weights=(weights, "N"))
    if any(low > high for low, high in zip([1, *counts], counts, strict=False)):
        raise ValueError(f"halve: counts must ascend from 1 or more, got {list(counts)}")
    num = len(points)
    columns = np.ascontiguousarray(points.T, dtype=np.float64)
    columns -= columns.mean(axis=1, keepdims=True)  # against cancellation in sums of squares
    order, starts = np.arange(num), np.zeros(1, dtype=np.intp)  # rows cell by cell, and the starts of cells
    moments = _moments_of(columns, weights, starts, np.array([num]))
    found = []
    for count in counts:
        while len(starts) < count and moments.inertia.max() > 0:
            starts, moments = _round(columns, weights, order, starts, moments, count - len(starts))
        labels = np.empty(num, dtype=np.int32)
        labels[order] = np.repeat(np.arange(len(starts), dtype=np.int32), _lengths(starts, num))
        found.append(labels)
    return found


def _round(
    columns: NDArray[np.float64],
    weights: NDArray[np.float64],
    order: Rows,
    starts: Rows,
    moments: _Moments,
    most: int,
) -> tuple[Rows, _Moments]:
    """Halve the worst cells, `most` at most; changes `order` in place."""
    picked = np.flatnonzero(moments.inertia > NEAR_WORST * moments.inertia.max())
    if len(picked) > most:
        picked = np.sort(picked[np.argsort(-moments.inertia[picked], kind="stable")[:most]])
    begins, lengths = starts[picked], _lengths(starts, len(order))[picked]
    places, rank = _ranges(begins, lengths)
    rows = order[places]
    axis, mean = np.repeat(moments.axis[picked], lengths), np.repeat(moments.mean[picked], lengths)
    is_high = columns[axis, rows] > mean
    num_high = np.add.reduceat(is_high.astype(np.intp), _begins(lengths))
    to_low = rank < np.repeat(lengths - num_high, lengths)
    order[places[to_low]], order[places[~to_low]] = rows[~is_high], rows[is_high]
    is_split = (num_high > 0) & (num_high < lengths)  # rounding may leave a half empty
    moments.inertia[picked[~is_split]] = 0.0
    fresh = (begins + lengths - num_high)[is_split]
    arranged = np.argsort(np.concatenate([starts, fresh]), kind="stable")
    starts = np.concatenate([starts, fresh])[arranged]
    grown = _Moments(*(np.concatenate([one, np.zeros(len(fresh), one.dtype)])[arranged] for one in moments))
    halves = np.searchsorted(starts, np.sort(np.concatenate([begins[is_split], fresh])))
    if len(halves):
        lengths = _lengths(starts, len(order))[halves]
        rows = order[_ranges(starts[halves], lengths)[0]]
        measured = _moments_of(columns[:, rows], weights[rows], _begins(lengths), lengths)
        for one, news in zip(grown, measured, strict=True):
            one[halves] = news
    return starts, grown


def _moments_of(
    columns: NDArray[np.float64], weights: NDArray[np.float64], begins: Rows, lengths: Rows
) -> _Moments:
    mass = np.add.reduceat(weights, begins)
    means, squares = np.empty((2, len(columns), len(begins)))
    for i, column in enumerate(columns):
        weighted = weights * column
        means[i] = np.add.reduceat(weighted, begins) / mass
        squares[i] = np.add.reduceat(weighted * column, begins) - mass * means[i] ** 2
    axis = np.argmax(squares, axis=0)
    inertia = np.where(lengths > 1, np.maximum(squares, 0.0).sum(axis=0), 0.0)
    return _Moments(inertia, axis, means[axis, np.arange(len(begins))])


def _lengths(starts: Rows, num: int) -> Rows:
    return np.diff(starts, append=num)


def _begins(lengths: Rows) -> Rows:
    """The starts of consecutive runs of these lengths."""
    return np.asarray(np.cumsum(lengths) - lengths)


def _ranges(begins: Rows, lengths: Rows) -> tuple[Rows, Rows]:
    """The indices begin, begin + 1, ... of all runs, concatenated, and the rank of each in its run."""
    rank = np.arange(lengths.sum()) - np.repeat(_begins(lengths), lengths)
    return np.repeat(begins, lengths) + rank, rank
