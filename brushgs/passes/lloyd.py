"""k-means by Lloyd's steps: points to the nearest centre by a k-d tree, centres to the mean of their points.

The tree is that of the compiled core. SciPy's finds the same, bit for bit, in about the same time, but its
import alone takes as long as all steps together on a scene of 50,000 Gaussians.

Exact at each step, the same bit for bit for any number of threads and from run to run.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs import _core
from brushgs.arrays import F32
from brushgs.passes.morton import morton_order
from brushgs.threads import num_threads_or_default

NUM_STEPS = 20
GAIN = 1e-3  # a step that lowers the inertia by less than this share is the last
START_ROUNDS = (0.4, 0.3, 0.3)  # shares of the centres; ten rounds end no lower
MORE_ROUNDS = 8  # at most, for centres that earlier rounds drew twice: those of repeated points
ONE_BY_ONE = 32  # so few centres are drawn each in a round of its own: two in one island show


class Clusters(NamedTuple):
    """Labels [N] of k-means, in 0 to the number of clusters - 1, and what they cost.

    The inertia is the sum of weight x squared distance to the nearest of the final centres.
    """

    labels: NDArray[np.int32]
    num_clusters: int
    num_steps: int
    inertia: float


def lloyd(
    points: F32,
    weights: NDArray[np.float64],
    num_clusters: int,
    *,
    seed: int = 0,
    num_steps: int = NUM_STEPS,
    gain: float = GAIN,
) -> Clusters:
    """Group points by weighted k-means.

    Args:
        points: [N, D] float32, D at most 16, the first three columns positions in space.
        weights: [N], > 0.
        num_clusters: k, 1 to N.
        seed: of the start, where it takes chance.
        num_steps: Lloyd steps at most; fewer where one gains less than `gain`.
        gain: share of the inertia.

    Returns:
        At most k clusters, none empty: fewer only where fewer different points are. A centre that lost
        its points starts anew at the point that is farthest from its own, by weighted square.
    """
    order = morton_order(points[:, :3])
    points, weights = points[order], weights[order]  # neighbours in memory too: the tree stays in cache
    # The start has assigned the points already, a round of centres at a time: step 0 need not.
    centers, distances, nearest = start(points, weights, num_clusters, seed)
    before = np.inf
    for step in range(num_steps + 1):
        if step:
            distances, nearest = assign(points, centers)
        errors = weights * distances**2
        inertia = float(errors.sum())
        if step == num_steps or inertia >= (1 - gain) * before:
            break
        centers, before = update(points, weights, nearest, errors, centers), inertia
    return _clusters(nearest, order, step, inertia)


def start(
    points: F32, weights: NDArray[np.float64], num_clusters: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
    """First centres [k, D], and what `assign` says of them.

    Points are drawn in rounds, each spread evenly along the curve the points lie on.

    The first round draws by weight, each later one by what is still badly served: weight x squared distance
    to the nearest centre so far. Against one round this ends at 1-40 % lower inertia after equal steps.
    Source: Bahmani et al. 2012, Scalable k-means++ (rounds); the even spread takes the place of its chance.
    """
    shift = np.random.default_rng(seed)
    centers, distances = points[:0].astype(np.float64), np.full(len(points), np.inf)
    errors, nearest = np.ones(len(points)), np.zeros(len(points), dtype=np.int32)
    shares = START_ROUNDS if num_clusters > ONE_BY_ONE else np.full(num_clusters, 1 / num_clusters)
    targets = np.rint(np.cumsum(shares) * num_clusters).astype(int)
    for target in (*targets, *[num_clusters] * MORE_ROUNDS):
        if not errors.any() or target == len(centers):
            break
        count = target - len(centers)
        fresh = _distinct(points[_spread_rows(weights * errors, count, shift.random())]).astype(np.float64)
        to_fresh, nearest_fresh = assign(points, fresh)
        is_nearer = to_fresh < distances
        nearest[is_nearer] = nearest_fresh[is_nearer] + len(centers)
        distances = np.minimum(distances, to_fresh)
        errors = distances**2
        centers = np.concatenate([centers, fresh])
    return centers, distances, nearest


def _distinct(points: F32) -> F32:
    """The points without repetitions, in order. No tree parts equal centres: each query would visit all."""
    return points[np.sort(np.unique(points, axis=0, return_index=True)[1])]


def _spread_rows(mass: NDArray[np.float64], count: int, shift: float) -> NDArray[np.intp]:
    """`count` rows at even steps of the mass passed, the first at `shift` of a step."""
    passed = np.cumsum(mass)
    rows = np.searchsorted(passed, (np.arange(count) + shift) * (passed[-1] / count))
    return np.asarray(np.minimum(rows, len(mass) - 1))


def assign(points: F32, centers: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distance [N] to the nearest centre, and which one it is [N], the first of equally near ones."""
    assert 1 <= points.shape[1] <= _core.MOST_DIMENSIONS, "the core has room for no more"
    return _core.nearest(points, centers, num_threads_or_default(None))


def update(
    points: F32,
    weights: NDArray[np.float64],
    labels: NDArray[np.int32],
    errors: NDArray[np.float64],
    centers: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Weighted means of the points by label, [k, D]; centres without points go where the error is largest."""
    num_clusters = len(centers)
    mass = np.bincount(labels, weights, num_clusters)
    means = np.empty_like(centers)
    for column in range(points.shape[1]):
        means[:, column] = np.bincount(labels, weights * points[:, column], num_clusters)
    is_empty = mass == 0
    means[~is_empty] /= mass[~is_empty, None]
    empty = np.flatnonzero(is_empty)
    if len(empty):
        means[empty] = points[np.argsort(-errors, kind="stable")[: len(empty)]]
    return means


def _clusters(nearest: NDArray[Any], order: NDArray[np.intp], num_steps: int, inertia: float) -> Clusters:
    used, compact = np.unique(nearest, return_inverse=True)
    labels = np.empty(len(nearest), dtype=np.int32)
    labels[order] = compact
    return Clusters(labels, len(used), num_steps, inertia)
