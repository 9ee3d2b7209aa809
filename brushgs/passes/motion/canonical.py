"""Reduce a moving scene whose rows correspond to one set of Gaussians, with features of their motion.

Each row is taken at its reference moment, the first at which it is well visible. For most rows that is the
first moment, so the result looks like the start of the scene, and also holds what appears later. Strokes are
made of these Gaussians once, as for a still scene.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.motion.known import nearest_known
from brushgs.passes.reduce.features import contracted
from brushgs.values.arrays import F32, F64, Array, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.moving import MovingScene

MOST_LOOKS = 12  # moments at which positions are sampled for the features
MOST_SCANNED = 48  # moments at which opacities are sampled: what is visible for 1/48 of a clip is found
REFERENCE_SHARE = 0.5  # share of its largest opacity from which a row is well visible
VISIBLE_SHARE = 0.1  # the same for visible; positions of fainter rows, given by a formula, mean little
NEVER_SEEN = 1 / 255  # opacity below which no renderer draws
MOST_FEATURES = 7  # plus the nine of a still scene: the limit of the core
# Feature distances, in radii of the scene, of two Gaussians whose offset changes by a radius (RMS over the
# clip), and of two that are never visible together. Measured on cook_spinach at 2000 and 7000 strokes:
# members deviate from the motion of their stroke by 4 and 15 % less with a motion weight of 1, 23 and 36 %
# with 2, 34 and 44 % with 3. Changing pixels gain 0.1 and 0.0 dB with 1 and lose 0.2 and 0.1 with 2; others
# lose 0.2 with 2, 0.4 with 3, and another 0.2 with a life weight of 0.1.
MOTION_WEIGHT = 1.0
LIFE_WEIGHT = 0.05
ROWS_AT_A_TIME = 1 << 14  # rows of features before their reduction, 400 bytes each
LEAST_VARIANCE = 1e-8  # of a feature, squared radii; below it the feature is dropped


@dataclass(frozen=True, eq=False)
class Canonical:
    """A moving scene as one set of Gaussians.

    Attributes:
        gaussians: N Gaussians at their reference moments, with rows of the scene as ids, without rows that
            are never visible.
        features: [N, m <= 7] of their motion and visibility, for `group`; distances are in radii of the
            scene, like those of `cluster_features`.
        references: [N] reference moments, seconds.
    """

    gaussians: Gaussians
    features: F32
    references: F64


def canonical(scene: MovingScene, times: F64) -> Canonical:
    """The Gaussians of a moving scene at their reference moments.

    The reference moment of a row is the first of at most 48 evenly spaced times at which its opacity is at
    least half of its largest. Features are the offsets of a row from its position at the reference, and its
    visibility, at up to 12 moments; an invisible row takes the position of the nearest moment at which it is
    visible. They are reduced to at most 7 principal components, exactly if no more are needed. The result is
    deterministic.

    Args:
        scene: with rows that correspond.
        times: [T >= 1] seconds in the clip, ascending.

    Raises:
        ValueError: if rows do not correspond, or there are no times.
    """
    if not scene.has_rows:
        raise ValueError("canonical: rows must correspond at all times, got a scene without such rows")
    if len(times) == 0:
        raise ValueError("canonical: times must hold at least one moment, got none")
    scanned = times[_evenly(len(times), MOST_SCANNED)]
    looks = _evenly(len(scanned), MOST_LOOKS)
    first = scene.at(scanned[0])
    changes = np.ones(len(first), bool) if scene.resting is None else ~scene.resting
    if len(scanned) == 1:
        changes = np.zeros(len(first), bool)
    rows = np.flatnonzero(changes)
    opacities = np.empty((len(scanned), len(rows)), np.float32)
    places = np.empty((len(looks), len(rows), 3), np.float32)
    start = first.means[rows].astype(np.float64)
    for at, time in enumerate(scanned):
        moment = first if at == 0 else scene.at(time)
        opacities[at] = moment.opacities[rows]
        if (look := np.searchsorted(looks, at)) < len(looks) and looks[look] == at:
            places[look] = moment.means[rows] - start
    largest = opacities.max(axis=0)
    reference = np.zeros(len(first), np.intp)
    reference[rows] = (opacities >= REFERENCE_SHARE * largest).argmax(axis=0)
    gaussians = _at_references(scene, scanned, first, reference)
    shares = opacities[looks] / np.maximum(largest, NEVER_SEEN)
    places -= (gaussians.means[rows] - start).astype(np.float32)
    _hold_nearest(places, shares >= VISIBLE_SHARE)
    is_seen = first.opacities >= NEVER_SEEN
    is_seen[rows] = largest >= NEVER_SEEN
    features = np.zeros((len(first), 0), np.float32)
    if len(rows):
        lengths = contracted(gaussians.means)[1][rows]
        found = _features(places, shares, lengths, largest)
        features = np.zeros((len(first), found.shape[1]), np.float32)
        features[rows] = found
    return Canonical(gaussians.take(is_seen), features[is_seen], scanned[reference[is_seen]])


def features_of(found: Canonical, gaussians: Gaussians) -> F32:
    """The features [n, m] of Gaussians taken from those of `canonical`, by their ids."""
    return np.asarray(found.features[_places(found, gaussians)])


def uncut(found: Canonical, gaussians: Gaussians) -> Gaussians:
    """Gaussians, or pieces of them, with the means and scales of the rows of the scene in their ids."""
    of_scene = found.gaussians.take(_places(found, gaussians))
    return replace(gaussians, means=of_scene.means, scales=of_scene.scales)


def _places(found: Canonical, gaussians: Gaussians) -> Rows:
    known, asked = found.gaussians.ids, gaussians.ids
    assert known is not None, "they have the rows of the scene"
    assert asked is not None, "and so have those that were taken from them"
    return np.searchsorted(known, asked)


def _evenly(num: int, most: int) -> Rows:
    """At most `most` evenly spaced indices below `num`, including the first and the last."""
    count = min(num, most)
    return np.unique(np.rint(np.linspace(0, num - 1, count)).astype(np.intp))


def _at_references(scene: MovingScene, times: F64, first: Gaussians, reference: Rows) -> Gaussians:
    columns = first.columns()
    later = np.unique(reference[reference > 0])
    if len(later):
        columns = {name: column.copy() for name, column in columns.items()}
    for at in later:
        moment, rows = scene.at(times[at]), np.flatnonzero(reference == at)
        for name, column in columns.items():
            column[rows] = getattr(moment, name)[rows]
    return replace(first, **columns, ids=np.arange(len(first), dtype=np.int32))


def _hold_nearest(values: Array, is_known: Mask) -> None:
    """Fill unknown values [L, n, ...] in place with the nearest known one in time.

    Of two equally near ones it is the earlier; columns without any are set to 0.
    """
    columns = np.flatnonzero(~is_known.all(axis=0))
    nearest = nearest_known(is_known[:, columns], np.arange(float(len(values))))
    held = values[np.maximum(nearest, 0), columns]
    held[:, ~np.asarray(is_known.any(axis=0))[columns]] = 0
    values[:, columns] = held


def _features(places: F32, shares: F32, lengths: F64, weights: F32) -> F32:
    """Principal components [n, m] of offsets from the reference [L, n, 3] and visibility [L, n]."""
    num_looks, num = shares.shape
    blocks = [slice(first, first + ROWS_AT_A_TIME) for first in range(0, num, ROWS_AT_A_TIME)]
    total, mean, squares = 0.0, np.zeros(4 * num_looks), np.zeros((4 * num_looks, 4 * num_looks))
    for some in blocks:
        points = _points(places[:, some], shares[:, some], lengths[some])
        weighted = points * weights[some, None]
        total += float(weights[some].sum(dtype=np.float64))
        mean += weighted.sum(axis=0)
        squares += weighted.T @ points
    mean /= max(total, 1e-300)
    variances, axes = np.linalg.eigh(squares / max(total, 1e-300) - np.outer(mean, mean))
    chosen = np.flatnonzero(variances > LEAST_VARIANCE)[::-1][:MOST_FEATURES]
    axes = axes[:, chosen]
    axes *= np.sign(axes[np.abs(axes).argmax(axis=0), np.arange(len(chosen))])
    found = np.empty((num, len(chosen)), np.float32)
    for some in blocks:
        found[some] = (_points(places[:, some], shares[:, some], lengths[some]) - mean) @ axes
    return found


def _points(places: F32, shares: F32, lengths: F64) -> F64:
    """The features before their reduction, [n, 4 L]."""
    num_looks, num = shares.shape
    away = places * lengths
    # Clamped to a radius: a row that flies to infinity must not dominate all components.
    away /= np.maximum(np.linalg.norm(away, axis=2, keepdims=True), 1)
    moved = away.transpose(1, 0, 2).reshape(num, 3 * num_looks)
    both = np.concatenate([MOTION_WEIGHT * moved, LIFE_WEIGHT * shares.T], axis=1)
    return np.asarray(both / np.sqrt(num_looks))
