"""The ground of a captured scene: a plaza, a cloth, or the paper below an object.

It is level paint at the foot of the subject, larger than the subject. The table of the stage continues it at
the same level and in the same color, and its torn border dissolves into the paint of the table.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from brushgs.core.native import core as _core
from brushgs.passes.add.ground_maps import Grid
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64, Mask
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import C0, base_colors

SIDE: int = _core.GROUND_SIDE  # cells of a map
REACH: float = _core.GROUND_REACH  # half its side, in radii of the subject
BAND: float = _core.GROUND_BAND  # half the thickness of a ground, in radii
LEVEL = 0.85  # minimum cosine between the normal of a level Gaussian and up


@dataclass(frozen=True, eq=False)
class Ground:
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

    def at(self, points: F64) -> tuple[F64, F64]:
        """At local points [n, 3]: [n] coverage, and [n, 3] OKLab of the ground or its continuation."""
        grid, level = _grid(self.place), points[:, [0, 2]]
        lab = np.stack([grid.samples(self.lab[k], level) for k in range(3)], axis=1)
        return grid.samples(self.coverage, level), lab

    def is_on(self, points: F64) -> Mask:
        """[n] whether local points [n, 3] belong to the ground, not to objects on it."""
        return np.asarray(np.abs(points[:, 1]) < BAND * self.place.radius)


def find_ground(gaussians: Gaussians, place: Place, weights: F64) -> Ground | None:
    """The ground of a scene, or None."""
    points = np.ascontiguousarray(place.local(gaussians.means))
    is_level = np.abs(shortest_axes(gaussians.quats, gaussians.scales) @ place.axes[1]) > LEVEL
    lab = oklab_of(base_colors(gaussians.sh[:, :1]).astype(np.float64))
    weights = np.ascontiguousarray(weights, np.float64)
    found: Any = _core.find_ground(
        points, is_level, weights, np.ascontiguousarray(lab), place.radius, place.height
    )
    if found is None:
        return None
    level, coverage, lab, tone, extent = found
    place = replace(place, foot=place.foot + level * place.axes[1], height=place.height - level)
    square = (SIDE, SIDE)
    return Ground(place, coverage.reshape(square), lab.reshape(3, *square), np.array(tone), extent)


def dissolved(strokes: Gaussians, ground: Ground, table: F64 | None) -> Gaussians:
    """Strokes with a ground that blends into the table toward its border; those under the table are dropped.

    Args:
        strokes: N, in their painted colors.
        ground: of their scene.
        table: [3] OKLab of the table; None for bare paper, where the ground fades out.
    """
    points = np.ascontiguousarray(ground.place.local(strokes.means))
    share, is_under = _core.dissolving_at(ground.coverage, ground.place.radius, points)
    left = np.where(is_under, 0.0, strokes.opacities)
    dtype = strokes.means.dtype
    if table is None:
        return replace(strokes, opacities=(left * (1 - share)).astype(dtype))
    sh = strokes.sh * (1 - share)[:, None, None]
    sh[:, 0] += share[:, None] * (np.clip(rgb_of_oklab(table[None]), 0, 1) - 0.5) / C0
    return replace(strokes, sh=sh.astype(dtype), opacities=left.astype(dtype))


def _grid(place: Place) -> Grid:
    return Grid(SIDE, REACH * place.radius)
