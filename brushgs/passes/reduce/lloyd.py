"""k-means by Lloyd's algorithm, in the core: points to the nearest center, centers to their mean.

The k-d tree of the core gives what SciPy's gives, bit for bit, in about the same time, but the import of
that alone takes as long as all steps on a scene of 50,000 Gaussians.

Every step is exact; results are the same, bit for bit, for any number of threads and from run to run.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F32

NUM_STEPS = 20
GAIN = 1e-3  # a step that reduces the inertia by less than this share is the last


class Clusters(NamedTuple):
    """Labels [N] of k-means, 0 to num_clusters - 1, and their inertia.

    The inertia is the sum of weight x squared distance to the nearest of the final centers.
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
        At most k clusters, none empty: fewer only if there are fewer distinct points. A center without points
        restarts at the point with the largest weighted squared distance to its center.
    """
    found = _core.find_clusters(
        points=np.ascontiguousarray(points),
        weights=np.ascontiguousarray(weights),
        num_clusters=num_clusters,
        draws=draws_for(num_clusters, seed),
        num_steps=num_steps,
        gain=gain,
        num_threads=num_threads_or_default(None),
    )
    return Clusters(*found)


def start(points: F32, weights: NDArray[np.float64], num_clusters: int, seed: int = 0) -> NDArray[np.float64]:
    """First centers [k, D] of `lloyd`, for points in the order of a space-filling curve.

    Centers are drawn in rounds, by systematic sampling along the points: by weight, then by weight x squared
    distance to the nearest center so far; k is below `num_clusters` only if there are fewer distinct points.
    """
    centers = _core.start_centers(
        np.ascontiguousarray(points),
        np.ascontiguousarray(weights),
        num_clusters,
        draws_for(num_clusters, seed),
        num_threads_or_default(None),
    )
    return np.asarray(centers)


def draws_for(num_clusters: int, seed: int) -> NDArray[np.float64]:
    """Random numbers for each round of a start."""
    return np.random.default_rng(seed).random(_core.most_draws(num_clusters))


def assign(points: F32, centers: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Distances [N] to the nearest center, and its index [N]: the first of equally near ones."""
    assert 1 <= points.shape[1] <= _core.MOST_DIMENSIONS, "the core supports no more"
    return _core.nearest(points, centers, num_threads_or_default(None))
