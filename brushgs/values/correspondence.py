"""Decide whether the rows of two moments correspond, and interpolate between such moments."""

from dataclasses import replace
from typing import Any

import numpy as np

from brushgs.values.arrays import F32, F64, Array, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import normalized


def between(first: Gaussians, second: Gaussians, share: float) -> Gaussians:
    """Interpolate between two moments whose rows correspond; `share` is 0 (first) to 1 (second).

    Centers, scales, opacities and colors are interpolated linearly; rotations along the shorter arc, as
    linear mixtures of quaternions. Brushes are those of the first.
    """
    num_terms = max(first.sh.shape[1], second.sh.shape[1])
    second_quats = normalized(second.quats)
    first_quats = normalized(first.quats)
    second_quats *= np.where(np.sum(first_quats * second_quats, axis=1) < 0, -1.0, 1.0)[:, None]
    pairs = {name: (getattr(first, name), getattr(second, name)) for name in ("means", "scales", "opacities")}
    pairs |= {"quats": (first_quats, second_quats)}
    pairs |= {"sh": (_padded(first.sh, num_terms), _padded(second.sh, num_terms))}
    lines: dict[str, Any] = {name: _line(*pair, share) for name, pair in pairs.items()}
    return replace(first, **lines)


def _line(first: Array, second: Array, share: float) -> F32:
    return ((1 - share) * first + share * second).astype(np.float32, copy=False)


def _padded(sh: Array, num_terms: int) -> Array:
    """Pad SH coefficients with zeros to `num_terms` terms."""
    missing = num_terms - sh.shape[1]
    return np.pad(sh, ((0, 0), (0, missing), (0, 0))) if missing else sh


_NUM_ROWS = 4096  # rows that are compared
_LEAST_NEARER = 0.8  # share of rows; a third by chance
_FLOOR = 1e-3  # in median distances of random rows: smaller distances count as equal
_OUTER = 5.0, 95.0  # percentiles of positions; the rest is ignored as floaters
_LEAST_OVERLAP = 0.5
_THINNEST = 0.05  # least thickness of a box over its longest side, so that flat objects overlap too
_MOST_GROWTH = 1.5  # ratio of row counts between moments; levels of detail differ by more
_TINY = 1e-30


def have_same_rows(first: Gaussians, second: Gaussians) -> bool:
    """Whether row i of one moment is the same Gaussian as row i of another moment, near in time.

    The numbers of rows must be equal, and row i of the first must be nearer to row i of the second than to
    two other rows of it: a random one, and row i + 1, its neighbor in files sorted in space. The distance is
    the product of the distances in position, log scale, rotation, color and opacity, each relative to the
    median distance of random rows. So one property that stays (the color of an object that flies, the
    position of one that fades) identifies rows, however much the others change. Positions are relative to the
    scene, which may move and grow as a whole. At least four of five of up to 4096 rows must be nearer; in a
    shuffled file one of three is, and one of two if a few rows are missing.
    """
    if len(first) != len(second):
        return False
    rng = np.random.default_rng(0)
    rows, at_random = (rng.permutation(len(first))[:_NUM_ROWS] for _ in range(2))
    ours, theirs = _features(first, rows, rows), _features(second, rows, rows)
    strangers = [_features(second, others, rows) for others in (at_random, (rows + 1) % max(len(first), 1))]
    is_nearer, is_decided = np.ones(len(rows), bool), np.zeros(len(rows), bool)
    for others in strangers:
        score = np.zeros(len(rows))
        for name in ours:
            own, other, any_two = (
                _distances(name, ours[name], f[name]) for f in (theirs, others, strangers[0])
            )
            usual = float(np.median(any_two)) if len(rows) else 0.0
            if usual > _TINY:  # otherwise it is equal in most rows, and identifies none
                score += np.log((own + _FLOOR * usual) / (other + _FLOOR * usual))
        is_tie = np.abs(score) < 1e-9
        is_nearer &= is_tie | (score < 0)
        is_decided |= ~is_tie
    if not is_decided.any():
        return True
    return bool(is_nearer[is_decided].mean() >= _LEAST_NEARER)


def are_in_one_place(first: Gaussians, second: Gaussians) -> bool:
    """Whether two files hold about as many Gaussians, in boxes that overlap by half of their union.

    Boxes are those of 90 % of the Gaussians along each axis.
    """
    counts = sorted([len(first), len(second)])
    if counts[1] > _MOST_GROWTH * counts[0]:
        return False
    low, high = np.stack([np.percentile(moment.means, _OUTER, axis=0) for moment in (first, second)], axis=1)
    thin = np.maximum(_THINNEST * (high - low).max(), _TINY) / 2
    low, high = low - thin, high + thin
    common = np.prod(np.maximum(high.min(axis=0) - low.max(axis=0), 0))
    volumes = np.prod(high - low, axis=1)
    return bool(common >= _LEAST_OVERLAP * (volumes.sum() - common))


def _features(moment: Gaussians, rows: Rows, sample: Rows) -> dict[str, F64]:
    """Properties to compare, [len(rows), m] each; positions are relative to the median of a sample."""
    means, sample_means = (moment.means[some].astype(np.float64) for some in (rows, sample))
    if len(sample):
        center = np.median(sample_means, axis=0)
        means = (means - center) / max(float(np.median(np.abs(sample_means - center).max(axis=1))), _TINY)
    return {
        "means": means,
        "scales": np.log(np.maximum(moment.scales[rows].astype(np.float64), _TINY)),
        "quats": normalized(moment.quats[rows]),
        "sh": moment.sh[rows, 0].astype(np.float64),
        "opacities": moment.opacities[rows, None].astype(np.float64),
    }


def _distances(name: str, ours: F64, theirs: F64) -> F64:
    if name == "quats":  # q and -q are the same
        return np.asarray(1 - np.minimum(np.abs(np.sum(ours * theirs, axis=1)), 1))
    return np.asarray(np.linalg.norm(ours - theirs, axis=1))


def unmoved(first: Gaussians, second: Gaussians) -> Mask:
    """Mask of rows that are equal in two moments whose rows correspond."""
    is_same = np.ones(len(first), bool)
    for name, column in first.columns().items():
        other = getattr(second, name)
        if column.shape != other.shape:
            return np.zeros(len(first), bool)
        is_same &= (column == other).reshape(len(first), -1).all(axis=1)
    return is_same
