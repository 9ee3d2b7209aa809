"""Floaters: Gaussians, alone or in small groups, that float in the air detached from everything solid.

Distance alone does not identify them: a large Gaussian far from its neighbors may be a wall, a small one at
the same distance a speck of dust. So two Gaussians touch if their visible extents meet along the line between
them. Gaussians with many touching neighbors form groups (DBSCAN); groups that are large or solid are bodies,
together with Gaussians attached by a short chain (grass, wires, whiskers). All others are detached, and are
floaters if the nearest body is far for the scene.

Dense Gaussians count as a body without a search, so that only the others take time: for 1.5 million Gaussians
of a campsite 1.5 s instead of 14 s.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.components import components
from brushgs.passes.extent import robust_frame
from brushgs.passes.neighbours import NUM_NEIGHBOURS, nearest
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.arrays import Array, Mask, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import rotation_matrices

FAINTEST = 0.02  # opacity at which the visible extent of a Gaussian ends
# The 99th percentile of the opacities is 0.83 and more in real scenes. If it is below this, the whole scene
# is faint, and its opacities are scaled up to this.
STRONG = 0.8
MANY = 6  # touching neighbors of a core Gaussian (DBSCAN): a dense fog of strays has fewer
CHAIN = 4  # longest chain of Gaussians attached to a body
# A smaller group is a body only if it is solid: its opacities sum to SOLID, or SOLID_HAZE where their mean is
# below HAZE. The groups around koala and chair sum to at most 1.6 and 3.0 (those above 2 are haze: mean below
# 0.1), a flower head of the sunflowers to 8, a lamp or leaf of the truck to 3 and more.
FEW_ROWS, FEW_SHARE = 100, 0.001
SOLID, HAZE, SOLID_HAZE = 2.0, 0.15, 5.0
# Distance of a floater from the nearest body, in radii of the scene. koala's are 0.097 to 0.34 away, those of
# the chair 0.28 in the median; fuzz on surfaces and severed blades of grass stay below 0.05.
SURE_GAP, STRONG_GAP = 0.08, 0.03
# Painted area of all floaters over the squared radius. Clean scenes: at most 4.8e-5 (sunflowers); truck 9e-4
# (scraps of sky), koala 1.3e-3, chair 2.7e-2.
VISIBLE = 1e-4
# Share of the rows: if more float, there are no bodies. In a fragment of 1,000 scattered points 0.7 float; in
# the chair with its haze 0.04.
MOST_ROWS = 0.3
FEWEST_ROWS = 200
# Edge of a cell in radii, and the minimum sum of opacities in a cell and its 26 neighbors that is part of a
# body: more than any floater has. Against a full search on eight scenes, 9 of the chair's 4161 sure floaters
# are missed, and no other.
CELL, DENSE = 0.02, 8.0
_MAX_CELLS = 1 << 20  # to each side of the middle; farther Gaussians share a cell
LARGEST = 1e6  # scale, in radii: squares of larger ones might leave the range of float32
_ROWS_AT_A_TIME = 1 << 16  # their neighbors take some 100 MB


@dataclass(frozen=True)
class Detachment:
    """Distances of Gaussians from the bodies.

    Attributes:
        gaps: [N] distance to the nearest body in radii of the scene; 0 for Gaussians of a body.
        areas: [N] painted area over the squared radius.
        has_bodies: whether enough of the scene is solid for meaningful gaps.
    """

    gaps: NDArray[np.float64]
    areas: NDArray[np.float64]
    has_bodies: bool

    def beyond(self, gap: float) -> Mask:
        """Mask of the Gaussians with a larger gap."""
        return np.asarray(self.gaps > gap)


def measure_detachment(gaussians: Gaussians) -> Detachment:
    """Measure the distance of each Gaussian from the bodies of the scene.

    Args:
        gaussians: N Gaussians without far outliers, and with few at the same place.
    """
    num_rows = len(gaussians)
    _, radius = robust_frame(gaussians.means)
    areas = projected_areas(gaussians.scales) * gaussians.opacities / radius**2
    unknown = Detachment(np.zeros(num_rows), areas, False)
    if num_rows < FEWEST_ROWS:
        return unknown
    strong = float(np.percentile(gaussians.opacities, 99))
    opacities = gaussians.opacities / max(min(strong / STRONG, 1.0), 1e-6)
    is_dense = _in_dense_cells(gaussians.means, opacities, radius)
    a, b = _touching_pairs(gaussians, opacities, radius, np.flatnonzero(~is_dense))
    is_detached, groups = _outside_bodies(opacities, a, b, is_dense)
    if is_detached.all():
        return unknown
    gaps = np.zeros(num_rows)
    if is_detached.any():
        distances, _ = nearest(gaussians.means[~is_detached], gaussians.means[is_detached], 1)
        nearest_of_group = np.full(num_rows, np.inf)  # the gap of a group is that of its nearest Gaussian
        np.minimum.at(nearest_of_group, groups[is_detached], distances[:, 0] / radius)
        gaps[is_detached] = nearest_of_group[groups[is_detached]]
    return Detachment(gaps, areas, bool((gaps > SURE_GAP).mean() <= MOST_ROWS))


def _in_dense_cells(means: Array, opacities: Array, radius: float) -> Mask:
    """Mask of the rows in cells that are surely part of a body."""
    center, _ = robust_frame(means)
    places = np.clip(np.floor((means - center) / (CELL * radius)), -_MAX_CELLS + 2, _MAX_CELLS - 2)
    x, y, z = (places.astype(np.int64) + _MAX_CELLS).T
    cells, cell_of = np.unique((x << 42) + (y << 21) + z, return_inverse=True)
    cell_of = cell_of.reshape(-1)
    own_opacity, own_count = np.bincount(cell_of, opacities), np.bincount(cell_of)
    opacity, count = np.zeros(len(cells)), np.zeros(len(cells))
    steps = np.array([-1, 0, 1])
    for offset in np.add.outer(np.add.outer(steps << 42, steps << 21), steps).ravel():
        found = np.minimum(np.searchsorted(cells, cells + offset), len(cells) - 1)
        is_there = cells[found] == cells + offset
        opacity += np.where(is_there, own_opacity[found], 0)
        count += np.where(is_there, own_count[found], 0)
    return np.asarray(((opacity >= DENSE) & (opacity >= HAZE * count))[cell_of])


def _touching_pairs(
    gaussians: Gaussians, opacities: Array, radius: float, rows: Rows
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """All pairs of the given rows and their neighbors that touch, each pair once."""
    count = min(NUM_NEIGHBOURS + 1, len(gaussians))
    distances, near = nearest(gaussians.means, gaussians.means[rows], count)
    involved, place = np.unique(np.concatenate([rows, near.ravel()]), return_inverse=True)
    place = place.reshape(-1)
    own, place_of = place[: len(rows)], place[len(rows) :].reshape(near.shape)
    means = gaussians.means[involved]
    covars = _covars(gaussians.quats[involved], gaussians.scales[involved].astype(np.float64) / radius)
    # Visible extent, in deviations.
    sigmas = np.sqrt(2 * np.log(np.maximum(opacities[involved] / FAINTEST, 1)))
    pairs = []
    for start in range(0, len(rows), _ROWS_AT_A_TIME):
        part = slice(start, min(start + _ROWS_AT_A_TIME, len(rows)))
        first, others = own[part], place_of[part, 1:]
        lines = means[others] - means[first, None]
        lengths = np.maximum(distances[part, 1:], 1e-30)
        lines = lines / lengths[..., None].astype(lines.dtype)
        reach = _widths(covars[first, None], lines) * sigmas[first, None]
        reach += _widths(covars[others], lines) * sigmas[others]
        i, k = np.nonzero(distances[part, 1:] < radius * reach)
        pairs.append(involved[first[i]] * len(gaussians) + involved[others[i, k]])
    if not pairs:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    first, second = np.divmod(np.concatenate(pairs), len(gaussians))
    keys = np.minimum(first, second) * len(gaussians) + np.maximum(first, second)
    keys.sort()
    first, second = np.divmod(keys[np.diff(keys, prepend=-1) > 0], len(gaussians))
    return first, second


def _covars(quats: Array, scales: Array) -> Array:
    """[N, 6] covariances: xx, yy, zz, xy, xz, yz."""
    axes = rotation_matrices(quats) * np.minimum(scales, LARGEST)[:, None]
    x, y, z = (axes[:, row] for row in range(3))
    products = ((x, x), (y, y), (z, z), (x, y), (x, z), (y, z))
    return np.stack([(a * b).sum(axis=1) for a, b in products], axis=1).astype(np.float32)


def _widths(covars: Array, lines: Array) -> Array:
    """Standard deviations of covariances along unit vectors."""
    x, y, z = lines[..., 0], lines[..., 1], lines[..., 2]
    squares = covars[..., 0] * x * x + covars[..., 1] * y * y + covars[..., 2] * z * z
    squares += 2 * (covars[..., 3] * x * y + covars[..., 4] * x * z + covars[..., 5] * y * z)
    return np.sqrt(np.maximum(squares, 0))


def _outside_bodies(
    opacities: Array, a: NDArray[np.int64], b: NDArray[np.int64], is_dense: Mask
) -> tuple[Mask, NDArray[np.int32]]:
    """Mask of the rows that belong to no body, and the group of each row, given the touching pairs.

    Dense rows belong to a body.

    Source: Ester et al. 1996, A density-based algorithm (DBSCAN: core and border points).
    """
    num_rows = len(opacities)
    is_core = np.bincount(a, minlength=num_rows) + np.bincount(b, minlength=num_rows) >= MANY
    is_core |= is_dense
    both = is_core[a] & is_core[b]
    groups = components(num_rows, a[both], b[both])
    for here, there in ((a, b), (b, a)):  # border points join the group of a core point
        is_border = ~is_core[here] & is_core[there]
        groups[here[is_border]] = groups[there[is_border]]
    counts = np.bincount(groups, minlength=num_rows)
    sums = np.bincount(groups, opacities, minlength=num_rows)
    is_haze = sums < HAZE * counts
    is_body = (counts >= max(FEW_ROWS, FEW_SHARE * num_rows)) | (sums >= np.where(is_haze, SOLID_HAZE, SOLID))
    is_body[groups[is_dense]] = True
    is_detached = ~is_body[groups]
    for _ in range(CHAIN):
        attached_a, attached_b = is_detached[a] & ~is_detached[b], is_detached[b] & ~is_detached[a]
        is_detached[a[attached_a]] = False
        is_detached[b[attached_b]] = False
    return np.asarray(is_detached), groups
