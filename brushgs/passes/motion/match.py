"""Match the Gaussians of two moments, in any row order, and estimate the motion of the scene.

First guesses (`guesses`) give rough motions of bodies; each of a few hundred nodes takes the one that best
fits its surroundings. Pairs that look alike and lie near each other then refine the nodes in rounds of
shrinking reach: a field of affine maps, as in embedded deformation. Finally each Gaussian is searched for
where the field moves it, and unmatched ones where their neighbors went.
Source: Besl and McKay 1992, A method for registration of 3-D shapes (iterative closest points); Lowe 2004,
Distinctive image features (ratio to the second-best match); Sumner et al. 2007, Embedded deformation (nodes,
blended by distance).
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.motion.appearance import Appearance, among, mutual_nearest
from brushgs.passes.motion.guesses import Motion, affine, guesses, turns_tried
from brushgs.passes.motion.matter import means_by_label
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.lloyd import start
from brushgs.values.arrays import F64, Mask, Rows

NUM_NODES = 300
ROWS_A_NODE = 30  # minimum
NUM_BLENDED, NUM_FITTED, NUM_SMOOTHED = 4, 3, 9  # nodes: of a point, of a pair, around a node
NUM_SAMPLED, NUM_JUDGED = 5000, 1500  # Gaussians that fit the field, and that judge guesses
COLOR_APART, MOTION_APART = 0.2, 4.0  # weights of color and last motion in distances to nodes, in radii
# Lengths in spacings. Guesses are compared at the unit `COARSE`; rounds shrink to `LEAST_REACH`.
COARSE, FIRST_REACH, MOST_REACH, LEAST_REACH, SHRINK = 8.0, 12.0, 100.0, 1.5, 0.65
MOST_AWAY = 2.0  # the next reach is at most `LEAST_REACH` plus this times the 90 % quantile of distances
FAR = 1.5  # maximum distance that counts against a guess, in its units
POOR = 1.1  # mean distance of the best guesses above which turns are tried
GUESS_BIAS = 0.9  # factor of the costs of rest and of the best guess overall: others must be clearly better
CLEAR_POWER = 4  # of 1 - (distance of a pair / that of the second best) squared
NUM_TIGHT = 2  # final rounds with squared Cauchy weights, which fit agreeing pairs exactly
PRIOR, TIGHT_PRIOR = 0.02, 1e-3  # regularisation of a node towards its previous matrix
LOOKS_WEIGHT = 2.0  # of looks in the final search, relative to one spacing
REACH_LOOKS_WEIGHT = 3.0  # the same relative to a quarter of `MOST_REACH`, when choosing the first reach
NEAR = 2.0  # spacings from the expected position; farther Gaussians are not the same
NORMAL_COST, LOOKS_COST = 1.0, 0.75  # weights of differences of normals and looks, relative to one spacing
NUM_SPREADS, NUM_SPREADING = 4, 6  # rounds of spreading pairs to unmatched Gaussians; neighbors tried


@dataclass(frozen=True, eq=False)
class Match:
    """Correspondence of the Gaussians of two moments.

    Attributes:
        places: [n, 3] predicted positions now of the Gaussians before, world units.
        was: [m] for each Gaussian now, the most similar row before.
        is_same: [m] whether the two match: mutual nearest neighbors, and near.
        steps: [m, 3] displacement of each Gaussian now, world units.
        motion: affine motion of the whole scene; None if too few match.
    """

    places: F64
    was: Rows
    is_same: Mask
    steps: F64
    motion: Motion | None

    @property
    def share(self) -> float:
        """Share of the Gaussians now that are matched."""
        return float(self.is_same.mean()) if len(self.is_same) else 0.0


def match(before: Appearance, after: Appearance, last: Match | None = None) -> Match:
    """Match the Gaussians of one moment to those of another.

    Args:
        before: n >= 1 Gaussians.
        after: m >= 1.
        last: the match that led to `before`, whose motion may continue; None if unknown.
    """
    rng, after = np.random.default_rng(0), after.in_light_of(before)
    sample = before.order[np.sort(rng.permutation(len(before))[:NUM_SAMPLED])]
    flow = _fitted(_first_flow(before, after, last, sample, rng), after, sample)
    places = flow.places()
    keys = after.keys(after.places(places), before.looks, 1.0, LOOKS_WEIGHT)
    targets = after.keys(after.own_places, after.looks, 1.0, LOOKS_WEIGHT)
    is_now, was = np.empty(len(before), np.intp), np.empty(len(after), np.intp)
    is_now[before.order] = among(keys[before.order], targets)[1]
    was[after.order] = among(targets[after.order], keys)[1]
    is_same = is_now[was] == np.arange(len(after))
    is_same &= _costs(flow, after, places, was) < NEAR
    motion = None
    if np.count_nonzero(is_same) >= NUM_SPREADING:
        x, y = before.means[was[is_same]], after.means[is_same]
        motion = affine(x, y, np.ones(len(x)))
        _spread(before, after, motion, places, was, is_same)
    steps = after.means - before.means[was]
    steps[~is_same] = (places - before.means)[was[~is_same]]
    return Match(places, was, is_same, steps, motion)


@dataclass(frozen=True, eq=False)
class _Flow:
    """Motion of the Gaussians of a moment: blended affine maps of K nodes.

    Attributes:
        before: the moment, n Gaussians.
        around: [n, 4] the nodes that move each Gaussian, nearest first.
        shares: [n, 4] their weights.
        centers: [K, 3] of the nodes, world units.
        neighbours: [K, 9] the nearest nodes of each node, itself first.
        matrices: [K, 3, 3] of the affine maps.
        shifts: [K, 3] of the affine maps, world units.
    """

    before: Appearance
    around: Rows
    shares: F64
    centers: F64
    neighbours: Rows
    matrices: F64
    shifts: F64

    def places(self, rows: Rows | slice = slice(None)) -> F64:
        """Positions of some Gaussians at the later moment, [q, 3]."""
        around, means = self.around[rows], self.before.means[rows]
        moved = np.einsum("nkij,nj->nki", self.matrices[around], means) + self.shifts[around]
        return np.asarray(np.einsum("nk,nki->ni", self.shares[rows], moved))

    def fitted(self, sample: Rows, y: F64, weights: F64, prior: float) -> "_Flow":
        """The flow fitted to later positions `y` [q, 3] of a sample [q], regularised towards this flow."""
        x, num, nodes = self.before.means[sample], len(self.centers), self.around[sample, :NUM_FITTED]
        labels, times = nodes.T.ravel(), nodes.shape[1]
        weights = np.tile(weights, times)

        def means_of(values: F64) -> F64:
            return means_by_label(labels, weights, np.tile(values, (times, 1)), num)

        mean_x, mean_y = means_of(x), means_of(y)
        # Relative to the mean: squares of large coordinates would lose all digits.
        center_x, center_y = x.mean(axis=0), y.mean(axis=0)
        from_x, from_y, x_of_node, y_of_node = (
            x - center_x,
            y - center_y,
            mean_x - center_x,
            mean_y - center_y,
        )
        spread = means_of((from_x[:, :, None] * from_x[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
        crossed = means_of((from_y[:, :, None] * from_x[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)
        spread -= x_of_node[:, :, None] * x_of_node[:, None, :]
        crossed -= y_of_node[:, :, None] * x_of_node[:, None, :]
        totals = np.bincount(labels, weights, num)
        kept = prior * np.trace(spread, axis1=1, axis2=2) / 3
        told = np.flatnonzero((totals > 1e-2 * np.median(totals)) & (kept > 0))
        left = spread[told] + kept[told, None, None] * np.eye(3)
        right = crossed[told] + kept[told, None, None] * self.matrices[told]
        matrices, shifts = self.matrices.copy(), self.shifts.copy()
        matrices[told] = np.linalg.solve(left, right.transpose(0, 2, 1)).transpose(0, 2, 1)
        shifts[told] = mean_y[told] - np.einsum("nij,nj->ni", matrices[told], mean_x[told])
        return replace(self, matrices=matrices, shifts=shifts)

    def smoothed(self) -> "_Flow":
        """The flow with each node set to the median of the motions of its neighborhood at its center."""
        moved = np.einsum("nkij,nj->nki", self.matrices[self.neighbours], self.centers)
        middle = np.median(moved + self.shifts[self.neighbours], axis=1)
        matrices = np.median(self.matrices[self.neighbours], axis=1)
        shifts = middle - np.einsum("nij,nj->ni", matrices, self.centers)
        return replace(self, matrices=matrices, shifts=shifts)


def _first_flow(
    before: Appearance, after: Appearance, last: Match | None, sample: Rows, rng: np.random.Generator
) -> _Flow:
    """A flow in which each node has the guess that fits it best."""
    columns = [before.centered, COLOR_APART * before.looks[:, 3:]]
    if last is not None:
        columns.append(MOTION_APART * last.steps / before.frame[1])
    points = np.concatenate(columns, axis=1)
    count = max(1, min(NUM_NODES, len(before) // ROWS_A_NODE))
    nodes = start(points[sample].astype(np.float32), np.ones(len(sample)), count)
    num = len(nodes)
    distances, around = nearest(nodes, points, min(NUM_BLENDED, num))
    width = 1.5 * max(float(np.median(distances[:, 0])), 1e-9)
    shares = np.exp(-0.5 * ((distances**2 - distances[:, :1] ** 2) / width**2))
    shares /= shares.sum(axis=1, keepdims=True)
    neighbours = nearest(nodes, nodes, min(NUM_SMOOTHED, num))[1]
    labels, ones = around[sample, 0], np.ones(len(sample))
    centers = means_by_label(labels, ones, before.means[sample], num)

    motions: list[Motion] = [(np.eye(3), np.zeros(3))]
    motions += [] if last is None or last.motion is None else [last.motion]
    motions += guesses(before, after, rng)
    tried = [(np.tile(matrix, (num, 1, 1)), np.tile(shift, (num, 1))) for matrix, shift in motions]
    if last is not None:  # each node continues its own last motion
        tried.append((tried[0][0], means_by_label(labels, ones, last.steps[sample], num)))
    targets = after.keys(after.own_places, after.looks, COARSE)
    judges = sample[:: max(1, len(sample) // NUM_JUDGED)]
    of_judge = around[judges, 0]

    def away(maps: tuple[F64, F64]) -> F64:
        """Distance of each judge to the most similar Gaussian, at most `FAR`, [q]."""
        moved = np.einsum("nij,nj->ni", maps[0][of_judge], before.means[judges]) + maps[1][of_judge]
        keys = after.keys(after.places(moved), before.looks[judges], COARSE)
        return np.minimum(among(keys, targets)[0], FAR)

    all_away = [away(maps) for maps in tried]
    if np.min(all_away, axis=0).mean() > POOR:
        more = turns_tried(before, after, rng)
        tried += [(np.tile(matrix, (num, 1, 1)), np.tile(shift, (num, 1))) for matrix, shift in more]
        all_away += [away(maps) for maps in tried[-len(more) :]]
    whole = np.mean(all_away, axis=1)
    whole[0] *= GUESS_BIAS
    by_node = np.stack([np.bincount(of_judge, values, num) for values in all_away])
    counts = np.bincount(of_judge, minlength=num)
    by_node = by_node[:, neighbours].sum(axis=2) / np.maximum(counts[neighbours].sum(axis=1), 1)
    by_node[whole.argmin()] *= GUESS_BIAS
    chosen = by_node.argmin(axis=0), np.arange(num)
    matrices, shifts = (np.stack([maps[part] for maps in tried])[chosen] for part in (0, 1))
    return _Flow(before, around, shares, centers, neighbours, matrices, shifts)


def _fitted(flow: _Flow, after: Appearance, sample: Rows) -> _Flow:
    """The flow fitted to pairs, in rounds of shrinking reach."""
    looks, weights = flow.before.looks[sample], flow.before.weights[sample]
    targets = after.own_places
    reach, num_tight = _first_reach(flow, after, sample), 0
    while num_tight < NUM_TIGHT:
        places = after.places(flow.places(sample))
        ours = after.keys(places, looks, reach / FAR)
        distances, found = nearest(after.keys(targets, after.looks, reach / FAR), ours, min(2, len(after)))
        now, second = found[:, 0], np.maximum(distances[:, -1], 1e-12)
        clear = weights * ((1 - (distances[:, 0] / second) ** 2) ** CLEAR_POWER + 1e-4)
        away = np.linalg.norm(places - targets[now], axis=1)
        if reach > LEAST_REACH:
            near = np.exp(-((away / reach) ** 2))
            flow = flow.fitted(sample, after.means[now], clear * near, PRIOR).smoothed()
        else:
            flow = flow.fitted(sample, after.means[now], clear * _agreement(away), TIGHT_PRIOR)
            num_tight += 1
        reach = max(LEAST_REACH, min(SHRINK * reach, LEAST_REACH + MOST_AWAY * float(np.quantile(away, 0.9))))
    return flow


def _agreement(away: F64) -> F64:
    """Weights of pairs by their distances from the expected positions, in spacings."""
    return np.asarray(1 / (1 + (away / max(0.1, float(np.median(away)))) ** 2) ** 2)


def _first_reach(flow: _Flow, after: Appearance, sample: Rows) -> float:
    """The first reach in spacings, from the distances that the guesses leave."""
    unit = MOST_REACH / 4
    theirs = after.keys(after.own_places, after.looks, unit, REACH_LOOKS_WEIGHT)
    places, looks = after.places(flow.places(sample)), flow.before.looks[sample]
    ours = after.keys(places, looks, unit, REACH_LOOKS_WEIGHT)
    now = among(ours, theirs)[1]
    away = unit * np.linalg.norm((ours - theirs[now])[:, :3], axis=1)
    return float(np.clip(2 * np.quantile(away, 0.75), FIRST_REACH, MOST_REACH))


def _costs(flow: _Flow, after: Appearance, places: F64, was: Rows) -> F64:
    """Differences of Gaussians now from their moved matches before, [m], in spacings."""
    away = after.places(places[was]) - after.own_places
    before, inverses = flow.before.normals[was], np.linalg.pinv(flow.matrices)[flow.around[was, 0]]
    normals = np.einsum("mji,mj->mi", inverses, before)
    flatness = np.minimum(np.linalg.norm(before, axis=1), np.linalg.norm(after.normals, axis=1))
    lengths = np.linalg.norm(normals, axis=1) * np.linalg.norm(after.normals, axis=1)
    cosines = np.einsum("mi,mi->m", normals, after.normals) / np.maximum(lengths, 1e-300)
    unlike = np.linalg.norm(flow.before.looks[was] - after.looks, axis=1)
    costs = np.linalg.norm(away, axis=1) + NORMAL_COST * flatness * (1 - cosines**2) + LOOKS_COST * unlike
    return np.asarray(costs)


def _spread(
    before: Appearance, after: Appearance, motion: Motion, places: F64, was: Rows, is_same: Mask
) -> None:
    """Match more Gaussians, in place: unmatched ones try the motions of their matched neighbours."""
    for _ in range(NUM_SPREADS):
        is_left = np.ones(len(before), bool)
        is_left[was[is_same]] = False
        left, now, found = np.flatnonzero(is_left), np.flatnonzero(~is_same), np.flatnonzero(is_same)
        if not (len(left) and len(now)):
            return
        rows = nearest(before.means[was[found]], before.means[left], NUM_SPREADING)[1]
        offsets = before.means[left, None] - before.means[was[found]][rows]
        tried = after.means[found][rows] + offsets @ motion[0].T
        theirs = after.keys(after.own_places[now], after.looks[now], 1.0, LOOKS_WEIGHT)
        looks = np.repeat(before.looks[left], NUM_SPREADING, axis=0)
        ours = after.keys(after.places(tried.reshape(-1, 3)), looks, 1.0, LOOKS_WEIGHT)
        best = np.arange(len(left)), among(ours, theirs)[0].reshape(-1, NUM_SPREADING).argmin(axis=1)
        ours = ours.reshape(len(left), NUM_SPREADING, -1)[best]
        distances, partner, mutual = mutual_nearest(theirs, ours)
        mutual &= distances < NEAR
        was[now[mutual]], is_same[now[mutual]] = left[partner[mutual]], True
        places[left[partner[mutual]]] = tried[best][partner[mutual]]
        if not mutual.any():
            return
