"""Means and medians along chains of points: windows end where chains end."""

from dataclasses import dataclass

import numpy as np

from brushgs.values.arrays import F64, Mask, Rows


@dataclass(frozen=True, eq=False)
class Along:
    """P points, chain after chain.

    Attributes:
        chains: [P] chain of each point, ascending.
        first: [P] first point of its chain.
        last: [P] last point of its chain.
    """

    chains: Rows
    first: Rows
    last: Rows

    @classmethod
    def of(cls, chains: Rows) -> "Along":
        """The points of chains [P], ascending."""
        num = len(chains)
        is_start = np.ones(num, bool)
        is_start[1:] = chains[1:] != chains[:-1]
        starts = np.flatnonzero(is_start)
        rank = np.cumsum(is_start) - 1
        ends = np.append(starts[1:], num) - 1
        return cls(rank, starts[rank], ends[rank])

    def __len__(self) -> int:
        return len(self.chains)

    @property
    def num(self) -> int:
        """Number of chains."""
        return int(self.chains[-1]) + 1 if len(self) else 0

    def near(self, shift: int) -> Rows:
        """[P] the point `shift` further on, or the end of the chain."""
        return np.clip(np.arange(len(self)) + shift, self.first, self.last)

    def smooth(self, values: F64, times: int) -> F64:
        """Values [P, k] averaged `times` times with their neighbors, a deviation of root(times / 2) points.

        Ends stay.
        """
        before, after = self.near(-1), self.near(1)
        is_end = (before == np.arange(len(self))) | (after == np.arange(len(self)))
        kept = values[is_end]
        for _ in range(times):
            values = 0.5 * values + 0.25 * (values[before] + values[after])
            values[is_end] = kept
        return values

    def mean(self, values: F64, reach: int) -> F64:
        """Mean of values [P] over the points up to `reach` away."""
        total = np.concatenate([[0.0], np.cumsum(values)])
        low, high = self.near(-reach), self.near(reach) + 1
        return np.asarray((total[high] - total[low]) / (high - low))

    def even_mean(self, values: F64, reach: int) -> F64:
        """The same over equally many points to either side, fewer near ends, which preserves slopes."""
        rows = np.arange(len(self))
        reaches = np.minimum(np.minimum(rows - self.first, self.last - rows), reach)
        total = np.concatenate([[0.0], np.cumsum(values)])
        return np.asarray((total[rows + reaches + 1] - total[rows - reaches]) / (2 * reaches + 1))

    def median(self, values: F64, reach: int) -> F64:
        """Median of values [P] over the points up to `reach` away."""
        return np.median(np.stack([values[self.near(shift)] for shift in range(-reach, reach + 1)]), axis=0)

    def totals(self, values: F64 | Mask) -> F64:
        """Sum of values [P] over each chain."""
        return np.bincount(self.chains, values, minlength=self.num).astype(np.float64)

    def means(self, values: F64 | Mask) -> F64:
        """Mean of values [P] over each chain; for a mask the share."""
        return self.totals(values) / np.maximum(np.bincount(self.chains, minlength=self.num), 1)

    def cut(self, is_kept: Mask, is_cut: Mask | None = None) -> Rows:
        """[P] chains that are cut where points are not kept [P], and before some others [P]."""
        starts = self.first == np.arange(len(self))
        starts[1:] |= is_kept[1:] != is_kept[:-1]
        if is_cut is not None:
            starts |= is_cut
        return np.cumsum(starts) - 1

    def thinned(self) -> Rows:
        """Every second point of each chain, and its last."""
        rows = np.arange(len(self))
        return np.flatnonzero(((rows - self.first) % 2 == 0) | (rows == self.last))

    def lengths(self, points: F64) -> F64:
        """[P] distance of each point [P, d] to the one before it; 0 at the first of a chain."""
        return np.asarray(np.linalg.norm(points - points[self.near(-1)], axis=1))
