"""k-means by Lloyd's algorithm: points to the nearest centre by a k-d tree, centres to their mean.

The k-d tree is that of the compiled core. SciPy's gives the same, bit for bit, in about the same time, but
its import alone takes as long as all steps on a scene of 50,000 Gaussians. Only the first round of the start
searches it for every point: afterwards a point is compared with the centres around its previous centre, see
`reassign.cpp`. A step over 1.2 million points in 7000 clusters then takes 1/7 of the time.

Every step is exact; results are the same, bit for bit, for any number of threads and from run to run.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.passes.groups import Groups, compacted
from brushgs.passes.reduce.morton import morton_order
from brushgs.values.arrays import F32

NUM_STEPS = 20
GAIN = 1e-3  # a step that reduces the inertia by less than this share is the last
START_ROUNDS = (0.4, 0.3, 0.3)  # shares of the centres; ten rounds give no lower inertia
MORE_ROUNDS = 8  # at most, to replace duplicate centres of earlier rounds, which occur for equal points
ONE_BY_ONE = 32  # up to this number each centre gets its own round: few must not share an island of points


class Clusters(NamedTuple):
    """Labels [N] of k-means, 0 to num_clusters - 1, and their inertia.

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
    """Cluster points by weighted k-means.

    Args:
        points: [N, D] float32, D at most 16, the first three columns positions in space.
        weights: [N], > 0.
        num_clusters: k, 1 to N.
        seed: of the random choices of the start.
        num_steps: maximum number of Lloyd steps; fewer if one gains less than `gain`.
        gain: share of the inertia by which a step must reduce it.

    Returns:
        At most k clusters, none empty: fewer only if there are fewer distinct points. A centre without points
        restarts at the point with the largest weighted squared distance to its centre.
    """
    order = morton_order(points[:, :3])
    points, weights = points[order], weights[order]  # neighbours in memory too: cache hits
    centers, distances, nearest = start(points, weights, num_clusters, seed)
    errors = weights * distances**2
    inertia, before, step = float(errors.sum()), np.inf, 0
    while step < num_steps and inertia < (1 - gain) * before:
        members = Groups.of(nearest, len(centers))
        centers, before = update(points, weights, members, errors), inertia
        distances, nearest = _assign_again(points, centers, members)
        errors = weights * distances**2
        inertia, step = float(errors.sum()), step + 1
    return _clusters(nearest, order, step, inertia)


def start(
    points: F32, weights: NDArray[np.float64], num_clusters: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
    """First centres [k, D], and the result of `assign` with them.

    Centres are drawn in rounds, by systematic sampling along the space-filling curve of the points. The first
    round samples by weight, later ones by weight x squared distance to the nearest centre so far. Compared
    with one round the inertia after equal steps is 1 to 40 % lower.
    Source: Bahmani et al. 2012, Scalable k-means++ (rounds; there the samples are random).
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
        rows = _systematic_sample(weights * errors, count, shift.random())
        fresh = _distinct(points[rows]).astype(np.float64)
        distances, nearest = _nearer(points, centers, fresh, distances, nearest)
        errors = distances**2
        centers = np.concatenate([centers, fresh])
    return centers, distances, nearest


def _nearer(
    points: F32,
    centers: NDArray[np.float64],
    fresh: NDArray[np.float64],
    distances: NDArray[np.float64],
    nearest: NDArray[np.int32],
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Update nearest distances and indices for additional centres."""
    if len(centers) == 0:
        return assign(points, fresh)
    members, threads = Groups.of(nearest, len(centers)), num_threads_or_default(None)
    rows, begins = members.rows, members.begins
    _core.nearer(points, centers, rows, begins, fresh, len(centers), distances, nearest, threads)
    return distances, nearest


def _distinct(points: F32) -> F32:
    """Distinct points, in order: a k-d tree cannot separate equal centres, and each query would visit all."""
    return points[np.sort(np.unique(points, axis=0, return_index=True)[1])]


def _systematic_sample(mass: NDArray[np.float64], count: int, shift: float) -> NDArray[np.intp]:
    """Systematic sample: `count` rows at even steps of cumulative mass, the first at `shift` of a step."""
    cumulative = np.cumsum(mass)
    rows = np.searchsorted(cumulative, (np.arange(count) + shift) * (cumulative[-1] / count))
    return np.asarray(np.minimum(rows, len(mass) - 1))


def assign(points: F32, centers: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distances [N] to the nearest centre, and its index [N]: the first of equally near ones."""
    assert 1 <= points.shape[1] <= _core.MOST_DIMENSIONS, "the core supports no more"
    return _core.nearest(points, centers, num_threads_or_default(None))


def _assign_again(
    points: F32, centers: NDArray[np.float64], members: Groups
) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """The result of `assign`, several times faster: `members` are the points by their previous nearest
    centre.
    """
    return _core.nearest_again(points, centers, members.rows, members.begins, num_threads_or_default(None))


def update(
    points: F32, weights: NDArray[np.float64], members: Groups, errors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Weighted means of the points by cluster, [k, D]; those without points go to the largest errors."""
    mass, means = members.totals_and_sums(points, weights, num_threads_or_default(None))
    is_empty = mass == 0
    means[~is_empty] /= mass[~is_empty, None]
    empty = np.flatnonzero(is_empty)
    if len(empty):
        means[empty] = points[np.argsort(-errors, kind="stable")[: len(empty)]]
    return means


def _clusters(nearest: NDArray[Any], order: NDArray[np.intp], num_steps: int, inertia: float) -> Clusters:
    compact, num = compacted(nearest)
    labels = np.empty(len(nearest), dtype=np.int32)
    labels[order] = compact
    return Clusters(labels, num, num_steps, inertia)
