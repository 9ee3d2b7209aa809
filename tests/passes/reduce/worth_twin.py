"""Which strokes are worth keeping, and solid paint, in NumPy."""

import numpy as np

from brushgs.passes.components import components
from brushgs.passes.finest import finest_of, seen_scales
from brushgs.passes.form.coverage import NUM_NEIGHBORS, nearest_others
from brushgs.passes.neighbours import nearest
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.quats import rotation_matrices
from tests.passes import moments_twin

FAINT, STRONG = 0.06, 0.8
VEIL, VEIL_SIZE = 0.3, 2.0
COVERED, FOG, VEIL_FOG, DEEP = 0.7, 0.12, 0.25, 128
TOUCH, FIRM, SPECK, MOST_SPECKS = 2.0, 0.6, 2.0, 0.3


class Around:
    """Strokes in float64, and the rows of their nearest others."""

    def __init__(self, strokes):
        order = np.argsort(strokes.scales, axis=1, kind="stable")
        seen = seen_scales(strokes.scales, finest_of(strokes))
        self.scales = np.take_along_axis(seen, order, axis=1)
        self.axes = np.take_along_axis(rotation_matrices(strokes.quats), order[:, None, :], axis=2)
        self.means = strokes.means.astype(np.float64)
        self.sizes = np.sqrt(self.scales[:, 1]) * np.sqrt(self.scales[:, 2])
        self.neighbors = nearest_others(self.means, NUM_NEIGHBORS)

    def passed(self, opacities, rows=None, *, num_others=NUM_NEIGHBORS):
        """Transmittance of the neighbors at the center of strokes."""
        found = self.neighbors
        if num_others > NUM_NEIGHBORS:
            found = nearest(self.means, self.means, min(num_others + 1, len(self.means)))[1]
        if rows is not None:  # the others are not looked at
            asked = np.isin(np.arange(len(found)), rows)
            found = [others if is_asked else () for others, is_asked in zip(found, asked, strict=True)]
        passed = moments_twin.passed_by(self.means, self.scales, self.axes, opacities, found)
        return passed if rows is None else passed[rows]


def solidified(strokes, strength):
    """Scales and opacities of solid strokes."""
    opacities = strokes.opacities.astype(np.float64)
    stopped = 1 - (1 - opacities) * Around(strokes).passed(opacities)
    gains = 1 + strength * stopped * (1 - opacities)
    scales = strokes.scales / np.sqrt(gains)[:, None]
    finest = finest_of(strokes)
    before, after = seen_scales(strokes.scales, finest), seen_scales(scales, finest)
    rows = np.flatnonzero((after != scales).any(axis=1))
    gains[rows] = projected_areas(before[rows]) / projected_areas(after[rows])
    return scales, np.minimum(opacities * gains, 1)


def worth_keeping(strokes):
    """Mask [k]."""
    opacities = strokes.opacities.astype(np.float64)
    if not opacities.any():
        return np.ones(len(strokes), bool)  # no paint at all
    strong = float(np.percentile(opacities, 99))
    opacities = np.minimum(opacities / max(min(strong / STRONG, 1.0), 1e-6), 1.0)
    around = Around(strokes)
    kept = ~_unseen(around, opacities)
    kept[kept] = ~_specks(around, opacities, kept)
    return kept


def _unseen(around, opacities):
    usual = np.median(around.sizes[around.neighbors], axis=1) if around.neighbors.size else around.sizes
    is_veil = (opacities < VEIL) & (around.sizes > VEIL_SIZE * usual)
    is_faint = is_veil | (opacities < FAINT)
    least = np.where(is_veil, VEIL_FOG, FOG)
    unseen = np.zeros(len(opacities), bool)
    rows = np.flatnonzero(is_faint)
    unseen[rows] = 1 - around.passed(np.where(is_faint, 0.0, opacities), rows) > COVERED
    rows = np.flatnonzero((opacities < least) & ~unseen)
    for num_others in (NUM_NEIGHBORS, DEEP):  # few need the second, slower search
        stopped = 1 - (1 - opacities[rows]) * around.passed(opacities, rows, num_others=num_others)
        rows = rows[stopped < least[rows]]
    unseen[rows] = True
    return unseen


def _specks(around, opacities, kept):
    if not kept.any():
        return np.zeros(0, bool)
    rows, others = _touching(around, kept)
    places = np.cumsum(kept) - 1
    groups = components(int(kept.sum()), places[rows], places[others])
    counts, sums = np.bincount(groups), np.bincount(groups, opacities[kept])
    specks = ((sums < SPECK) & (sums < FIRM * counts))[groups]
    return np.asarray(specks & (specks.mean() <= MOST_SPECKS))


def _touching(around, kept):
    rows, ranks = np.nonzero(kept[:, None] & kept[around.neighbors])
    others = around.neighbors[rows, ranks].astype(np.intp)
    lines = around.means[others] - around.means[rows]
    unit = max(float(around.scales.max()), float(np.abs(lines).max(initial=0)), np.finfo(np.float64).tiny)
    lines /= unit
    axes = around.axes * (around.scales / unit)[:, None, :]
    along = (np.einsum("nij,ni->nj", axes[ends], lines) for ends in (rows, others))
    reach = sum(np.linalg.norm(each, axis=1) for each in along)
    touches = (lines**2).sum(axis=1) <= TOUCH * reach  # both sides times the distance
    return rows[touches], others[touches]
