"""Remove jitter from values over time: a bilateral mean over neighboring moments."""

import numpy as np

from brushgs.values.arrays import F32, F64, Mask

WINDOW = 3  # moments on each side
SECONDS = 0.1  # maximum distance in time
TREMBLING = 3.0  # tolerance as a factor of the measured noise
MOST_TREMBLING = 4.0  # maximum factor on the given tolerance: larger differences are motion


def steadied(values: F32, times: F64, tolerances: F64, is_there: Mask, most: float = MOST_TREMBLING) -> F32:
    """Weighted means over nearby moments, by similarity of values: removes noise, keeps fast motion.

    A moment whose value differs by the tolerance has weight 0.6, by three times as much 0.01: jumps are not
    smeared, and uniform motion is unchanged. The tolerance is raised to three times the measured noise, the
    median deviation from the mean of both neighbors, but to at most `most` times the given one.
    Source: Tomasi and Manduchi 1998, Bilateral filtering (there of images).

    Args:
        values: [T, m, D].
        times: [T] seconds, ascending.
        tolerances: [m] > 0, expected size of noise.
        is_there: [T, m] the moments that count; others keep their values.
        most: > 0, see above.
    """
    num = len(values)
    trembling = np.minimum(TREMBLING * _trembling(values, is_there), most * tolerances)
    tolerances = np.maximum(tolerances, trembling)
    result = values.copy()
    for at in range(num):
        sums = values[at].astype(np.float64)
        totals = np.ones(values.shape[1])
        for distance in range(1, WINDOW + 1):
            # Both sides or none: a one-sided mean lags or leads.
            if at < distance or at + distance >= num:
                break
            sides = at - distance, at + distance
            if max(abs(times[list(sides)] - times[at])) > SECONDS * 1.001:
                break
            away = [((values[side] - values[at]).astype(np.float64) ** 2).sum(axis=1) for side in sides]
            weights = np.exp(-0.5 * np.maximum(*away) / tolerances**2)
            weights *= is_there[sides[0]] & is_there[sides[1]] & is_there[at]
            for side in sides:
                sums += weights[:, None] * values[side]
            totals += 2 * weights
        result[at] = sums / totals[:, None]
    return result


def _trembling(values: F32, is_there: Mask) -> F64:
    """The noise of values, [m]: the median distance of a moment to the mean of its two neighbours.

    It is 0 for uniform motion, and for occasional jumps.
    """
    if len(values) < 3:
        return np.zeros(values.shape[1])
    away = np.linalg.norm(values[1:-1] - 0.5 * (values[:-2] + values[2:]), axis=2)
    away[~(is_there[:-2] & is_there[1:-1] & is_there[2:])] = np.inf  # sorted to the end
    away.sort(axis=0)
    counts = np.isfinite(away).sum(axis=0)
    middle = away[np.maximum(counts - 1, 0) // 2, np.arange(away.shape[1])]
    return np.where(counts > 0, np.where(np.isfinite(middle), middle, 0.0), 0.0).astype(np.float64)
