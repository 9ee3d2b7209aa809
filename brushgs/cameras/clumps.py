"""Find the heaviest of several clumps that are so far apart that each is a dot seen from the other.

No view shows both, and a frame around both shows neither.
"""

import numpy as np

from brushgs.values.arrays import F64, Array, Mask

TAIL = 0.007  # share of the weight at each end of an axis that may be strays, which framing ignores
FAR = 50.0  # least width of a gap, over the joint extent of both sides
MOST_CUTS = 16


def heaviest_clump(means: Array, weights: Array, sample: slice = slice(None)) -> Mask | None:
    """Mask [N] of the heaviest clump; None if there is only one, apart from strays.

    Splits at gaps along the axes until there is none. Strays weigh at most `TAIL` at each end.

    Args:
        means: [N, 3] positions, world units.
        weights: [N] such as opacities, >= 0.
        sample: rows to search for gaps.
    """
    points, masses = means[sample].astype(np.float64), weights[sample].astype(np.float64)
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    for _ in range(MOST_CUTS):
        inside = ((points >= low) & (points <= high)).all(axis=1)
        gaps = [_gap_of(points[inside, axis], masses[inside]) for axis in range(3)]
        axis = int(np.argmax([gap[0] for gap in gaps]))
        share, at, is_upper = gaps[axis]
        if share <= FAR:
            break
        (low if is_upper else high)[axis] = at
    if np.isinf(low).all() and np.isinf(high).all():
        return None
    return np.asarray(((means >= low) & (means <= high)).all(axis=1))


def _gap_of(places: F64, weights: F64) -> tuple[float, float, bool]:
    """The widest gap between points on a line, strays left out.

    Returns:
        Its width over the joint extent of both sides, its middle, and whether the upper side weighs more.
    """
    order = np.argsort(places, kind="stable")
    mass = np.cumsum(weights[order])
    if len(order) < 2 or not mass[-1] > 0:
        return 0.0, 0.0, False
    first, last = np.searchsorted(mass, mass[-1] * np.array([TAIL, 1 - TAIL]))
    sorted_places = places[order][first : last + 1]
    if len(sorted_places) < 2:
        return 0.0, 0.0, False
    widths = np.diff(sorted_places)
    widest = int(np.argmax(widths))
    rest = (sorted_places[-1] - sorted_places[0]) - widths[widest]
    middle = 0.5 * (sorted_places[widest] + sorted_places[widest + 1])
    share = float(np.divide(widths[widest], rest)) if rest > 0 else 0.0
    return share, float(middle), bool(mass[first + widest] < 0.5 * mass[-1])
