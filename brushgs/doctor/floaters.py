"""Floaters: Gaussians, alone or a few together, that hang in the air apart from everything solid.

Position alone does not tell them: a large Gaussian far from its neighbours may be a wall, a small one the
same distance off a speck of dust. So distances are taken in units of what can be seen of the two: half
lengths along the line between them, out to where the opacity has faded. Two Gaussians touch where these
meet. What has many touching neighbours is part of a body, and so is what hangs on to it in a short chain
(grass, wires, whiskers); bodies are large or solid. All else is apart; and surely so where the way to the
nearest body is a good part of the scene.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from brushgs.arrays import Array, Mask
from brushgs.doctor.space import NUM_NEIGHBOURS, nearest
from brushgs.passes.contribution import projected_areas
from brushgs.passes.extent import robust_frame
from brushgs.quats import rotation_matrices
from brushgs.scene import Gaussians

FAINTEST = 0.02  # opacity at which a Gaussian ends: what is thinner joins nothing
# The 99th percentile of the opacities is 0.83 and more in real scenes. Where it is less, the scene is faint
# as a whole, and its opacities count as so much higher.
STRONG = 0.8
MANY = 6  # touching neighbours that make a Gaussian part of a body: a dense fog of strays has fewer
CHAIN = 4  # Gaussians that may hang on to a body in a row
# A piece of so few Gaussians is a body only if it is solid: its opacities sum to SOLID. The pieces that hang
# around koala and chair sum to at most 1.6 and 3.0 (those above 2 are haze: mean opacity below 0.1), a flower
# head of the sunflowers to 8, a lamp or leaf of the truck to 3 and more.
FEW_ROWS, FEW_SHARE = 100, 0.001
SOLID, HAZE, SOLID_HAZE = 2.0, 0.15, 5.0
# Radii of the scene between a floater and the nearest body. koala's are 0.097 to 0.34 away, those of the
# chair 0.28 in the median; fuzz on surfaces and cut leaves of grass stay below 0.05.
SURE_GAP, STRONG_GAP = 0.08, 0.03
# Area painted by all of them over the squared radius. Sound scenes: at most 4.8e-5 (sunflowers); truck 9e-4
# (scraps of sky), koala 1.3e-3, chair 2.7e-2.
VISIBLE = 1e-4
# Share of the rows: where more hangs in the air, there are no bodies to be apart from. Of a fragment of 1,000
# scattered points 0.7 do; of the chair with its haze 0.04.
MOST_ROWS = 0.3
FEWEST_ROWS = 200
LARGEST = 1e6  # radii; beyond, squares might leave the range of float32
_BLOCK = 1 << 16  # rows at a time: their neighbours take some 100 MB


@dataclass(frozen=True)
class Apart:
    """How far each Gaussian is from the bodies.

    Attributes:
        gaps: [N] radii of the scene to the nearest body, 0 for what belongs to one.
        areas: [N] painted, over the squared radius.
        has_bodies: whether enough of the scene is solid to say so.
    """

    gaps: NDArray[np.float64]
    areas: NDArray[np.float64]
    has_bodies: bool

    def beyond(self, gap: float) -> Mask:
        """Those further than so many radii from any body."""
        return np.asarray(self.gaps > gap)


def find_apart(gaussians: Gaussians) -> Apart:
    """Measure how far apart each Gaussian is.

    Args:
        gaussians: N of them, no two at one place (a few are no harm), far outliers left out.
    """
    num_rows = len(gaussians)
    _, radius = robust_frame(gaussians.means)
    areas = projected_areas(gaussians.scales) * gaussians.opacities / radius**2
    nothing = Apart(np.zeros(num_rows), areas, False)
    if num_rows < FEWEST_ROWS:
        return nothing
    strong = float(np.percentile(gaussians.opacities, 99))
    opacities = gaussians.opacities / max(min(strong / STRONG, 1.0), 1e-6)
    a, b = _touching_pairs(gaussians, opacities, radius)
    is_apart, pieces = _outside_bodies(opacities, a, b)
    if is_apart.all():
        return nothing
    gaps = np.zeros(num_rows)
    if is_apart.any():
        distances, _ = nearest(gaussians.means[~is_apart], gaussians.means[is_apart], 1)
        least = np.full(num_rows, np.inf)  # a piece is as far off as the nearest of it
        np.minimum.at(least, pieces[is_apart], distances[:, 0] / radius)
        gaps[is_apart] = least[pieces[is_apart]]
    return Apart(gaps, areas, bool((gaps > SURE_GAP).mean() <= MOST_ROWS))


def _touching_pairs(
    gaussians: Gaussians, opacities: Array, radius: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Mask of all pairs of neighbours that touch, each pair once."""
    count = min(NUM_NEIGHBOURS + 1, len(gaussians))
    distances, near = nearest(gaussians.means, gaussians.means, count)
    covars = _covars(gaussians.quats, gaussians.scales.astype(np.float64) / radius)
    sigmas = np.sqrt(2 * np.log(np.maximum(opacities / FAINTEST, 1)))  # where it has faded to that
    pairs = []
    for start in range(0, len(gaussians), _BLOCK):
        rows = slice(start, min(start + _BLOCK, len(gaussians)))
        others = near[rows, 1:]
        lines = gaussians.means[others] - gaussians.means[rows, None]
        lengths = np.maximum(distances[rows, 1:], 1e-30)
        lines = lines / lengths[..., None].astype(lines.dtype)
        reach = _widths(covars[rows, None], lines) * sigmas[rows, None]
        reach += _widths(covars[others], lines) * sigmas[others]
        i, k = np.nonzero(distances[rows, 1:] < radius * reach)
        pairs.append((i + start) * len(gaussians) + others[i, k])
    first, second = np.divmod(np.concatenate(pairs), len(gaussians))
    keys = np.minimum(first, second) * len(gaussians) + np.maximum(first, second)
    keys.sort()
    first, second = np.divmod(keys[np.diff(keys, prepend=-1) > 0], len(gaussians))
    return first, second


