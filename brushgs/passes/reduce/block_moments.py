"""Moments of Gaussians, added up block by block, and the merged Gaussian of their sums.

The rule is "cover" of `merge` with an overlap of 1, so that a merged Gaussian paints what its members
painted: weights are opacity x mean projected area, the covariance follows the law of total variance, and the
opacity is the probability that a ray through the footprint is stopped. The latter is not a sum: it is
computed for equal members with the mean opacity and the mean share of the footprint.
"""

import numpy as np

from brushgs.passes.reduce.contribution import projected_areas, seen_areas
from brushgs.passes.reduce.merge import principal_axes
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of, rotation_matrices

# Rows of sums. Positions are relative to a point that is the same for all.
WEIGHT, AREA, WEIGHTED_AREA = 0, 1, 2
FIRST = slice(3, 6)  # weight x position
SECOND = slice(6, 12)  # weight x (covariance + position x position), upper triangle
COLOR = 12  # weight x spherical harmonics, from here on, term by term
UPPER = np.triu_indices(3)
LEAST_AREA = 1e-100  # world units squared: Gaussians without paint keep position, shape and color
LEAST_OPACITY = 1e-12
ROWS_AT_A_TIME = 1 << 15


def moments_of(gaussians: Gaussians, center: F64) -> F64:
    """The moments of each Gaussian, [12 + 3 k, N].

    Args:
        gaussians: N Gaussians with k terms of spherical harmonics, with `finest`.
        center: [3] origin of positions, world units.
    """
    num, sh = len(gaussians), gaussians.sh
    areas = np.maximum(seen_areas(gaussians), LEAST_AREA)
    weights = np.maximum(gaussians.opacities, LEAST_OPACITY) * areas
    sums = np.empty((COLOR + 3 * sh.shape[1], num))
    sums[WEIGHT], sums[AREA], sums[WEIGHTED_AREA] = weights, areas, weights * areas
    for first in range(0, num, ROWS_AT_A_TIME):
        rows = slice(first, first + ROWS_AT_A_TIME)
        axes = rotation_matrices(gaussians.quats[rows]) * gaussians.scales[rows, None, :]
        away = gaussians.means[rows].T - center[:, None]
        sums[FIRST, rows] = weights[rows] * away
        for row, (i, j) in enumerate(zip(*UPPER, strict=True), SECOND.start):
            own = np.einsum("na,na->n", axes[:, i], axes[:, j])
            sums[row, rows] = weights[rows] * (own + away[i] * away[j])
        sums[COLOR:, rows] = weights[rows] * gaussians.sh[rows].reshape(-1, 3 * sh.shape[1]).T
    return sums


def gaussians_of(sums: F64, center: F64, finest: float, *, antialiased: bool) -> Gaussians:
    """The merged Gaussian of each column of sums, float32.

    Args:
        sums: [12 + 3 k, n], each column the sum of one or more of `moments_of`.
        center: [3] of these.
        finest: of these, see `finest_of`.
        antialiased: whether the Gaussians were trained so.
    """
    num, num_terms = sums.shape[1], (len(sums) - COLOR) // 3
    columns: list[F32] = [
        np.empty((num, *shape), np.float32) for shape in ((3,), (4,), (3,), (), (num_terms, 3))
    ]
    for first in range(0, num, ROWS_AT_A_TIME):
        rows = slice(first, first + ROWS_AT_A_TIME)
        for column, values in zip(columns, _merged(sums[:, rows], center, finest), strict=True):
            column[rows] = values
    return Gaussians(*columns, antialiased=antialiased)


def _merged(sums: F64, center: F64, finest: float) -> tuple[Array, Array, Array, Array, Array]:
    """Means, quaternions, scales, opacities and spherical harmonics of some columns."""
    away, second, colors = (sums[some] / sums[WEIGHT] for some in (FIRST, SECOND, slice(COLOR, None)))
    covars = np.empty((sums.shape[1], 3, 3))
    for values, i, j in zip(second, *UPPER, strict=True):
        covars[:, i, j] = covars[:, j, i] = values - away[i] * away[j]
    scales, rotations = principal_axes(covars)
    scales = np.minimum(scales, np.finfo(np.float32).max)
    return (
        away.T + center,
        quats_of(rotations),
        scales,
        _opacities(sums, np.maximum(projected_areas(scales, finest), LEAST_AREA)),
        colors.T.reshape(len(scales), -1, 3),
    )


def _opacities(sums: F64, footprints: F64) -> F64:
    """Probability that a ray through each footprint is stopped by members at random places in it, [n].

    One member gives its opacity, equal ones at one place that of the stack, and many small ones the
    Beer-Lambert law, exactly as `passes.reduce.merge.stopped`; others in between.
    """
    parts = np.minimum(
        sums[WEIGHTED_AREA] / sums[WEIGHT] / footprints, 1
    )  # of the footprint, that one covers
    mean = np.minimum(sums[WEIGHT] / sums[AREA], 1)
    counts = sums[AREA] / (footprints * parts)
    with np.errstate(divide="ignore", over="ignore"):  # log 0: an opaque member that covers all
        return np.asarray(-np.expm1(counts * np.log1p(-parts * mean)))
