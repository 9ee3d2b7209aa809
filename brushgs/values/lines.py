"""Lines of a drawing, in space."""

from dataclasses import dataclass

import numpy as np

from brushgs.values.arrays import F64, Rows
from brushgs.values.gaussians import Gaussians


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of a scene, as L strokes: nearly straight pieces, each overlapping the next.

    Attributes:
        strokes: the pieces; their longest axis runs along the line.
        strengths: [L] of the line, from 0 (the faintest that is drawn) to 1: an edge at 0.5 is twice as long
            or as strong as at 0, see `stronger_than`.
        chains: [L] line of each piece, ascending; the pieces of a line are in order.
        normals: [L, 3] of the surface at a silhouette, for `fade_by_facing`: longer normals fade sooner. 0
            for lines fixed in space.
    """

    strokes: Gaussians
    strengths: F64
    chains: Rows
    normals: F64

    def __len__(self) -> int:
        return len(self.strokes)

    def stronger_than(self, strength: float) -> "Lines":
        """The lines of at least this strength, each as a whole."""
        rows = np.flatnonzero(self.strengths >= strength)
        return Lines(self.strokes.take(rows), self.strengths[rows], self.chains[rows], self.normals[rows])
