"""The ground of a captured scene: a plaza, a cloth, or the paper below an object.

It is level paint at the foot of the subject, larger than the subject. The table of the stage continues it at
the same level and in the same color, and its torn border dissolves into the paint of the table.
"""

from dataclasses import dataclass, replace

import numpy as np

from brushgs.passes.add.ground_maps import Grid, blurred
from brushgs.passes.add.stage_place import Place
from brushgs.values.arrays import F64, Mask, smoothstep
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.gaussians import Gaussians
from brushgs.values.quats import shortest_axes
from brushgs.values.sh import C0, base_colors

SIDE, REACH = 96, 2.0  # cells of a map, and half its side in radii of the subject
LEVEL = 0.85  # minimum cosine between the normal of a level Gaussian and up
LOW = 0.4  # of the height of a scene, below which its ground is searched for
BIN, BAND = 0.02, 0.07  # of heights, and half the thickness of a ground, in radii
# Of six objects without a ground and three with one: the share of level paint in one band is 0.3 to 0.8 and
# 0.8 to 1, paint below it over that in it 0.03 to 3.7 and 0 to 0.3, and the area that nothing stands on, in
# areas of what stands on it, up to 0.7 and from 2.7.
SHARE, BELOW, BEYOND = 0.6, 0.6, 1.2
COVERED, THIN = 0.4, 0.2  # minimum paint over area of a covered cell, for finding and for mapping a ground
EDGE = (0.45, 0.8)  # range of coverage over which a ground dissolves
HANGS = -0.4  # height, relative to the band, below which paint at the border hangs down
SMOOTH, CORE = 2.0, 0.9  # cells over which coverage is smoothed, and smoothed coverage far from the border
RIM = 0.75  # maximum coverage of the border of a ground
FILLS = ((1.0, 1.0), (3.0, 1e-2), (10.0, 1e-4), (30.0, 1e-7))  # cells over which color spreads, and its share
MUTED = 0.75  # chroma of the table, relative to the ground


