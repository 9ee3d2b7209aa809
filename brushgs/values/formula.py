"""Gaussians whose position, rotation and opacity are formulas of time, as most moving formats store them.

Each row has a center in time. With d the time since it, the mean moves by a polynomial of d, the quaternion
changes at a constant rate, and the opacity fades as exp(-(d / width)^2) before and after.
Sources: Li et al. 2024, Spacetime Gaussian Feature Splatting, sections 3.1 and 3.2; Wang et al. 2025,
FreeTimeGS, equations 1 and 4.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from brushgs.values.arrays import F32, F64, Mask, Rows
from brushgs.values.gaussians import Gaussians

_RESTS = 1e-3  # a row whose opacity changes by no more than this over the clip is at rest
_NARROWEST = 1e-150  # replaces a width of 0: the row shows at its center, and no product is 0 x infinity
# Rows computed at a time: their float64 temporaries stay in the cache.
_BLOCK_ROWS = 1 << 13


@dataclass(frozen=True, eq=False)
class Formula:
    """N Gaussians as formulas of a clock, whose unit may be seconds or the whole clip (0 to 1)."""

    still: Gaussians  # [N] each at its center in time, with full opacity
    centers: F64  # [N] centers in time, float64, finite
    # [N] time in which the opacity falls to 1/e, float64, >= 0; infinite for a row that never fades
    widths: F64
    motion: F32  # [N, p, 3] coefficients of d, d^2, ... in world units, finite
    spin: F32 | None = None  # [N, 4] change of the quaternion per unit of time, finite; None for no rotation
    # [N, 2] start (included) and end (excluded) of the existence of each row; None for always
    windows: F64 | None = None
    cutoff: float = 0.0  # opacity is 0 for a row that has faded below this share

    def at(self, clock: float) -> Gaussians:
        """The Gaussians at a time of the clock; computed in float64, rounded once."""
        since = clock - self.centers
        means, quats = self.still.means, self.still.quats
        if len(self._moving):
            means = means.copy()
            for part, rows in _blocks(self._moving):
                means[rows] += _polynomial(self._motion[part], since[rows])
        if len(self._turning):
            quats = quats.copy()
            for part, rows in _blocks(self._turning):
                quats[rows] = _turned(quats[rows], self._spin[part], since[rows])
        opacities = (self.still.opacities * self._shares(since, clock)).astype(np.float32)
        return replace(self.still, means=means, quats=quats, opacities=opacities)

    def resting(self, start: float, end: float) -> Mask:
        """[N] mask of rows that do not change from `start` to `end`, except for 1/1000 of opacity."""
        rests = np.ones(len(self.centers), np.bool_)
        rests[self._moving] = rests[self._turning] = False
        nearest, farthest = np.clip(self.centers, start, end), reach(self.centers, start, end)
        most = self._shares(nearest - self.centers, None)
        least = self._shares(farthest, None)
        rests &= self.still.opacities * (most - least) <= _RESTS
        if self.windows is not None:
            is_always = (self.windows[:, 0] <= start) & (self.windows[:, 1] > end)
            rests &= is_always | (self.still.opacities * most <= _RESTS)
        return rests

    def _shares(self, since: F64, clock: float | None) -> F64:
        """[N] factors on the opacity of each row; if a clock is given, 0 outside the row's window."""
        with np.errstate(over="ignore", under="ignore"):
            shares = since * self._rates
            np.multiply(shares, shares, out=shares)
            np.exp(np.negative(shares, out=shares), out=shares)
        if self.cutoff > 0:
            shares[shares < self.cutoff] = 0
        if self.windows is not None and clock is not None:
            shares[(clock < self.windows[:, 0]) | (clock >= self.windows[:, 1])] = 0
        return shares

    @cached_property
    def _rates(self) -> F64:
        return 1 / np.maximum(self.widths, _NARROWEST)

    @cached_property
    def _moving(self) -> Rows:
        return np.flatnonzero(self.motion.any(axis=(1, 2)))

    @cached_property
    def _motion(self) -> F32:
        return np.ascontiguousarray(self.motion[self._moving])

    @cached_property
    def _turning(self) -> Rows:
        return np.flatnonzero(np.zeros(0) if self.spin is None else self.spin.any(axis=1))

    @cached_property
    def _spin(self) -> F32:
        assert self.spin is not None
        return self.spin[self._turning]


def reach(centers: F64, start: float, end: float) -> F64:
    """[N] largest distance in time of each center from a clock that runs from `start` to `end`."""
    return np.maximum(np.abs(start - centers), np.abs(end - centers))


def _blocks(rows: Rows) -> Iterator[tuple[slice, Rows | slice]]:
    """Split ascending rows into blocks: slice into `rows`, and the rows (as a slice if contiguous)."""
    for start in range(0, len(rows), _BLOCK_ROWS):
        part = slice(start, start + _BLOCK_ROWS)
        block = rows[part]
        first, last = int(block[0]), int(block[-1])
        yield part, slice(first, last + 1) if last - first + 1 == len(block) else block


def _polynomial(motion: F32, since: F64) -> F64:
    """[n, 3] displacement of rows; Horner's scheme."""
    time = since[:, None]
    moved = motion[:, -1] * time
    for power in range(motion.shape[1] - 2, -1, -1):
        moved += motion[:, power]
        moved *= time
    return np.asarray(moved)


def _turned(quats: F32, spin: F32, since: F64) -> F32:
    """[n, 4] quaternions after `since`; where the sum is zero, the quaternion at the center in time.

    It is zero only if the change is parallel to the quaternion, so that the rotation is the same before and
    after.
    """
    turned = (quats + spin * since[:, None]).astype(np.float32)
    gone = ~turned.any(axis=1)
    turned[gone] = quats[gone]
    return turned
