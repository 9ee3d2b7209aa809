"""Gaussians and a label for each -> one Gaussian per label: the strokes in space.

Two rules. "paper" is the published one: plain means, and a scale that grows with the number of members.
With "cover" the merged Gaussian paints what its members painted, where they painted it:

- Members, and so their mean, are weighted by opacity x mean projected area. Areas are as visible in pictures
  (see `finest`): a needle is as wide as the low-pass of the renderer.
- The covariance follows the law of total variance, within + between. The part between is multiplied by
  `overlap`, so that neighboring strokes overlap as paint does, and by more where a single layer of strokes
  would leave gaps (see core/include/brushgs/gaps.hpp); a lone member keeps its covariance.
- The opacity is the probability that a ray through the footprint (without `overlap`) is stopped if members
  lie anywhere in it: 1 - product of (1 - opacity_i x min(1, area_i / area)). For one member that is its own
  opacity, for equal ones that of the stack, for many small ones the Beer-Lambert law. Clusters with outliers
  or needles therefore fade, since they extend over area that their members do not cover.
- Colors are also weighted by visibility: the dark inside of a fur does not mix with its surface.

Sums run in float64, in row order: equal input gives equal output, bit for bit.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import Merge
from brushgs.passes.finest import finest_of
from brushgs.passes.groups import Groups, compacted
from brushgs.passes.reduce.contribution import seen_areas, visible_shares
from brushgs.values.arrays import F64, Array, check
from brushgs.values.gaussians import GAUSSIAN_COLUMNS, Gaussians
from brushgs.values.quats import normalized

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
    areas: F64 | None = None,
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
        areas: of "cover": [N] `seen_areas` of the Gaussians, if known.

    Returns:
        One Gaussian per label in use, by ascending label, in the dtype of the input. With "cover" a single
        member is returned unchanged. Each is in the region of its first member: clusters do not mix regions.

    Raises:
        TypeError: if `labels` are not integers.
        ValueError: if the lengths differ, the rule is unknown or `overlap` is out of range.
    """
    check("merge_clusters", means=(gaussians.means, "N 3"), labels=(labels, "N"))
    for name, values in (("visible", visible), ("areas", areas)):
        if values is not None:
            check("merge_clusters", means=(gaussians.means, "N 3"), **{name: (values, "N")})
    if not np.issubdtype(labels.dtype, np.integer):
        raise TypeError(f"merge_clusters: labels must be integers, got {labels.dtype}")
    if merge not in ("cover", "paper"):
        raise ValueError(f"merge_clusters: merge must be 'cover' or 'paper', got {merge!r}")
    if overlap is not None and not 0 < overlap < np.inf:
        raise ValueError(f"merge_clusters: overlap must be > 0 and finite, got {overlap}")
    compact, num = compacted(labels)
    groups = Groups.of(compact, num)
    if merge == "cover":
        merged = _cover(gaussians, compact, num, overlap, visible, areas)
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
    num: int,
    overlap: float | None,
    visible: F64 | None,
    areas: F64 | None,
) -> Gaussians:
    finest = finest_of(gaussians)
    columns = [np.ascontiguousarray(getattr(gaussians, name)) for name in GAUSSIAN_COLUMNS]
    merged: Any = tuple(np.empty((num, *column.shape[1:]), column.dtype) for column in columns)
    _core.cover_members(
        **dict(zip(GAUSSIAN_COLUMNS, columns, strict=True)),
        areas=np.ascontiguousarray(seen_areas(gaussians) if areas is None else areas),
        visible=np.ascontiguousarray(visible_shares(gaussians) if visible is None else visible),
        labels=labels,
        overlap=overlap or OVERLAP,
        closes_gaps=overlap is None,
        finest=finest,
        num_threads=num_threads_or_default(None),
        merged=merged,
    )
    return Gaussians(*merged)


def covariances(gaussians: Gaussians, means: F64, shares: F64, groups: Groups) -> tuple[F64, F64]:
    """Weighted mean covariance of the members, and covariance of their means, by group: [k, 3, 3] each.

    Args:
        gaussians: N Gaussians.
        means: [k, 3] weighted means of the groups.
        shares: [N] weights whose sum is 1 in every group.
        groups: of the rows.
    """
    within, between = _core.sum_covariances(
        np.ascontiguousarray(gaussians.means),
        np.ascontiguousarray(gaussians.quats),
        np.ascontiguousarray(gaussians.scales),
        shares,
        groups.rows,
        groups.begins,
        means,
        num_threads_or_default(None),
    )
    return within, between


def principal_axes(covars: F64) -> tuple[F64, F64]:
    """Standard deviations [N, 3], ascending, and axes [N, 3, 3] (columns, right-handed) of covariances.

    Each is divided by its trace first, so that 1e-100 and 1e100 are treated alike; a variance that rounding
    made negative is zero. Of the two longer axes the largest component is positive.
    """
    return _core.principal_axes(np.ascontiguousarray(covars), num_threads_or_default(None))


def stopped(opacities: Array, areas: F64, footprints: F64, groups: Groups) -> F64:
    """Probability that a ray through each footprint is stopped by members at random places in it, [k].

    Args:
        opacities: [N] of the members.
        areas: [N] their areas.
        footprints: [k] areas of the groups, in the same unit.
        groups: of the rows.
    """
    opacities = np.ascontiguousarray(opacities)
    threads = num_threads_or_default(None)
    return np.asarray(_core.stop_groups(opacities, areas, footprints, groups.rows, groups.begins, threads))
