"""Choose the chains of a picture that are worth a line: long or strong, without the zigzag of texture.

The limit depends on the picture: a face has few and faint edges, a truck has many. So faint lines are drawn
only if a picture has few.
"""

import numpy as np
from scipy.spatial import cKDTree

from brushgs.passes.add.line_windows import Along
from brushgs.values.arrays import F64

SHORTEST = 20.0  # px
WORTH = 4.5  # px x strength: 40 px of 1/8
ENOUGH = 0.3  # maximum strength that counts: a short line of high contrast is still short
PEAK = 0.1  # strength that a line must have somewhere
ZIGZAG = 0.03  # radians of zigzag per px that halve the strength
RANGE = (0.5, 1.4)  # of the minimum importance that is drawn: in an empty picture, and in a full one
CLOSE, LESSER, MOSTLY = 5.0, 2.0, 0.6  # px, factor of importance, share of a chain: of a double
AMOUNT = 4300.0  # px of lines that a picture should have


def importance(points: F64, strengths: F64, steps: F64, along: Along) -> F64:
    """[C] importance of each chain, about 1 for the faintest that is drawn.

    Args:
        points: [P, 2] px, smooth.
        strengths: [P] of the edge.
        steps: [P] see `EdgePoints`; a clear outline may zigzag, as that of fur.
        along: their chains.
    """
    lengths = along.totals(along.lengths(points))
    outline = np.clip(3 * along.means(steps) - 2, 0, 1) * np.clip(10 * along.means(strengths) - 1.5, 0, 1)
    factor = 1 / (1 + ((1 - outline) * zigzag(points, along) / ZIGZAG) ** 2)
    mean = along.mean(strengths, 4)
    worth = along.totals(np.minimum(mean, ENOUGH) * along.lengths(points))
    peak = np.zeros(along.num)
    np.maximum.at(peak, along.chains, mean)
    return np.where(lengths >= SHORTEST, factor * np.minimum(worth / WORTH, peak / PEAK), 0)


def without_doubles(importances: F64, points: F64, strengths: F64, along: Along) -> F64:
    """[C] importances, 0 for chains that run close beside much longer or stronger ones.

    Such chains come from rows of Gaussians on a surface seen from the side, and from shade along an outline.
    """
    kept = np.flatnonzero(importances[along.chains] >= RANGE[0])
    chains = along.chains[kept]
    first, second = cKDTree(points[kept]).query_pairs(CLOSE, output_type="ndarray").T
    weights = along.totals(strengths)[chains]
    lesser = np.concatenate(
        [some[LESSER * weights[some] < weights[other]] for some, other in ((first, second), (second, first))]
    )
    is_close = np.zeros(len(along))
    is_close[kept[lesser]] = 1
    return np.where(along.means(is_close) > MOSTLY, 0, importances)


def least_drawn(points: F64, importances: F64, along: Along) -> float:
    """The minimum importance of drawn chains: lower in a picture with few chains.

    Args:
        points: [P, 2] px, smooth.
        importances: [C] of the chains.
        along: their chains.
    """
    lengths = along.totals(along.lengths(points))
    order = np.argsort(-importances, kind="stable")
    too_many = order[np.cumsum(lengths[order]) > AMOUNT]
    return float(np.clip(importances[too_many[0]] if len(too_many) else 0, *RANGE))


def zigzag(points: F64, along: Along) -> F64:
    """Radians of zigzag per px of each chain: its total turning minus its net turning."""
    ahead, behind = points[along.near(3)] - points, points - points[along.near(-3)]
    cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
    turn = np.arctan2(cross, (behind * ahead).sum(axis=1)) / 3
    lengths = np.maximum(along.totals(along.lengths(points)), 1)
    return (along.totals(np.abs(turn)) - np.abs(along.totals(turn))) / lengths