def _covars(quats: Array, scales: Array) -> Array:
    """[N, 6] xx, yy, zz, xy, xz, yz."""
    axes = rotation_matrices(quats) * np.minimum(scales, LARGEST)[:, None]
    x, y, z = (axes[:, row] for row in range(3))
    products = ((x, x), (y, y), (z, z), (x, y), (x, z), (y, z))
    return np.stack([(a * b).sum(axis=1) for a, b in products], axis=1).astype(np.float32)


def _widths(covars: Array, lines: Array) -> Array:
    """Standard deviation along unit vectors."""
    x, y, z = lines[..., 0], lines[..., 1], lines[..., 2]
    squares = covars[..., 0] * x * x + covars[..., 1] * y * y + covars[..., 2] * z * z
    squares += 2 * (covars[..., 3] * x * y + covars[..., 4] * x * z + covars[..., 5] * y * z)
    return np.sqrt(np.maximum(squares, 0))


def _outside_bodies(
    opacities: Array, a: NDArray[np.int64], b: NDArray[np.int64]
) -> tuple[Mask, NDArray[np.int32]]:
    """Mask that belong to no body, and the piece that each row is part of, given the pairs that touch.

    Source of the rule of cores and rims: Ester et al. 1996, A density-based algorithm (DBSCAN).
    """
    num_rows = len(opacities)
    is_core = np.bincount(a, minlength=num_rows) + np.bincount(b, minlength=num_rows) >= MANY
    both = is_core[a] & is_core[b]
    pieces = _components(num_rows, a[both], b[both])
    for here, there in ((a, b), (b, a)):  # the rim of a piece touches a core of it
        rim = ~is_core[here] & is_core[there]
        pieces[here[rim]] = pieces[there[rim]]
    counts = np.bincount(pieces, minlength=num_rows)
    sums = np.bincount(pieces, opacities, minlength=num_rows)
    is_haze = sums < HAZE * counts
    is_body = (counts >= max(FEW_ROWS, FEW_SHARE * num_rows)) | (sums >= np.where(is_haze, SOLID_HAZE, SOLID))
    is_apart = ~is_body[pieces]
    for _ in range(CHAIN):
        hangs_a, hangs_b = is_apart[a] & ~is_apart[b], is_apart[b] & ~is_apart[a]
        is_apart[a[hangs_a]] = False
        is_apart[b[hangs_b]] = False
    return np.asarray(is_apart), pieces


def _components(num_rows: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int32]:
    """The connected piece of each row."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    links = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(num_rows, num_rows))
    return np.asarray(connected_components(links, directed=False)[1])
