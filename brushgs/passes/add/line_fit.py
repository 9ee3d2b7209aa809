"""Turn chains in space into strokes: each chain becomes a row of thin, nearly straight, overlapping pieces.

Where a chain bends, pieces are shorter: one over an arc of curvature k that is s long leaves it by s^2 k / 8,
so a density of root(k / (8 d)) pieces leaves it by d everywhere. Unlike a polyline of the fewest corners
(Douglas and Peucker 1973), whose pieces meet at angles, such pieces turn a little each, and there is no loop
over chains.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from brushgs.passes.add.line_lift import Chains
from brushgs.values.along import Along
from brushgs.values.arrays import F64, Array, Rows
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import quats_of
from brushgs.values.sh import C0

DEVIATION = 0.25  # maximum distance of a piece from its line, in widths
ARM = 2  # points to each side for measuring a bend: nearer ones show the grid of pixels
LONGEST = 40.0  # widths of a piece
OVERLAP = 0.35  # widths, usual overlap of pieces at each end
TAPER = 9.0  # widths over which a free end tapers
SHORT = 0.35  # of a line, at most, at each end
THIN = 0.3  # of the width, at a free end
TINY = np.finfo(np.float64).tiny


@dataclass(frozen=True, eq=False)
class Pieces:
    """L nearly straight pieces of lines.

    Attributes:
        centers: [L, 3] world units.
        axes: [L, 3] unit vectors along the line.
        halves: [L] half lengths, world units, including the overlap.
        widths: [L] world units.
        strengths: [L] see `EdgePoints`.
        normals: [L, 3] see `Chains`.
        chains: [L] line of each piece, ascending.
    """

    centers: F64
    axes: F64
    halves: F64
    widths: F64
    strengths: F64
    normals: F64
    chains: Rows


def fit(chains: Chains, widths: F64, overlap: float = OVERLAP) -> Pieces:
    """Fit pieces to chains, tapered at free ends.

    Args:
        chains: P points.
        widths: [P] of the line, world units.
        overlap: widths by which each end of a piece overlaps the next.
    """
    along = Along.of(chains.chains)
    if not len(chains):
        space, number = np.zeros((0, 3)), np.zeros(0)
        return Pieces(space, space, number, number, number, space, along.chains)
    widths = widths * _tapers(chains.points, widths, along)
    line = _amounts(chains.points, widths, along)
    ends = line[along.last == np.arange(len(along))]
    counts = np.diff(ends, prepend=-1.0).round().astype(np.intp) - 1
    knots = np.arange(counts.sum()) + np.repeat(np.arange(along.num), counts)

    def at(columns: F64, where: F64) -> F64:
        return np.stack([np.interp(where, line, column) for column in columns.T], axis=1)

    begin, middle, end = (at(chains.points, knots + share) for share in (0.0, 0.5, 1.0))
    rest = at(np.column_stack([widths, chains.strengths, chains.normals]), knots + 0.5)
    offsets = end - begin
    lengths = np.maximum(np.linalg.norm(offsets, axis=1), TINY)
    axes = offsets / lengths[:, None]
    # Between the chord and the height of the arc: equal distance from the line on either side.
    heights = middle - 0.5 * (begin + end)
    heights -= (heights * axes).sum(axis=1, keepdims=True) * axes
    centers = 0.5 * (begin + end + heights)
    halves = 0.5 * lengths + overlap * rest[:, 0]
    of_piece = np.repeat(np.arange(along.num), counts)
    return Pieces(centers, axes, halves, rest[:, 0], rest[:, 1], rest[:, 2:], of_piece)


def _tapers(points: F64, widths: F64, along: Along) -> F64:
    """[P] width of a line, as a share: less toward its ends, unless they meet."""
    at = np.cumsum(along.lengths(points))
    begin, end = at[along.first], at[along.last]
    reach = np.maximum(np.minimum(TAPER * widths, SHORT * (end - begin)), TINY)
    tapers = THIN + (1 - THIN) * np.sqrt(np.clip(np.minimum(at - begin, end - at) / reach, 0, 1))
    gaps = np.linalg.norm(points[along.first] - points[along.last], axis=1)
    is_closed = (gaps < 3 * widths) & (end - begin > 6 * widths)
    return np.where(is_closed, 1.0, tapers)


def _amounts(points: F64, widths: F64, along: Along) -> F64:
    """[P] positions on one number line for all chains: each piece has length 1, and chains are 1 apart."""
    before, after = points - points[along.near(-ARM)], points[along.near(ARM)] - points
    back, ahead = (np.maximum(np.linalg.norm(v, axis=1), TINY) for v in (before, after))
    turns = np.linalg.norm(after / ahead[:, None] - before / back[:, None], axis=1)
    turns[(along.first == np.arange(len(along))) | (along.last == np.arange(len(along)))] = 0
    bends = along.mean(turns / (0.5 * (back + ahead)), ARM)
    density = np.sqrt(bends / (8 * DEVIATION * widths)) + 1 / (LONGEST * widths)
    amounts = np.cumsum(0.5 * (density + density[along.near(-1)]) * along.lengths(points))
    amounts -= amounts[along.first]
    totals = amounts[along.last]
    counts = np.ceil(np.maximum(totals, TINY))
    counts_of_chain = counts[along.first == np.arange(len(along))]
    starts = np.cumsum(np.concatenate([[0.0], counts_of_chain + 1]))[:-1]
    return np.asarray(amounts / np.maximum(totals, TINY) * counts + starts[along.chains])


def strokes_of(
    pieces: Pieces, color: ArrayLike, opacity: float, num_sigmas: float, like: Gaussians
) -> Gaussians:
    """Strokes whose boxes, of `num_sigmas` standard deviations, are these pieces.

    Args:
        pieces: L.
        color: [3] RGB, display-encoded.
        opacity: 0 to 1.
        num_sigmas: > 0.
        like: the scene, for the dtype.
    """
    across = np.cross(pieces.axes, np.eye(3)[np.argmin(np.abs(pieces.axes), axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), TINY)
    rotations = np.stack([pieces.axes, across, np.cross(pieces.axes, across)], axis=2)
    scales = np.stack([pieces.halves, 0.5 * pieces.widths, 0.5 * pieces.widths], axis=1) / num_sigmas
    sh = np.tile((np.asarray(color, np.float64) - 0.5) / C0, (len(pieces.centers), 1, 1))
    opacities = np.full(len(pieces.centers), opacity)
    dtype = like.means.dtype
    columns: list[Array] = [pieces.centers, quats_of(rotations), scales, opacities, sh]
    return Gaussians(*(column.astype(dtype) for column in columns))
