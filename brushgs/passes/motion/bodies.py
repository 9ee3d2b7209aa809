"""Compute the poses of strokes from their members at the reference moments and now."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from brushgs.passes.groups import Groups
from brushgs.passes.motion.rigid import rigid_motions, sums_of
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.passes.reduce.merge import covariances, principal_axes, stopped
from brushgs.rendering.motion import AT_REST, COLOR, NUM_NUMBERS, OPACITY, SHIFT, SIZE, TURN
from brushgs.values.arrays import F64, Array, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import conjugates, normalized, quat_products, rotation_matrices
from brushgs.values.sh import C0

MEMBERS_AT_A_TIME = 1 << 16  # about 700 bytes each while a moment is processed
GONE = 0.01  # share of the mass at the reference below which a stroke is absent and gets no pose
GONE_NUMBERS = (*AT_REST[:OPACITY], 0.0, *AT_REST[OPACITY + 1 :])


@dataclass(frozen=True, eq=False)
class Bodies:
    """k strokes as bodies of n members.

    Attributes:
        strokes: slice of these strokes among all of the caller.
        rows: [n] rows of the members in the scene, sorted by stroke.
        starts: [k + 1] first member of each stroke, then n.
        pivots: [k, 3] weighted means of the members.
        places: [n, 3] offsets of the members from the pivots of their strokes.
        quats: [n, 4] unit quaternions of the members.
        variances: [n] mean variance of each member along an axis, a third of the trace of its covariance.
        areas: [n] projected areas of the members, see `merge_clusters`.
        opacities: [n] of the members.
        footprints: [k] areas of the strokes without overlap.
        colors: [k, 3] mean view-independent colors of the members, display-encoded.
        painted: [k] joint opacity of the members, see `merge_clusters`.
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
    footprints: F64
    colors: F64
    painted: F64

    @classmethod
    def of(cls, members: Gaussians, labels: Rows) -> "Iterator[Bodies]":
        """Yield bodies of members with ids, in chunks; `labels` [n] are strokes, 0 to k - 1, ascending."""
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
        areas[(totals == 0)[labels]] = 1.0  # points: weighted by opacity
        weights = opacities * areas
        weights[(np.bincount(labels, weights) == 0)[labels]] = 1.0
        shares = weights / np.bincount(labels, weights)[labels]
        means = members.means.astype(np.float64)
        pivots = sums_of(shares, starts, means)
        groups = Groups.ascending(starts)
        within, between = covariances(members, pivots, shares, groups)
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
            footprints,
            sums_of(shares, starts, C0 * members.sh[:, 0]),
            stopped(opacities, own_areas, footprints, groups),
        )

    def numbers(self, moment: Gaussians, last_turns: Array, since: float) -> F64:
        """The pose rows of the strokes at a moment, [k, 12]; absent strokes rest with opacity 0.

        Args:
            moment: the scene, with all rows.
            last_turns: [k, 4] rotations at the previous moment; absent strokes keep them.
            since: seconds since then.
        """
        labels = np.repeat(np.arange(len(self.pivots)), np.diff(self.starts))
        opacities = moment.opacities[self.rows].astype(np.float64)
        scales = moment.scales[self.rows].astype(np.float64)
        # Members that are faint now or at the reference are poor evidence of motion.
        weights = self.areas * np.minimum(opacities, self.opacities)
        totals = np.add.reduceat(weights, self.starts[:-1])
        is_there = totals > GONE * np.add.reduceat(self.areas * self.opacities, self.starts[:-1])
        shares = weights / np.where(is_there, totals, 1.0)[labels]
        places = moment.means[self.rows].astype(np.float64) - self.pivots[labels]
        middles = sums_of(shares, self.starts, np.concatenate([self.places, places], axis=1))
        turns, growths = rigid_motions(
            shares,
            self.starts,
            self.places - middles[labels, :3],
            places - middles[labels, 3:],
            (self.variances, (scales**2).mean(axis=1)),
            quat_products(normalized(moment.quats[self.rows]), conjugates(self.quats)),
            last_turns,
            since,
        )
        turned = np.einsum("kij,kj->ki", rotation_matrices(turns), middles[:, :3])
        numbers = np.empty((len(self.pivots), NUM_NUMBERS))
        numbers[:, SHIFT] = middles[:, 3:] - growths[:, None] * turned
        numbers[:, TURN] = turns
        numbers[:, SIZE] = np.log(growths)
        footprints = self.footprints * growths**2
        painted = stopped(opacities, projected_areas(scales), footprints, Groups.ascending(self.starts))
        numbers[:, OPACITY] = np.divide(
            painted, self.painted, out=np.ones(len(painted)), where=self.painted > 0
        )
        paint = self.areas * opacities
        paint /= np.where(is_there, np.add.reduceat(paint, self.starts[:-1]), 1.0)[labels]
        numbers[:, COLOR] = sums_of(paint, self.starts, C0 * moment.sh[self.rows, 0]) - self.colors
        numbers[~is_there] = GONE_NUMBERS
        numbers[~is_there, TURN] = last_turns[~is_there]
        return numbers
