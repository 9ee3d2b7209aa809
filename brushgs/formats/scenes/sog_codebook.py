"""Codebooks of SOG scenes: the few numbers, or rows of numbers, that stand best for many.

Both are k-means. Of single numbers it is Lloyd's method on sorted values, which has no chance in it. Of rows
it is done in two levels, since 65,536 centroids of a million rows at once would take hours on a CPU: some
hundreds of groups, then centroids within each, as many as its rows and their squared distances ask for.
"""

import warnings
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F32

if TYPE_CHECKING:
    from sklearn.cluster import KMeans

NUM_LEVELS = 256  # a byte names one
_ROUNDS = 60  # of Lloyd's method
# In the first rounds, levels that hardly matter go where the error is largest: to take one away makes its
# error about 16 times as large, and a second one makes that of another a quarter.
_MOVING_ROUNDS, _MOVED, _WORTH = 40, 16, 24
_GROUP_ROWS, _MAX_GROUPS = 1024, 256  # rows of a group, more where these would be more groups
_FIRST_ROWS = 1 << 16  # of which groups are made
_ROW_ROUNDS = 3  # with an entry for two rows, 12 gain 0.1 dB
_SEED = 20261122


def levels_of(
    values: NDArray[np.floating], weights: NDArray[np.floating] | None = None
) -> NDArray[np.float64]:
    """[256] ascending numbers near which the values lie, least squares; equal ones at the end if fewer do.

    Args:
        values: of any shape.
        weights: >= 0, of the same shape: how much the error of each counts; None for all alike.
    """
    order = np.argsort(values, axis=None, kind="stable")
    ordered = values.reshape(-1)[order].astype(np.float64)
    mass = np.ones(len(ordered)) if weights is None else weights.reshape(-1)[order].astype(np.float64)
    distinct = np.unique(ordered)
    if len(distinct) <= NUM_LEVELS:
        return np.pad(distinct, (0, NUM_LEVELS - len(distinct)), mode="edge")
    columns = mass, mass * ordered, mass * np.square(ordered)
    masses, sums, squares = (np.concatenate([[0.0], np.cumsum(column)]) for column in columns)
    levels = distinct[np.linspace(0, len(distinct) - 1, NUM_LEVELS).round().astype(np.int64)]
    for number in range(_ROUNDS):
        ends = np.searchsorted(ordered, [-np.inf, *(levels[1:] + levels[:-1]) / 2, np.inf])
        held, total = np.diff(masses[ends]), np.diff(sums[ends])
        is_held = held > 0
        levels[is_held] = total[is_held] / held[is_held]
        if number < _MOVING_ROUNDS:
            errors = np.maximum(np.diff(squares[ends]) - levels * total, 0)
            errors[~is_held] = -1
            by_error = np.argsort(errors, kind="stable")
            idle, busy = by_error[:_MOVED], by_error[: -_MOVED - 1 : -1]
            is_worth = errors[busy] > _WORTH * np.maximum(errors[idle], 0)
            idle, busy = idle[is_worth], busy[is_worth]
            lowest, highest = ordered[ends[busy]], ordered[ends[busy + 1] - 1]
            is_high = highest - levels[busy] > levels[busy] - lowest
            levels[idle] = (levels[busy] + np.where(is_high, highest, lowest)) / 2
        levels = np.sort(np.clip(levels, ordered[0], ordered[-1]))
    return levels


def nearest_levels(values: NDArray[np.floating], levels: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Which of ascending levels is nearest to each value."""
    borders = (levels[1:] + levels[:-1]) / 2
    return np.searchsorted(borders, values.astype(np.float64)).astype(np.uint8)


def palette_of(rows: F32, most: int) -> tuple[F32, NDArray[np.int64]]:
    """At most so many rows that stand for all, least squares.

    Args:
        rows: [N, columns].
        most: of the palette, >= 1.

    Returns:
        The palette, [entries, columns]; and the entry of each row. The same input gives the same, with any
        number of threads.
    """
    distinct, labels = np.unique(rows, axis=0, return_inverse=True)
    if len(distinct) <= most:
        return distinct, labels.reshape(-1)
    with _one_thread_each():
        return _palette_of_groups(rows, most)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Sums of k-means depend on how many threads share them. Fewer distinct rows than clusters are fine."""
    from sklearn.exceptions import ConvergenceWarning
    from threadpoolctl import threadpool_limits  # of scikit-learn

    with threadpool_limits(1), warnings.catch_warnings():  # those of all threads
        warnings.simplefilter("ignore", ConvergenceWarning)
        yield


def _palette_of_groups(rows: F32, most: int) -> tuple[F32, NDArray[np.int64]]:
    """The same for rows of which too many differ."""
    groups = _groups(rows)
    shares = _shares(rows, groups, most)
    entries: list[F32] = [rows[:0]] * len(groups)
    labels = np.empty(len(rows), np.int64)
    with ThreadPoolExecutor(num_threads_or_default(None)) as pool:
        found = list(
            pool.map(lambda pair: _cluster(rows[pair[0]], pair[1]), zip(groups, shares, strict=True))
        )
    start = 0
    for index, (group, (centroids, inside)) in enumerate(zip(groups, found, strict=True)):
        entries[index], labels[group] = centroids, inside + start
        start += len(centroids)
    return np.concatenate(entries), labels


def _groups(rows: F32) -> list[NDArray[np.int64]]:
    """Row numbers of parts of the rows that are near each other."""
    num_groups = min(-(-len(rows) // _GROUP_ROWS), _MAX_GROUPS)
    if num_groups == 1:
        return [np.arange(len(rows))]
    step = max(1, len(rows) // _FIRST_ROWS)
    model = _k_means(num_groups).fit(rows[::step])
    labels = model.predict(rows)
    groups = [np.flatnonzero(labels == index) for index in range(num_groups)]
    return [group for group in groups if len(group)]


def _shares(rows: F32, groups: list[NDArray[np.int64]], most: int) -> list[int]:
    """How many entries each group gets, >= 1 and together at most `most`."""
    spreads = np.array([rows[group].astype(np.float64).var(axis=0).sum() * len(group) for group in groups])
    # The squared error of k entries falls slowly, as k^(-2 / columns): rows count as much as their spread.
    weights = np.sqrt(spreads * [len(group) for group in groups])
    room = most - len(groups)
    shares = np.floor(weights / max(weights.sum(), 1e-300) * room).astype(int)
    return [int(1 + min(share, len(group) - 1)) for share, group in zip(shares, groups, strict=True)]


def _cluster(rows: F32, num_entries: int) -> tuple[F32, NDArray[np.int64]]:
    """Centroids of one group, and that of each row."""
    distinct, labels = np.unique(rows, axis=0, return_inverse=True)
    if len(distinct) <= num_entries:
        return distinct, labels.reshape(-1)
    model = _k_means(num_entries).fit(rows)
    return model.cluster_centers_.astype(np.float32), model.labels_.astype(np.int64)


def _k_means(num_clusters: int) -> "KMeans":
    from sklearn.cluster import KMeans

    return KMeans(num_clusters, init="random", n_init=1, max_iter=_ROW_ROUNDS, tol=0, random_state=_SEED)
