"""Members of strokes at their references and at a moment -> one rigid motion per stroke.

A stroke is a body of mass: each member a ball of the variance that its Gaussian has, which moves and turns as
the member does. The motion of the stroke is the rigid one that brings that mass nearest to where it is now:
weighted Procrustes over the places of members, in which the balls add the mean of the members' own rotations
(Markley) with the weight of their size. So the places of many members decide alone; a lone member, or a line
of them, turns as they do; and a few small Gaussians that jitter do not spin a stroke.
Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions; Markley et al. 2007,
Averaging quaternions.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from brushgs.arrays import F64, Array, Rows
from brushgs.passes.contribution import projected_areas
from brushgs.passes.merge import covariances, principal_axes, stopped
from brushgs.quats import normalized, quat_products, rotation_matrices, turn_forms
from brushgs.rendering.motion import AT_REST, COLOR, OPACITY, SHIFT, SIZE, TURN
from brushgs.scene import Gaussians
from brushgs.sh import C0

MEMBERS_AT_A_TIME = 1 << 16  # some 500 bytes each while a moment is worked on
GONE = 0.01  # factor on opacity below which a stroke is not there, and where it would be is not asked
GONE_NUMBERS = (*AT_REST[:OPACITY], 0.0, *AT_REST[OPACITY + 1 :])
LAST_TURN = 1e-6  # weight of the rotation a moment before: it decides only what nothing else does


@dataclass(frozen=True, eq=False)
class Bodies:
    """Strokes as bodies of their members, k strokes of n members.

    Attributes:
        strokes: rows of these strokes, as the caller counts them.
        rows: [n] rows of the members in the scene, by stroke.
        starts: [k + 1] where the members of each stroke begin, and where the last ends.
        pivots: [k, 3] weighted means of the members.
        places: [n, 3] of the members from the pivot of theirs.
        quats: [n, 4] of the members, of length 1.
        variances: [n] of their balls, a third of the trace of their covariance.
        areas: [n] their projected areas, see `merge_clusters`.
        opacities: [n] theirs.
        colors: [n, 3] theirs, the part that does not depend on the view, display-encoded.
        footprints: [k] areas of the strokes without overlap.
        painted: [k] opacity of the members together, see `merge_clusters`.
    """

    strokes: slice
    rows: Rows
    starts: Rows
    pivots: F64
    places: F64
    quats: F64
    variances: F64
    areas: F64
    opacities: F64
    colors: F64
    footprints: F64
    painted: F64

    @classmethod
    def of(cls, members: Gaussians, labels: Rows) -> "Iterator[Bodies]":
        """The bodies of members with ids, which stroke by stroke are `labels` [n], ascending, 0 to k - 1."""
        assert members.ids is not None, "members are rows of a scene"
        num = int(labels[-1]) + 1 if len(labels) else 0
        starts = np.searchsorted(labels, np.arange(num + 1))
        first = 0
        while first < num:
            end = int(np.searchsorted(starts, starts[first] + MEMBERS_AT_A_TIME, "right")) - 1
            end = max(end, first + 1)
            some = slice(starts[first], starts[end])
            yield cls._of(
                slice(first, end), members.take(some), labels[some] - first, starts[first : end + 1]
            )
            first = end

    @classmethod
    def _of(cls, strokes: slice, members: Gaussians, labels: Rows, starts: Rows) -> "Bodies":
        assert members.ids is not None, "members are rows of a scene"
        starts = starts - starts[0]
        opacities, own_areas = members.opacities.astype(np.float64), projected_areas(members.scales)
        areas = own_areas.copy()
        totals = np.bincount(labels, opacities * areas)
        areas[(totals == 0)[labels]] = 1.0  # points: each counts by its opacity
        weights = opacities * areas
        weights[(np.bincount(labels, weights) == 0)[labels]] = 1.0
        shares = weights / np.bincount(labels, weights)[labels]
        means = members.means.astype(np.float64)
        pivots = _sums(shares, starts, means)
        within, between = covariances(members, pivots, shares, labels)
        footprints = projected_areas(principal_axes(within + between)[0])
        return cls(
            strokes,
            members.ids.astype(np.intp),
            starts,
            pivots,
            means - pivots[labels],
            normalized(members.quats),
            (members.scales.astype(np.float64) ** 2).sum(axis=1) / 3,
            areas,
            opacities,
            0.5 + C0 * members.sh[:, 0].astype(np.float64),
            footprints,
            stopped(opacities, own_areas, footprints, labels),
        )

    def numbers(self, moment: Gaussians, last_turns: Array) -> F64:
        """The numbers of a `Pose` at a moment, [k, 12]; at rest but for opacity 0 where strokes are gone.

        Args:
            moment: the scene, with all rows.
            last_turns: [k, 4] rotations a moment before.
        """
        num = len(self.pivots)
        numbers = np.tile(np.array(AT_REST), (num, 1))
        labels = np.repeat(np.arange(num), np.diff(self.starts))
        opacities = moment.opacities[self.rows].astype(np.float64)
        scales = moment.scales[self.rows].astype(np.float64)
        # What is hardly there now, or was not at the reference, says little of the others.
        weights = self.areas * np.minimum(opacities, self.opacities)
        totals = np.add.reduceat(weights, self.starts[:-1])
        full = np.add.reduceat(self.areas * self.opacities, self.starts[:-1])
        is_there = totals > GONE * full
        shares = weights / np.where(is_there, totals, 1.0)[labels]
        places = moment.means[self.rows].astype(np.float64) - self.pivots[labels]
        shifts = _sums(shares, self.starts, np.concatenate([self.places, places], axis=1))
        before, after = self.places - shifts[labels, :3], places - shifts[labels, 3:]
        turns = quat_products(normalized(moment.quats[self.rows]), self.quats * (1, -1, -1, -1))
        variances = (scales**2).sum(axis=1)
        forms = np.concatenate(
            [
                (after[:, :, None] * before[:, None, :]).reshape(-1, 9),
                self.variances[:, None] * (turns[:, :, None] * turns[:, None, :]).reshape(-1, 16),
                ((before**2).sum(axis=1) + 3 * self.variances)[:, None],
                ((after**2).sum(axis=1) + variances)[:, None],
            ],
            axis=1,
        )
        sums = _sums(shares, self.starts, forms)
        spread_before, spread_after = sums[:, 25], sums[:, 26]
        unit = np.where(spread_before > 0, spread_before, 1.0)
        form = turn_forms(sums[:, :9].reshape(-1, 3, 3)) + 4 * sums[:, 9:25].reshape(-1, 4, 4)
        last = last_turns.astype(np.float64)
        form = form / unit[:, None, None] + LAST_TURN * last[:, :, None] * last[:, None, :]
        turn = np.linalg.eigh(form)[1][:, :, -1]
        has_size = (spread_before > 0) & (spread_after > 0)
        ratio = np.where(has_size, spread_after, 1.0) / np.where(has_size, spread_before, 1.0)
        numbers[:, SIZE] = 0.5 * np.log(ratio)
        numbers[:, TURN] = turn
        back = np.einsum("nij,nj->ni", rotation_matrices(turn), shifts[:, :3])
        numbers[:, SHIFT] = shifts[:, 3:] - np.sqrt(ratio)[:, None] * back
        painted = stopped(opacities, projected_areas(scales), self.footprints * ratio, labels)
        numbers[:, OPACITY] = np.divide(painted, self.painted, out=np.ones(num), where=self.painted > 0)
        colors = 0.5 + C0 * moment.sh[self.rows, 0].astype(np.float64)
        numbers[:, COLOR] = _sums(shares, self.starts, colors - self.colors)
        numbers[~is_there] = GONE_NUMBERS
        numbers[~is_there, TURN] = last[~is_there]
        return numbers


def _sums(weights: F64, starts: Rows, values: Array) -> F64:
    """Weighted sums [k, D] of values [n, D] from each start to the next, in row order."""
    shape = len(starts) - 1, len(values)
    return np.asarray(csr_array((weights, np.arange(shape[1]), starts), shape) @ values)
