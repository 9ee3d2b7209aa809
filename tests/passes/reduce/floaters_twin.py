"""What the core finds of floaters, in NumPy."""

import numpy as np
from scipy.spatial import cKDTree

from brushgs.passes.components import components
from brushgs.passes.extent import robust_frame
from brushgs.passes.neighbours import NUM_NEIGHBOURS, nearest
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.values.quats import rotation_matrices

FAINTEST, STRONG = 0.02, 0.8
MANY, CHAIN = 6, 4
FEW_ROWS, FEW_SHARE = 100, 0.001
SOLID, HAZE, SOLID_HAZE = 2.0, 0.15, 5.0
SURE_GAP, STRONG_GAP = 0.08, 0.03
MOST_ROWS, FEWEST_ROWS = 0.3, 200
CELL, DENSE, MOST_CELLS = 0.02, 8.0, 1 << 20
LARGEST = 1e6


def measure_detachment(gaussians):
    """Gaps [N], areas [N], and whether the scene has bodies."""
    num_rows = len(gaussians)
    _, radius = robust_frame(gaussians.means)
    areas = projected_areas(gaussians.scales) * gaussians.opacities / radius**2
    unknown = np.zeros(num_rows), areas, False
    if num_rows < FEWEST_ROWS:
        return unknown
    strong = float(np.percentile(gaussians.opacities.astype(np.float64), 99))
    opacities = gaussians.opacities.astype(np.float64) / max(min(strong / STRONG, 1.0), 1e-6)
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
    return gaps, areas, bool((gaps > SURE_GAP).mean() <= MOST_ROWS)


def _in_dense_cells(means, opacities, radius):
    places = np.floor((means - robust_frame(means)[0]) / (CELL * radius))
    cells, cell_of = np.unique(np.clip(places, -MOST_CELLS, MOST_CELLS), axis=0, return_inverse=True)
    cell_of = cell_of.reshape(-1)
    own = np.stack([np.bincount(cell_of, opacities), np.bincount(cell_of)], axis=1)
    sums, pairs = own.copy(), cKDTree(cells).query_pairs(1.5, np.inf, output_type="ndarray")
    np.add.at(sums, pairs, own[pairs[:, ::-1]])  # of the 26 around
    opacity, count = sums.T
    return ((opacity >= DENSE) & (opacity >= HAZE * count))[cell_of]


def _touching_pairs(gaussians, opacities, radius, rows):
    count = min(NUM_NEIGHBOURS + 1, len(gaussians))
    means = gaussians.means.astype(np.float64)
    distances, near = nearest(means, means[rows], count)
    scales = np.minimum(gaussians.scales.astype(np.float64) / radius, LARGEST)
    axes = rotation_matrices(gaussians.quats) * scales[:, None]
    sigmas = np.sqrt(2 * np.log(np.maximum(opacities / FAINTEST, 1)))
    lines = (means[near[:, 1:]] - means[rows, None]) / np.maximum(distances[:, 1:], 1e-30)[..., None]
    reach = _widths(axes[rows, None], lines) * sigmas[rows, None]
    reach += _widths(axes[near[:, 1:]], lines) * sigmas[near[:, 1:]]
    i, k = np.nonzero(distances[:, 1:] < radius * reach)
    pairs = np.sort(np.stack([rows[i], near[i, k + 1]], axis=1), axis=1)
    return np.unique(pairs, axis=0).T


def _widths(axes, lines):
    """Standard deviations along unit vectors."""
    return np.linalg.norm(np.einsum("...ij,...i->...j", axes, lines), axis=-1)


def _outside_bodies(opacities, a, b, is_dense):
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
