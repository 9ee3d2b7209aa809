"""Gaussians and a label for each -> one Gaussian per label: the strokes in space.

Two rules. "paper" is the published one: plain means, and a scale that grows with the number of members.
With "cover" the merged Gaussian paints what its members painted, where they painted it:

- Members, and so their mean, are weighted by opacity x mean projected area. Areas are as visible in pictures
  (see `finest`): a needle is as wide as the low-pass of the renderer.
- The covariance follows the law of total variance, within + between. The part between is multiplied by
  `overlap`, so that neighbouring strokes overlap as paint does, and by more where a single layer of strokes
  would leave gaps (see `gaps`); a lone member keeps its covariance.
- The opacity is the probability that a ray through the footprint (without `overlap`) is stopped if members
  lie anywhere in it: 1 - product of (1 - opacity_i x min(1, area_i / area)). For one member that is its own
  opacity, for equal ones that of the stack, for many small ones the Beer-Lambert law. Clusters with outliers
  or needles therefore fade, since they extend over area that their members do not cover.
- Colours are also weighted by visibility: the dark inside of a fur does not mix with its surface.

Sums run in float64, in row order: equal input gives equal output, bit for bit.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.threads import in_turn
from brushgs.options.choices import Merge
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.form.gaps import growth
from brushgs.passes.groups import Groups, compacted
from brushgs.passes.reduce.contribution import projected_areas, visible_shares
from brushgs.passes.row_blocks import MOST_THREADS, blocks_of
from brushgs.values.arrays import F64, Array, Rows, check
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized, quats_of, rotation_matrices

# Factor on the variance between members, 1.16 in length. Members distributed evenly over a disc have half its
# radius as deviation, and a Gaussian of that deviation paints half of the disc: 2 would paint as much as it,
# but members lie in several layers. Measured on five scenes with the plain kernel: 1.5 is best, 1.2 and 1.7
# lose 0.3 and 0.1 dB in the worst case; stroke images, which `fitted_sigmas` enlarges, are best below 1.4.
OVERLAP = 1.35


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
            1.35, and up to 2.55 if strokes would leave gaps.
        visible: of "cover": [N] `visible_shares` of the Gaussians, if known.

    Returns:
        One Gaussian per label in use, by ascending label, in the dtype of the input. With "cover" a single
        member is returned unchanged. Each is in the region of its first member: clusters do not mix regions.

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
    compact, num = compacted(labels)
    groups = Groups.of(compact, num)
    if merge == "cover":
        merged = _cover(gaussians, compact, groups, overlap, visible)
    else:
        merged = _paper(gaussians, compact, groups)
    dtype = gaussians.means.dtype.type
    # Both rules enlarge scales; the result is clipped to the largest number of the dtype.
    scales = np.minimum(merged.scales, np.finfo(dtype).max)
    regions = gaussians.regions
    if regions is not None:
        regions = regions[groups.firsts]
    merged = replace(merged, scales=scales, regions=regions)
    return replace(merged, antialiased=gaussians.antialiased, finest=gaussians.finest).astype(dtype)


def _paper(gaussians: Gaussians, labels: NDArray[np.int32], groups: Groups) -> Gaussians:
    counts = groups.sizes
    shares = 1.0 / counts[labels]
    quats = normalized(gaussians.quats)
    quats[np.einsum("ni,ni->n", quats, quats[groups.firsts][labels]) < 0] *= -1
    return Gaussians(
        groups.sums(gaussians.means, shares),
        groups.sums(quats, shares),
        groups.sums(gaussians.scales, shares) * np.cbrt(counts)[:, None],
        np.clip(groups.sums(gaussians.opacities, shares), 0, 1),
        groups.sums(gaussians.sh, shares),
    )


def _cover(
    gaussians: Gaussians,
    labels: NDArray[np.int32],
    groups: Groups,
    overlap: float | None,
    visible: F64 | None,
) -> Gaussians:
    num, finest = len(groups), finest_of(gaussians)
    areas = projected_areas(seen_scales(gaussians.scales, finest))
    shares = shares_by_label(gaussians.opacities * areas, labels, num)
    means = groups.sums(gaussians.means, shares)
    within, between = covariances(gaussians, means, shares, labels)
    scales, _ = principal_axes(within + between)
    footprints = projected_areas(seen_scales(scales, finest))
    opacities = stopped(gaussians.opacities, areas, footprints, labels)
    scales, rotations = principal_axes(within + (overlap or OVERLAP) * between)
    if overlap is None:
        more = growth(means, seen_scales(scales, finest).astype(np.float64), rotations, opacities)
        rows = np.flatnonzero(more)
        covars = within[rows] + (OVERLAP + more[rows, None, None]) * between[rows]
        scales[rows], rotations[rows] = principal_axes(covars)
    visible = visible_shares(gaussians) if visible is None else visible
    seen = shares_by_label(shares * visible, labels, num)
    quats, sh = quats_of(rotations), groups.sums(gaussians.sh, seen)
    columns = (means, quats, scales, opacities, sh)
    alone = np.flatnonzero(groups.sizes == 1)
    originals = (gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities, gaussians.sh)
    for column, original in zip(columns, originals, strict=True):
        column[alone] = original[groups.firsts[alone]]
    return Gaussians(*columns)


def shares_by_label(weights: F64, labels: NDArray[np.integer[Any]], num: int) -> F64:
    """Weights over their sum by label; equal weights if that sum is zero."""
    totals = np.bincount(labels, weights, num)
    is_void = (totals == 0)[labels]
    if is_void.any():
        weights = np.where(is_void, 1.0, weights)
        totals = np.bincount(labels, weights, num)
    return np.asarray(weights / totals[labels])


def covariances(
    gaussians: Gaussians, means: NDArray[np.float64], shares: F64, labels: NDArray[np.integer[Any]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Weighted mean covariance of the members, and covariance of their means, by label: [num, 3, 3] each."""
    within, between = np.zeros((2, len(means), 3, 3))

    def sums_of(rows: slice) -> tuple[Rows, F64, F64]:
        local, num_used = compacted(labels[rows])  # few labels occur in so many rows
        used = np.empty(num_used, np.intp)
        used[local] = labels[rows]
        groups, weights = Groups.of(local, num_used), shares[rows]
        axes = rotation_matrices(gaussians.quats[rows]) * gaussians.scales[rows, None, :]
        away = gaussians.means[rows] - means[labels[rows]]
        products = (weights[:, None] * away)[:, :, None] * away[:, None, :]
        own = groups.sums(axes @ axes.transpose(0, 2, 1), weights, 1)
        return used, own, groups.sums(products, np.ones(len(weights)), 1)

    for used, own, products in in_turn(sums_of, blocks_of(len(labels)), at_once=MOST_THREADS):
        within[used] += own
        between[used] += products
    return within, between


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


def stopped(opacities: Array, areas: F64, footprints: F64, labels: NDArray[np.integer[Any]]) -> F64:
    """Probability that a ray through each footprint is stopped by members at random places in it, [num]."""
    footprints_here = footprints[labels]
    parts = np.divide(areas, footprints_here, out=np.ones_like(areas), where=footprints_here > areas)
    with np.errstate(divide="ignore"):  # log 0: an opaque member that covers all
        passed = np.log1p(-parts * opacities)
    return np.asarray(-np.expm1(np.bincount(labels, passed, len(footprints))))
