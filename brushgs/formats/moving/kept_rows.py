"""Rows of one moment that cannot be drawn: they stay, unseen.

Where rows correspond, the others keep their numbers so.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped, find_faults
from brushgs.formats.scenes.encoding import Encoding
from brushgs.values.arrays import Mask
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class Kept:
    """All rows of a moment.

    Attributes:
        gaussians: [N]; those that cannot be drawn have no opacity, and lie in the middle of the others.
        is_broken: [N] which these are; None for none.
    """

    gaussians: Gaussians
    is_broken: Mask | None = None

    @property
    def is_whole(self) -> bool:
        """Whether it has rows, and all of them can be drawn."""
        return len(self.gaussians) > 0 and self.is_broken is None

    def without_broken(self) -> Gaussians:
        """The rows that can be drawn."""
        return self.gaussians if self.is_broken is None else self.gaussians.take(~self.is_broken)

    def placed_like(self, other: Gaussians) -> Gaussians:
        """All rows; those that cannot be drawn, or all of a moment without any, lie unseen as in another.

        Args:
            other: as many Gaussians, or none: then rows stay where they are.
        """
        if len(self.gaussians) == 0:
            return replace(other, opacities=np.zeros_like(other.opacities))
        if self.is_broken is None or len(other) != len(self.gaussians):
            return self.gaussians
        means, quats, scales = (
            np.where(self.is_broken[:, None], theirs, ours)
            for ours, theirs in (
                (self.gaussians.means, other.means),
                (self.gaussians.quats, other.quats),
                (self.gaussians.scales, other.scales),
            )
        )
        return replace(self.gaussians, means=means, quats=quats, scales=scales)


NO_ROWS = Kept(Columns.empty(0, 1).gaussians())


def keep_rows(rows: Columns, encoding: Encoding, *, antialiased: bool) -> tuple[Kept, Dropped]:
    """Decode raw rows, all of them.

    Args:
        rows: as `read_columns` gives them with `is_raw`; overwritten.
        encoding: what their numbers mean.
        antialiased: see `Gaussians`.

    Returns:
        The rows, and those of them that cannot be drawn.
    """
    with np.errstate(all="ignore"):
        rows.standardize(encoding)
        is_sound, dropped = find_faults(rows, 0, rows.sh.shape[1] - 1)
        is_broken = None if is_sound is None else ~is_sound
        if is_broken is not None:
            sound = rows.means[~is_broken].astype(np.float64)
            rows.means[is_broken] = sound.mean(axis=0) if len(sound) else 0
            rows.quats[is_broken] = 1, 0, 0, 0
            rows.scales[is_broken] = -np.inf
            rows.opacities[is_broken] = -np.inf
            rows.sh[is_broken] = 0
        rows.activate(is_logit=True)
    return Kept(rows.gaussians(antialiased=antialiased), is_broken), dropped
