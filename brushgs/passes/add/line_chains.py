"""Link edge points into chains: the ordered points of one line each.

Every point is linked to the best point before and after it along its edge if these links are mutual; ends
that face each other over a small gap are linked too. The paths are ordered by following all links at once,
twice as far with each step.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from brushgs.values.arrays import F64, Rows

REACH = 2.3  # px between points that are linked


def link(points: F64, normals: F64, *, gap: float, min_arm: int = 4) -> Rows:
    """Link points of edges.

    Args:
        points: [E, 2] pixels.
        normals: [E, 2] unit vectors across the edges, of either sign.
        gap: px, maximum gap between ends that face each other.
        min_arm: minimum points of a chain for a gap to be crossed.

    Returns:
        [E, 2] the two neighbors of each point, -1 for none.
    """
    if len(points) < 2:
        return np.full((len(points), 2), -1)
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    pairs = cKDTree(points).query_pairs(REACH, output_type="ndarray")
    links = _mutual(_best(points, tangents, pairs, straight=0.5))
    if gap > 0:
        links = _cross_gaps(points, links, gap, min_arm)
    return links


def _best(points: F64, tangents: F64, pairs: Rows, *, straight: float) -> Rows:
    """[E, 2] the point that continues each edge best, along its tangent and against it."""
    turn = np.abs(_dot(tangents[pairs[:, 0]], tangents[pairs[:, 1]]))
    pairs, turn = pairs[turn > 0.7], turn[turn > 0.7]
    offset = points[pairs[:, 1]] - points[pairs[:, 0]]
    distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    ahead, back = (_dot(offset, tangents[column]) / distance for column in pairs.T)
    is_good = (np.abs(ahead) > straight) & (np.abs(back) > straight)
    pairs = pairs[is_good]
    turn, distance, ahead, back = (v[is_good] for v in (turn, distance, ahead, back))
    cost = distance * (1 + 2 * (1 - np.abs(ahead)) + 2 * (1 - np.abs(back)) + (1 - turn))
    # Both ways: a point ahead of the first is behind the second.
    first, second = np.concatenate([pairs, pairs[:, ::-1]]).T
    is_behind = np.concatenate([ahead < 0, back > 0])
    cost = np.concatenate([cost, cost])
    rows = np.lexsort((second, cost))
    slot = first[rows] * 2 + is_behind[rows]
    links = np.full((len(points), 2), -1)
    slots, leading = np.unique(slot, return_index=True)
    links.reshape(-1)[slots] = second[rows[leading]]
    return links


def _dot(some: F64, others: F64) -> F64:
    """[P] products of vectors [P, 2]."""
    return np.asarray(some[:, 0] * others[:, 0] + some[:, 1] * others[:, 1])


def _mutual(links: Rows) -> Rows:
    """Mutual links, each with its own side."""
    rows = np.arange(len(links))[:, None]
    back = links[links]  # [E, 2, 2] the links of the linked
    wanted = (links >= 0) & (back == rows[:, :, None]).any(axis=2)
    links = np.where(wanted, links, -1)
    same = links[:, 0] == links[:, 1]
    links[same, 1] = -1
    back = links[links]
    return np.where((links >= 0) & (back == rows[:, :, None]).any(axis=2), links, -1)


def _cross_gaps(points: F64, links: Rows, gap: float, min_arm: int) -> Rows:
    """Link ends of chains that face each other."""
    ends = np.flatnonzero((links >= 0).sum(axis=1) == 1)
    if len(ends) < 2:
        return links
    slot = (links[ends, 0] < 0).astype(np.intp)  # of the only link
    at, before, long_enough = links[ends, slot], ends, np.ones(len(ends), bool)
    for _ in range(min_arm - 1):
        following = np.where(links[at, 0] == before, links[at, 1], links[at, 0])
        stays = following < 0
        long_enough &= ~stays
        before, at = np.where(stays, before, at), np.where(stays, at, following)
    out = points[ends] - points[at]
    out /= np.maximum(np.hypot(out[:, 0], out[:, 1]), 1e-9)[:, None]
    pairs = cKDTree(points[ends]).query_pairs(gap, output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    first, second = pairs[:, 0], pairs[:, 1]
    offset = points[ends[second]] - points[ends[first]]
    distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-9)
    ahead = _dot(offset, out[first]) / distance
    facing = -_dot(offset, out[second]) / distance
    is_near = distance < 3.0
    is_good = long_enough[first] & long_enough[second]
    is_good &= (np.minimum(ahead, facing) > np.where(is_near, 0.3, 0.75)) & (
        -_dot(out[first], out[second]) > 0.4
    )
    cost = distance * (1 + 3 * (1 - ahead) + 3 * (1 - facing))
    rows = np.flatnonzero(is_good)
    rows = rows[np.lexsort((second[rows], cost[rows]))]
    firsts, leading = np.unique(first[rows], return_index=True)
    best = np.full(len(ends), -1)
    best[firsts] = second[rows[leading]]
    has = np.flatnonzero(best >= 0)
    has = has[(best[best[has]] == has)]
    links = links.copy()
    links[ends[has], 1 - slot[has]] = ends[best[has]]
    return links


@dataclass(frozen=True, eq=False)
class Order:
    """Chains of linked points.

    Attributes:
        rows: [P] points, chain after chain, in order along each.
        chains: [P] chain of each point, from 0 on, ascending.
    """

    rows: Rows
    chains: Rows


def in_order(links: Rows) -> Order:
    """Order linked points [E, 2]; points without a link are dropped, circles are cut open."""
    links = _cut_circles(links)
    ends, distances = _follow(links)
    linked = np.flatnonzero((links >= 0).any(axis=1))
    # The two ends of a chain; it runs from the lower to the higher.
    low, high = ends[linked].min(axis=1), ends[linked].max(axis=1)
    to_low = np.where(ends[linked, 0] == low, distances[linked, 0], distances[linked, 1])
    order = np.lexsort((to_low, high, low))
    _, chains = np.unique(low[order], return_inverse=True)
    return Order(linked[order], chains)


def _steps_along(links: Rows) -> tuple[Rows, Rows, Rows]:
    """Of each state, a point and the side on which it is left: the point, the next point, the next state.

    At an end the next point is -1, and the next state is the same.
    """
    states = np.arange(2 * len(links))
    at, side = states // 2, states % 2
    following = links[at, side]
    entered = np.where(links[following, 0] == at, 0, 1)
    return at, following, np.where(following < 0, states, following * 2 + 1 - entered)


def _follow(links: Rows) -> tuple[Rows, Rows]:
    """[E, 2] the end point reached from each point over either link, and the steps to it.

    A circle has no end: then the result is any of its
    points, and the number of steps is at least the number of points.
    """
    num = len(links)
    _, following, jump = _steps_along(links)
    steps = (following >= 0).astype(np.intp)
    for _ in range(max(num, 1).bit_length()):
        steps = steps + steps[jump]
        jump = jump[jump]
    return (jump // 2).reshape(num, 2), steps.reshape(num, 2)


def _cut_circles(links: Rows) -> Rows:
    """Cut circles open at their first point."""
    num = len(links)
    at, following, jump = _steps_along(links)
    lowest, is_open = at.copy(), following < 0
    for _ in range(max(num, 1).bit_length()):
        lowest = np.minimum(lowest, lowest[jump])
        is_open = is_open | is_open[jump]
        jump = jump[jump]
    circle = ~is_open.reshape(num, 2).any(axis=1) & (links >= 0).all(axis=1)
    first = np.flatnonzero(circle & (lowest.reshape(num, 2).min(axis=1) == np.arange(num)))
    links = links.copy()
    other = links[first, 1]
    links[first, 1] = -1
    links[other] = np.where(links[other] == first[:, None], -1, links[other])
    return links
