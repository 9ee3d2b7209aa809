"""Gaussians and a label for each -> one Gaussian per label: the strokes in space.

Two rules. "paper" is the published one: plain means, and a scale that grows with the number of members.
With "cover" the merged Gaussian paints what its members painted, where they painted it:

- Members, and so their mean, are weighted by opacity x mean projected area.
- The covariance follows the law of total variance, within + between. The part between is multiplied by
  `overlap`, so that neighbouring strokes overlap as paint does, and by more where a single layer of strokes
  would leave gaps (see `gaps`); a lone member keeps its covariance.
- The opacity is the probability that a ray through the footprint (without `overlap`) is stopped if members
  lie anywhere in it: 1 - product of (1 - opacity_i x min(1, area_i / area)). For one member that is its own
  opacity, for equal ones that of the stack, for many small ones the Beer-Lambert law. Clusters with outliers
  or needles therefore fade as they extend over what their members do not cover.
- Colours are also weighted by visibility: the dark inside of a fur does not mix with its surface.

Sums run in float64, in row order: equal input gives equal output, bit for bit.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import F64, Array, check
from brushgs.options.choices import Merge
from brushgs.passes.contribution import projected_areas, visible_shares
from brushgs.passes.gaps import growth
from brushgs.quats import normalized, quats_of, rotation_matrices
from brushgs.scene import Gaussians

# Factor on the variance between members, 1.16 in length. Members distributed evenly over a disc have half its
# radius as deviation, and a Gaussian of that deviation paints half of the disc: 2 would paint as much as it,
# but members lie in several layers. Measured on five scenes with the plain kernel: 1.5 is best, 1.2 and 1.7
# lose 0.3 and 0.1 dB in the worst case; stroke images, which `fitted_sigmas` enlarges, are best below 1.4.
OVERLAP = 1.35
ROWS_AT_A_TIME = 1 << 15  # of covariances in memory


def merge_clusters(
    gaussians: Gaussians,
    labels: NDArray[np.integer[Any]],
    *,
    merge: Merge = "cover",
    overlap: float | None = None,
    visible: F64 | None = None,
) -> Gaussians:
    """Merge the Gaussians that share a label.

    Source: "paper", Xiang et al. 2025, section 3.2 (plain means, quaternions with signs aligned to the
    first member's, scale x cube root of the number of members); "cover", see the module.

    Args:
        gaussians: N Gaussians.
        labels: [N] any integers.
        merge: the rule.
        overlap: of "cover": factor on the variance between members, > 0; 1 conserves the covariance. None for
            1.35, and up to 2.55 where strokes would leave gaps.
        visible: of "cover": [N] `visible_shares` of the Gaussians, if known.

    Returns:
        One Gaussian per label in use, by ascending label, in the dtype of the input. With "cover" a
        Gaussian alone under its label is returned as it was. Each is in the region of its first member:
        clusters do not mix regions.

    Raises:
        TypeError: if `labels` are not integers.
        ValueError: if the lengths differ, the rule is unknown or `overlap` is out of range.
    """
    check("merge_clusters", means=(gaussians.means, "N 3"), labels=(labels, "N"))
    if visible is not None:
        check("merge_clusters", means=(gaussians.means, "N 3"), visible=(visible, "N"))
    if not np.issubdtype(labels.dtype, np.integer):
        raise TypeError(f"merge_clusters: labels must be integers, got {labels.dtype}")
    if merge not in ("cover", "paper"):
        raise ValueError(f"merge_clusters: merge must be 'cover' or 'paper', got {merge!r}")
    if overlap is not None and not 0 < overlap < np.inf:
        raise ValueError(f"merge_clusters: overlap must be > 0 and finite, got {overlap}")
    used, compact = np.unique(labels, return_inverse=True)
    if merge == "cover":
        merged = _cover(gaussians, compact, len(used), overlap, visible)
    else:
        merged = _paper(gaussians, compact, len(used))
    dtype = gaussians.means.dtype.type
    # Both rules enlarge, but the largest number of the dtype stays finite.
    scales = np.minimum(merged.scales, np.finfo(dtype).max)
    regions = gaussians.regions
    if regions is not None:
        regions = regions[np.unique(compact, return_index=True)[1]]
    return replace(merged, scales=scales, antialiased=gaussians.antialiased, regions=regions).astype(dtype)


def _paper(gaussians: Gaussians, labels: NDArray[np.intp], num: int) -> Gaussians:
    counts = np.bincount(labels, minlength=num)
    shares = 1.0 / counts[labels]
    firsts = np.unique(labels, return_index=True)[1]
    quats = normalized(gaussians.quats)
    quats[np.einsum("ni,ni->n", quats, quats[firsts][labels]) < 0] *= -1
    return Gaussians(
        _sums(gaussians.means, shares, labels, num),
        _sums(quats, shares, labels, num),
        _sums(gaussians.scales, shares, labels, num) * np.cbrt(counts)[:, None],
        np.clip(_sums(gaussians.opacities[:, None], shares, labels, num)[:, 0], 0, 1),
        _sum_sh(gaussians.sh, shares, labels, num),
    )


def _cover(
    gaussians: Gaussians, labels: NDArray[np.intp], num: int, overlap: float | None, visible: F64 | None
) -> Gaussians:
    areas = projected_areas(gaussians.scales)
    shares = shares_by_label(gaussians.opacities * areas, labels, num)
    means = _sums(gaussians.means, shares, labels, num)
    within, between = covariances(gaussians, means, shares, labels)
    scales, _ = principal_axes(within + between)
    opacities = stopped(gaussians.opacities, areas, projected_areas(scales), labels)
    scales, rotations = principal_axes(within + (overlap or OVERLAP) * between)
    if overlap is None:
        more = growth(means, scales, rotations, opacities)
        rows = np.flatnonzero(more)
        covars = within[rows] + (OVERLAP + more[rows, None, None]) * between[rows]
        scales[rows], rotations[rows] = principal_axes(covars)
    visible = visible_shares(gaussians) if visible is None else visible
    seen = shares_by_label(shares * visible, labels, num)
    quats, sh = quats_of(rotations), _sum_sh(gaussians.sh, seen, labels, num)
    columns = (means, quats, scales, opacities, sh)
    is_alone = np.bincount(labels, minlength=num)[labels] == 1
    originals = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    for column, original in zip(columns, originals, strict=True):
        column[labels[is_alone]] = original[is_alone]
    return Gaussians(*columns)


def shares_by_label(weights: F64, labels: NDArray[np.intp], num: int) -> F64:
    """Weights over their sum by label; equal weights where that sum is zero."""
    totals = np.bincount(labels, weights, num)
    is_void = (totals == 0)[labels]
    if is_void.any():
        weights = np.where(is_void, 1.0, weights)
        totals = np.bincount(labels, weights, num)
    return np.asarray(weights / totals[labels])


def _sums(rows: Array, shares: F64, labels: NDArray[np.intp], num: int) -> NDArray[np.float64]:
    """Weighted sums of the rows [N, D] by label, [num, D], a column at a time."""
    return np.stack([np.bincount(labels, shares * rows[:, i], num) for i in range(rows.shape[1])], axis=1)


def _sum_sh(sh: Array, shares: F64, labels: NDArray[np.intp], num: int) -> NDArray[np.float64]:
    sums = np.empty((num, *sh.shape[1:]))
    for term in range(sh.shape[1]):
        sums[:, term] = _sums(sh[:, term], shares, labels, num)
    return sums


def covariances(
    gaussians: Gaussians, means: NDArray[np.float64], shares: F64, labels: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weighted mean covariance of the members, and covariance of their means, by label: [num, 3, 3] each."""
    within, between = np.zeros((2, 9, len(means)))
    for first in range(0, len(labels), ROWS_AT_A_TIME):
        rows = slice(first, first + ROWS_AT_A_TIME)
        some_labels, some_shares = labels[rows], shares[rows]
        axes = rotation_matrices(gaussians.quats[rows]) * gaussians.scales[rows, None, :]
        away = gaussians.means[rows] - means[some_labels]
        own = axes @ axes.transpose(0, 2, 1)
        used, local = np.unique(some_labels, return_inverse=True)  # few labels occur in so many rows
        for i, (j, k) in enumerate(np.ndindex(3, 3)):
            within[i, used] += np.bincount(local, some_shares * own[:, j, k])
            between[i, used] += np.bincount(local, some_shares * away[:, j] * away[:, k])
    return within.T.reshape(-1, 3, 3), between.T.reshape(-1, 3, 3)


def principal_axes(covars: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Standard deviations [N, 3], ascending, and axes [N, 3, 3] (columns, right-handed) of covariances.

    Each is divided by its trace first, so that 1e-100 and 1e100 are treated alike; a variance that rounding
    made negative is zero.
    """
    traces = np.einsum("nii->n", covars)
    unit = np.where(traces > 0, traces, 1.0)
    variances, axes = np.linalg.eigh(covars / unit[:, None, None])
    axes[np.linalg.det(axes) < 0, :, 0] *= -1
    return np.sqrt(np.maximum(variances, 0.0)) * np.sqrt(unit)[:, None], axes


def stopped(opacities: Array, areas: F64, footprints: F64, labels: NDArray[np.intp]) -> F64:
    """Probability that a ray through each footprint is stopped by members at random places in it, [num]."""
    footprints_here = footprints[labels]
    parts = np.divide(areas, footprints_here, out=np.ones_like(areas), where=footprints_here > areas)
    with np.errstate(divide="ignore"):  # log 0: an opaque member that covers all
        passed = np.log1p(-parts * opacities)
    return np.asarray(-np.expm1(np.bincount(labels, passed, len(footprints))))
