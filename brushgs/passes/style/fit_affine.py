"""The simplest affine map that explains the colors before and after an edit.

Robust: colors that the edit treats differently from most are set aside. Regularized: where the colors of a
scene leave the map open, as in a gray scene, no change is preferred, then a change of each channel alone,
then whatever the data require. So a map learned from few colors stays plausible for others. A map that does
not explain the edit is weakened to the share that holds for held-out colors.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.values.arrays import F64

CLIP = 2e-3  # half a step of 8 bits: values this close to 0 or 1 may have been clipped
ROUNDS = 12
FIRST_SCALE, LEAST_SCALE = 0.5, 2e-3  # scale of outliers, shrinking from round to round
SPREADS = 2.0  # inlier limit, in median differences
SAYS = 30.0  # independent colors that a scene counts as, if no map explains them
EXACT = 1e-6  # standard deviation of float32 rounding
SAME, CHANGED = 1 / 255, 4 / 255  # invisible differences, and visible ones
LEFT_ALONE = 0.05  # share of the weight left unchanged that shows an edit to be partial
EXPLAINED, PROVEN = 1.5 / 255, 0.75  # a map that leaves so little of so much of the weight is not validated
END = 1 / 3  # share of the weight held out at each end of each axis
LEAST_SHARE = 0.5  # share of the weight that a map must explain for the rest to be set aside


@dataclass(frozen=True, eq=False)
class AffineFit:
    """An affine map and how well it explains the data.

    Attributes:
        affine: [3, 4] as in `brushgs.values.style.StyleEdit`.
        known: [n, 3] of 0 or 1: 1 where the value after the edit was not clipped.
        kept: 0 to 1, the share of the best map in it; the rest is the identity.
    """

    affine: F64
    known: F64
    kept: float = 1.0


def fit_affine(before: F64, after: F64, weights: F64) -> AffineFit:
    """Fit an affine map.

    Args:
        before: [n, 3] colors, n >= 1.
        after: [n, 3] colors.
        weights: [n] >= 0, not all 0.
    """
    weights = weights / weights.sum()
    fit = _fit_all(before, after, weights)
    errors = np.abs(np.clip(after, 0, 1) - np.clip(_mapped(fit.affine, before), 0, 1)).max(axis=1)
    if weights @ (errors < EXPLAINED) >= PROVEN or (fit.affine == np.eye(3, 4)).all():
        return fit
    kept = _share_that_holds(before, after, weights)
    return AffineFit(np.eye(3, 4) + kept * (fit.affine - np.eye(3, 4)), fit.known, kept)


def _share_that_holds(before: F64, after: F64, weights: F64) -> float:
    """Share of a map, 0 to 1, that predicts held-out colors best.

    The ends of the principal axes of the colors are held out, one at a time: other scenes have colors beyond
    those of this one, where the extrapolation of a fit to steps or waves is arbitrary.
    """
    away = before - weights @ before
    axes = np.linalg.eigh((away.T * weights) @ away)[1]
    gained = total = 0.0
    for place in (away @ axes).T:
        order = np.argsort(place, kind="stable")
        below = np.empty(len(place))
        below[order] = np.cumsum(weights[order])
        for held in (below < END, below > 1 - END):
            if weights[held].sum() == 0 or weights[~held].sum() == 0:
                continue
            affine = _fit_all(before[~held], after[~held], weights[~held] / weights[~held].sum()).affine
            step = np.clip(_mapped(affine, before[held]), 0, 1) - before[held]
            gained += float(weights[held] @ (step * (after[held] - before[held])).sum(axis=1))
            total += float(weights[held] @ (step**2).sum(axis=1))
    return min(max(gained / total, 0.0), 1.0) if total > 0 else 0.0


def _fit_all(before: F64, after: F64, weights: F64) -> AffineFit:
    """The best map for all colors; weights sum to 1."""
    is_cut = (np.minimum(np.abs(after), np.abs(after - 1)) < CLIP) & (np.abs(after - before) > CLIP)
    known = np.where(is_cut, 0.0, 1.0)
    if (weights @ known).min() < LEAST_SHARE:
        known = np.ones_like(known)
    everyone = _solve(before, after, weights[:, None] * known)
    affine = _set_aside(before, after, weights, known, everyone)
    if _is_partial(before, after, weights, affine):
        affine = np.eye(3, 4)
    # A clipped value that the map would not clip is more than rounding: it counts against the map.
    predicted = _mapped(affine, before)
    known = np.maximum(known, (predicted > CLIP) & (predicted < 1 - CLIP))
    return AffineFit(affine, known)


def _is_partial(before: F64, after: F64, weights: F64, affine: F64) -> bool:
    """Whether an edit is one of some colors only: it leaves colors that the map would change.

    Its effect on those is no map for all colors, however many of them the scene has.
    """
    is_alone = np.abs(after - before).max(axis=1) < SAME
    predicted = np.clip(_mapped(affine, before), np.minimum(before, 0), np.maximum(before, 1))
    is_changed = np.abs(predicted - before).max(axis=1) > CHANGED
    return float(weights @ (is_alone & is_changed)) > LEFT_ALONE


def _set_aside(before: F64, after: F64, weights: F64, known: F64, start: F64) -> F64:
    """The map of the majority: Geman-McClure weights at a shrinking scale.

    If no map explains more than half of the weight, the fit to all colors is returned.
    Source: Black and Rangarajan 1996, On the unification of line processes (graduated non-convexity).
    """
    affine, scale = start, FIRST_SCALE
    for _ in range(ROUNDS):
        errors = np.sqrt((((after - _mapped(affine, before)) * known) ** 2).sum(axis=1))
        trust = (scale**2 / (scale**2 + errors**2)) ** 2
        if weights @ trust < LEAST_SHARE:
            return start
        affine = _solve(before, after, (weights * trust)[:, None] * known)
        spread = SPREADS * _median(errors, weights)
        scale = max(0.5 * scale, min(spread, scale), LEAST_SCALE)
    return affine


def _solve(before: F64, after: F64, weights: F64) -> F64:
    """[3, 4] weighted least squares, regularized toward the identity, then toward separate channels.

    Args:
        before: [n, 3].
        after: [n, 3].
        weights: [n, 3] of each value after.
    """
    columns = np.column_stack([before, np.ones(len(before)), after])
    is_same = bool((weights == weights[:, :1]).all())
    whole = np.zeros((3, 4))
    for channel in range(3):
        if channel == 0 or not is_same:
            moments = (columns * weights[:, channel, None]).T @ columns
            moments /= max(moments[3, 3], np.finfo(np.float64).tiny)
        rows = [*range(4), 4 + channel]
        held = np.eye(4)[channel]
        for some in ([channel, 3], [0, 1, 2, 3]):
            held = _ridge(moments[np.ix_(rows, rows)], some, held)
        whole[channel] = held
    return whole


def _ridge(moments: F64, some: list[int], prior: F64) -> F64:
    """[4] coefficients near `prior`; the residual sets the strength of the regularization.

    For exact data it is at rounding level; for data that no map explains it is as strong as `SAYS`
    independent colors.

    Args:
        moments: [5, 5] mean products of the columns before, 1, and the values after.
        some: columns whose coefficients may differ from `prior`.
        prior: [4].
    """
    of_left = np.append(-prior, 1.0)  # residuals of the prior, as a combination of columns
    gram = moments[np.ix_(some, some)]
    right = (moments @ of_left)[some]
    variance = float(of_left @ moments @ of_left)
    held = EXACT**2
    step = np.zeros(len(some))
    for _ in range(3):
        step = np.linalg.solve(gram + held / SAYS * np.eye(len(some)), right)
        held = max(variance - 2 * step @ right + step @ gram @ step, 0) + EXACT**2
    found = prior.copy()
    found[some] += step
    return found


def _mapped(affine: F64, colors: F64) -> F64:
    return np.asarray(colors @ affine[:, :3].T + affine[:, 3])


def _median(values: F64, weights: F64) -> float:
    """The weighted median."""
    order = np.argsort(values, kind="stable")
    totals = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(totals, 0.5 * totals[-1])]])