@dataclass(frozen=True, eq=False)
class Ground:
    """The ground of a scene, as maps [SIDE, SIDE] by right and away around the foot.

    Attributes:
        place: of the subject, which stands on this ground.
        coverage: 0 to 1, smoothed: 1 inside, 0.5 at the border.
        lab: [SIDE, SIDE, 3] OKLab inside, spread beyond the border.
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
        lab = np.stack([grid.samples(self.lab[..., k], level) for k in range(3)], axis=1)
        return grid.samples(self.coverage, level), lab

    def is_on(self, points: F64) -> Mask:
        """[n] whether local points [n, 3] belong to the ground, not to objects on it."""
        return np.asarray(np.abs(points[:, 1]) < BAND * self.place.radius)


def find_ground(gaussians: Gaussians, place: Place, weights: F64) -> Ground | None:
    """The ground of a scene, or None."""
    points = place.local(gaussians.means)
    is_level = np.abs(shortest_axes(gaussians.quats, gaussians.scales) @ place.axes[1]) > LEVEL
    level = _find_level(points, place, weights * is_level)
    if level is None:
        return None
    place = replace(place, foot=place.foot + level * place.axes[1], height=place.height - level)
    points = points - (0, level, 0)
    grid, at = _grid(place), points[:, [0, 2]]
    in_band = np.abs(points[:, 1]) < BAND * place.radius
    is_above, is_below = ~in_band & (points[:, 1] > 0), ~in_band & (points[:, 1] < 0)
    if weights[is_below].sum() > BELOW * weights[in_band].sum():
        return None
    is_covered = grid.sums(at, weights * in_band) > COVERED * grid.cell**2
    is_stood_on = grid.sums(at, weights * is_above) > COVERED * grid.cell**2
    if (is_covered & ~is_stood_on).sum() < BEYOND * max(int(is_stood_on.sum()), 1):
        return None
    return _mapped(gaussians, points, place, weights * in_band, is_stood_on)


def _find_level(points: F64, place: Place, weights: F64) -> float | None:
    """The height over the foot with most level paint; None if it is spread over many heights."""
    rows = np.flatnonzero((points[:, 1] < LOW * place.height) & (weights > 0))
    heights, paint = points[rows, 1] / place.radius, weights[rows]
    if not paint.sum() > 0:
        return None
    bins = np.floor((heights - heights.min()) / BIN).astype(np.int64)
    width = 2 * round(BAND / BIN) + 1
    peak = int(np.convolve(np.bincount(bins, paint), np.ones(width), "same").argmax())
    near = np.abs(bins - peak) <= width // 2
    if paint[near].sum() < SHARE * paint.sum():
        return None
    return float(np.average(heights[near], weights=paint[near]) * place.radius)


def _mapped(gaussians: Gaussians, points: F64, place: Place, weights: F64, standing: Mask) -> Ground | None:
    """The maps of a ground, from paint of `weights` [N] around objects; None if scattered."""
    grid, level = _grid(place), points[:, [0, 2]]
    lab = oklab_of(base_colors(gaussians.sh[:, :1]).astype(np.float64))
    paint = grid.sums(level, weights)
    coverage = blurred(((blurred(paint, 1.0) > THIN * grid.cell**2) | standing).astype(np.float64), SMOOTH)
    is_covered = coverage > 0.5
    if not is_covered.any():
        return None
    known = paint * (coverage > CORE) * ~standing
    known = known if known.any() else paint
    sums = [grid.sums(level, weights * lab[:, k]) * (known > 0) for k in range(3)]
    total, filled = np.zeros_like(known), np.zeros((*known.shape, 3))
    for blur, share in FILLS:
        total += share * blurred(known, blur)
        filled += share * np.stack([blurred(each, blur) for each in sums], axis=2)
    is_rim = is_covered & (coverage < RIM)
    at_rim = weights * grid.samples(is_rim.astype(np.float64), level)
    tone = _usual(lab, at_rim if at_rim.any() else weights) * (1, MUTED, MUTED)
    bare = 1e-9 * total.max()  # farther from the ground than color spreads
    lab_map = (filled + bare * tone) / (np.maximum(total, 0) + bare)[..., None]
    at = np.argwhere(is_covered) - 0.5 * (SIDE - 1)
    extent = float(np.percentile(np.hypot(*at.T), 95)) * grid.cell
    return Ground(place, coverage, lab_map, tone, extent)


def _usual(lab: F64, weights: F64) -> F64:
    """[3] the most frequent color of [n, 3] OKLab: the mean around its most frequent lightness."""
    bins = np.clip((lab[:, 0] * 25).astype(np.int64), 0, 24)
    peak = int(np.convolve(np.bincount(bins, weights, 25), np.ones(3), "same").argmax())
    near = weights * (np.abs(bins - peak) <= 1)
    return np.asarray(near @ lab / near.sum())


def dissolved(strokes: Gaussians, ground: Ground, table: F64 | None) -> Gaussians:
    """Strokes with a ground that blends into the table toward its border; those under the table are dropped.

    Args:
        strokes: N, in their painted colors.
        ground: of their scene.
        table: [3] OKLab of the table; None for bare paper, where the ground fades out.
    """
    points = ground.place.local(strokes.means)
    coverage, _ = ground.at(points)
    low, high = EDGE
    share = smoothstep(1 - (coverage - low) / (high - low)) * ground.is_on(points)
    heights = points[:, 1] / (BAND * ground.place.radius)
    is_under = (heights < -1) | ((heights < HANGS) & (coverage < CORE))
    left = np.where(is_under, 0.0, strokes.opacities)
    dtype = strokes.means.dtype
    if table is None:
        return replace(strokes, opacities=(left * (1 - share)).astype(dtype))
    sh = strokes.sh * (1 - share)[:, None, None]
    sh[:, 0] += share[:, None] * (np.clip(rgb_of_oklab(table[None]), 0, 1) - 0.5) / C0
    return replace(strokes, sh=sh.astype(dtype), opacities=left.astype(dtype))


def _grid(place: Place) -> Grid:
    return Grid(SIDE, REACH * place.radius)
