"""Pair the Gaussians of an edited scene with those of the original."""

from dataclasses import dataclass

import numpy as np

from brushgs.passes.extent import robust_frame
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import Array, Rows
from brushgs.values.gaussians import Gaussians

NEAR = 2e-3  # radii of the scene: rows further apart are different Gaussians
LEAST_SHARE = 0.1  # of the original rows that must be found; otherwise these are two scenes


@dataclass(frozen=True, eq=False)
class Pairs:
    """Corresponding rows of two scenes.

    Attributes:
        before: [n] rows of the scene before.
        after: [n] the corresponding rows of the scene after.
        are_rows: whether all rows correspond by number.
    """

    before: Rows
    after: Rows
    are_rows: bool


def pair_rows(before: Gaussians, after: Gaussians) -> Pairs:
    """Find corresponding rows: by number, or else by nearest position.

    Raises:
        ValueError: if there is no Gaussian, or too few positions of the two scenes agree.
    """
    for name, scene in (("before", before), ("after", after)):
        if len(scene) == 0:
            raise ValueError(f"the scene {name} the edit must have at least one Gaussian, got none")
    _, radius = robust_frame(before.means)
    near = NEAR * radius
    if len(before) == len(after):
        away = np.linalg.norm(before.means.astype(np.float64) - after.means, axis=1)
        is_near = away <= near
        if is_near.mean() >= 1 - LEAST_SHARE:
            rows = np.flatnonzero(is_near)
            return Pairs(rows, rows, bool(is_near.all()))
    distances, rows = _nearest(after.means, before.means)
    found = np.flatnonzero(distances <= near)
    if len(found) < LEAST_SHARE * len(before):
        raise ValueError(
            f"of the {len(before)} Gaussians before the edit {len(found)} lie where one of the {len(after)} "
            "after it does; give two states of one scene with changed colors or sizes"
        )
    return Pairs(found, rows[found], False)


def _nearest(points: Array, queries: Array) -> tuple[Array, Rows]:
    distances, rows = nearest(points, queries, 1)
    return distances[:, 0], rows[:, 0]
