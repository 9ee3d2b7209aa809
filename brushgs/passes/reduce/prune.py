"""Gaussians -> those that contribute most to pictures, in their order."""

import numpy as np
from numpy.typing import NDArray

from brushgs.core.native import core as _core
from brushgs.core.threads import num_threads_or_default
from brushgs.options.choices import Weight
from brushgs.options.painting import DEFAULT_KEEP
from brushgs.options.table import parse_share
from brushgs.passes.reduce.contribution import contributions
from brushgs.passes.reduce.features import contracted
from brushgs.values.arrays import Mask
from brushgs.values.colors import LUMINANCE
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors


def prune(
    gaussians: Gaussians,
    keep: float | str | None = None,
    *,
    weight: Weight = "contribution",
    at_least: int = 1,
    among: Mask | None = None,
) -> Gaussians:
    """Keep the Gaussians of highest weight.

    "contribution" is opacity x mean projected area x the share of directions from which the Gaussian is
    visible. Among neighbors of equal contribution, dropped rows are spread between kept ones, so that the
    cover thins evenly. With 50 % of the rows, the PSNR of the plain picture to that of the whole scene on
    koala, chair, truck, skull and biker is 37.7, 31.3, 28.3, 31.3 and 36.0 dB by contribution; without the
    spread 38.2, 31.3, 27.8, 30.8 and 35.5; and without the visible share 29.9, 31.1, 27.9, 28.2 and 33.0.
    With 70 % of a plane of equal Gaussians it is 28.3 dB, without the spread 17.3. "paper" is the published
    intensity, opacity x trace of the covariance x luminance, which drops black Gaussians first and keeps
    hidden ones; nothing is spread.
    Source: Xiang et al. 2025, section 3.2.1.

    Args:
        gaussians: N Gaussians.
        keep: share of the rows to keep, in (0, 1] or in percent such as "70%", rounded to whole rows, at
            least one. None for 0.7, or more if the rest would hold more than 5 % of all contributions (not
            with "paper").
        weight: "contribution" or "paper".
        at_least: minimum number of rows to keep.
        among: [N] mask of rows that may be dropped; `keep` is a share of these. None for all.

    Returns:
        The kept rows in input order; among equal weights at one place, earlier rows stay. The input itself if
        all rows stay.

    Raises:
        ValueError: if `keep` is out of range or `weight` is unknown.

    Example:
        >>> kept = bg.prune(gaussians, "30%")
        >>> len(kept) == round(0.3 * len(gaussians))
        True
    """
    if isinstance(keep, str):
        try:
            keep = parse_share(keep)
        except ValueError as error:
            raise ValueError(f"prune: keep {error}") from None
    if keep is not None and not 0 < keep <= 1:
        cure = f"; for {keep:g} % write {keep / 100:g}" if 1 < keep <= 100 else ""
        raise ValueError(f"prune: keep must be in (0, 1], got {keep}{cure}")
    if weight not in ("contribution", "paper"):
        raise ValueError(f"prune: weight must be 'contribution' or 'paper', got {weight!r}")
    share = DEFAULT_KEEP if keep is None else keep
    rows = np.ones(len(gaussians), bool) if among is None else among
    num = int(np.count_nonzero(rows))
    num_kept = max(1, at_least, int(np.floor(share * num + 0.5)))
    if num_kept >= num:
        return gaussians
    if weight == "paper":
        ranked = intensities(gaussians)[rows]
    else:
        weights = contributions(gaussians)
        ranked = spread(weights, gaussians)[rows]
        if keep is None:
            num_kept = max(num_kept, num - num_spare(weights[rows], ranked))
    if num_kept == num:
        return gaussians
    is_kept = ~rows
    is_kept[rows] = highest(ranked, num_kept)
    return gaussians.take(is_kept)


def spread(weights: NDArray[np.float64], gaussians: Gaussians) -> NDArray[np.float64]:
    """The weights [N] times 1/4 to 4, varying along the Morton curve of the positions."""
    places = contracted(gaussians.means)[0]
    return np.asarray(_core.spread_weights(weights, places, num_threads_or_default(None)))


def num_spare(weights: NDArray[np.float64], ranked: NDArray[np.float64]) -> int:
    """Number of lowest-ranked rows that together hold at most 5 % of the weights."""
    return int(_core.count_spare(weights, ranked, num_threads_or_default(None)))


def intensities(gaussians: Gaussians) -> NDArray[np.float64]:
    """The published importance: opacity x trace of the covariance x luminance of the base color, [N]."""
    traces = sum(gaussians.scales[:, axis].astype(np.float64) ** 2 for axis in range(3))
    return np.asarray(gaussians.opacities * traces * (base_colors(gaussians.sh) @ LUMINANCE))


def highest(weights: NDArray[np.float64], count: int) -> NDArray[np.bool_]:
    """Mask of the `count` highest weights; ties go to earlier rows."""
    is_kept = np.empty(len(weights), np.uint8)
    _core.mark_highest(np.ascontiguousarray(weights, np.float64), count, is_kept)
    return is_kept.view(bool)
