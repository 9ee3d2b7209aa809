"""The ground of a captured scene: a plaza, a cloth, or the paper below an object.

It is level paint at the foot of the subject, larger than the subject. The table of the stage continues it at
the same level and in the same color, and its torn border dissolves into the paint of the table.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.ground_maps import Grid
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64, Mask
from brushgs.values.colors import OKLAB
from brushgs.values.gaussians import Gaussians

SIDE: int = _core.GROUND_SIDE  # cells of a map
REACH: float = _core.GROUND_REACH  # half its side, in radii of the subject
BAND: float = _core.GROUND_BAND  # half the thickness of a ground, in radii


class Ground(NamedTuple):
    """The ground of a scene, as maps [SIDE, SIDE] by right and away around the foot.

    Attributes:
        place: of the subject, which stands on this ground.
        coverage: 0 to 1, smoothed: 1 inside, 0.5 at the border.
        lab: [3, SIDE, SIDE] OKLab inside, spread beyond the border.
        tone: [3] OKLab along the border.
        extent: radius of the covered area, world units.
    """

    place: Place
    coverage: F64
    lab: F64
    tone: F64
    extent: float

    def at(self, level: F64) -> tuple[F64, F64]:
        """At level points [n, 2]: [n] coverage, and [n, 3] OKLab of the ground or its continuation."""
        grid = Grid(SIDE, REACH * self.place.radius)
        lab = np.stack([grid.samples(self.lab[k], level) for k in range(3)], axis=1)
        return grid.samples(self.coverage, level), lab

    def is_on(self, points: F64) -> Mask:
        """[n] whether local points [n, 3] belong to the ground, not to objects on it."""
        return np.asarray(np.abs(points[:, 1]) < BAND * self.place.radius)


def dissolved(strokes: Gaussians, ground: Ground, table: F64 | None) -> Gaussians:
    """Strokes with a ground that blends into the table toward its border; those under the table are dropped.

    Args:
        strokes: N, in their painted colors.
        ground: of their scene.
        table: [3] OKLab of the table; None for bare paper, where the ground fades out.
    """
    opacities, sh = strokes.opacities.copy(), strokes.sh.copy()
    _core.dissolve(strokes.means, opacities, sh, ground, table, OKLAB)
    return replace(strokes, sh=sh, opacities=opacities)
