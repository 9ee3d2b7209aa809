"""k-means on random batches of the points, by scikit-learn: the published method."""

import warnings

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.reduce.lloyd import Clusters
from brushgs.values.arrays import F32

BATCH = 8192  # rows, as published


def minibatch(points: F32, weights: NDArray[np.float64], num_clusters: int, *, seed: int) -> Clusters:
    """Cluster points [N, D] with weights [N] into at most `num_clusters`; equal seeds give equal clusters.

    Importing scikit-learn takes a second, so it happens here.

    Raises:
        ValueError: if scikit-learn is not installed.

    Source: Sculley 2010, Web-Scale K-Means Clustering; Xiang et al. 2025 (batch size).
    """
    try:
        from sklearn.cluster import MiniBatchKMeans
        from sklearn.exceptions import ConvergenceWarning
    except ImportError:
        raise ValueError(
            "method 'minibatch' needs scikit-learn; pip install 'brushgs[kmeans]', or choose 'lloyd'"
        ) from None

    # It squares in float32, which overflows at coordinates of 1e19: scaling by a power of two is exact.
    _, exponent = np.frexp(np.abs(points).max())
    points = np.ldexp(points, -exponent)
    model = MiniBatchKMeans(num_clusters, batch_size=BATCH, n_init=1, random_state=seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # fewer distinct points than clusters are fine
        model.fit(points, sample_weight=weights)
    used, labels = np.unique(model.labels_, return_inverse=True)
    inertia = float(np.ldexp(model.inertia_, 2 * exponent))
    return Clusters(labels.astype(np.int32), len(used), int(model.n_iter_), inertia)
