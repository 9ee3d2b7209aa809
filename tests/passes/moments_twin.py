"""What the core computes of merged Gaussians, in NumPy, float64: short, slow and obvious."""

import numpy as np

THOMSEN = 1.6075


def areas(scales):
    unit = scales.max(axis=1, initial=0).astype(np.float64)
    unit[unit == 0] = 1
    a, b, c = scales.T / unit
    mean = ((a * b) ** THOMSEN + (a * c) ** THOMSEN + (b * c) ** THOMSEN) / 3
    return mean ** (1 / THOMSEN) * unit**2


def within_and_between(scene, own, means, shares, labels):
    """`own` [N, 3, 3] are the covariances of the members."""
    within, between = np.zeros((2, len(means), 3, 3))
    away, shares = scene.means - means[labels], shares[:, None, None]
    np.add.at(within, labels, shares * own)
    np.add.at(between, labels, shares * away[:, :, None] * away[:, None])
    return within, between


def shares_by_label(weights, labels, num):
    """Weights over their sum by label; equal weights if that sum is zero."""
    weights = np.where((np.bincount(labels, weights, num) == 0)[labels], 1.0, weights)
    return weights / np.bincount(labels, weights, num)[labels]


def stopped(opacities, own_areas, footprints, labels):
    passed = np.ones(len(footprints))
    for opacity, area, label in zip(opacities, own_areas, labels, strict=True):
        passed[label] *= 1 - opacity * (min(1, area / footprints[label]) if footprints[label] > 0 else 1)
    return 1 - passed


def squared_distance(row, other, means, scales, axes):
    """Squared Mahalanobis distance of a center to another stroke, along the thinnest axis of the first."""
    unit = scales[other, 2] if scales[other, 2] > 0 else 1.0
    in_layer = axes[row][:, 1:].T
    factors = in_layer @ (axes[other] * (scales[other] / unit))
    with np.errstate(over="ignore"):
        x, y = in_layer @ np.clip((means[row] - means[other]) / unit, -1e6, 1e6)
    (xx, xy), (_, yy) = factors @ factors.T
    area = max(xx * yy - xy * xy, 1e-12 * (xx + yy) ** 2)
    return max(yy * x * x - 2 * xy * x * y + xx * y * y, 0) / area if area > 0 else np.inf


def passed_by(means, scales, axes, opacities, neighbors):
    """Light that passes the others at the center of each."""
    passed = np.ones(len(means))
    for row, others in enumerate(neighbors):
        for other in others:
            if other != row:
                away = squared_distance(row, other, means, scales, axes)
                passed[row] *= 1 - opacities[other] * np.exp(-0.5 * away)
    return passed
