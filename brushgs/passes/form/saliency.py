"""Saliency of Gaussians, 0 to 1: where the eye goes first, and painters take a small brush.

Cues are measured in an upright grid around the scene: difference of color from the surroundings, warm
colors of skin in other surroundings, local variation of color, thin paint (a line or a knob, not a wall),
and the top of upright objects. Faces and hands have priority; the other cues count in the middle of the
subject, or of the view.

Colors are weighted by paint, and cells with little paint take the color of their surroundings: a floater is
not salient. Lengths are radii of the subject; in a scene seen from inside approximately angles at the eye.
The color cast of the light of a whole scene is removed before skin is detected.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.cameras.framing import camera_axes
from brushgs.passes.reduce.contribution import seen_areas
from brushgs.values.arrays import F32, F64, Array, Rows, gaussian_weights, smoothstep
from brushgs.values.camera import FirstView
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors

REACH = 2.0  # of the grid to each side, radii; positions beyond are contracted into it
CELLS = 64  # of the grid along each axis
NEAR, AROUND = 0.05, 0.22  # standard deviations of a place, and of its surroundings
DOUBT = 0.3  # of the usual paint of a place, added to every place in the color of its surroundings
INSIDE = 0.5  # of the median distance from the eye: nearer objects are not magnified further
# Skin in OKLab: hue, middle and half width; chroma and lightness from none to full to none.
SKIN_HUE, SKIN_HUE_WIDTH = float(np.radians(52.0)), float(np.radians(26.0))
SKIN_CHROMA = (0.025, 0.06, 0.13, 0.18)
SKIN_LIGHT = (0.22, 0.38, 0.90, 0.97)
# Share of all paint around a place that is skin: up to the first value it is a face or a hand, from the
# second on a wooden body. Face and hands of standing people have 0.005 to 0.03, the top of a guitar 0.06 to
# 0.11.
SKIN_PART = (0.03, 0.06)
ADAPTED, MOST_CAST = 0.7, 0.05  # share of a scene's mean a and b that counts as its light, and the maximum
FULL_CONTRAST, FULL_DETAIL = 0.16, 0.06  # OKLab distances
LIGHTNESS_WEIGHT = 0.6  # of L in them: shadows are dark, but not salient
ACROSS, COLUMN = 0.07, 0.35  # of a column; height over which the weight of an object in it falls to 1/e
MIDDLE = 0.5  # deviation, radii or radians
# Shares of the paint below which nothing is in focus and above which everything is; and the signs of skin,
# and of other things, from which some of it is in focus.
SKIN_SHARES, OTHER_SHARES = (0.94, 0.99), (0.85, 0.98)
SKIN_SIGNS, OTHER_SIGNS = (0.10, 0.30), (0.10, 0.30)
TINY = 1e-30


def saliency(gaussians: Gaussians, view: FirstView) -> F64:
    """Saliency of Gaussians, [N] 0 to 1; above 0 for about a tenth of the paint of a scene.

    Args:
        gaussians: N Gaussians.
        view: first view of the scene: subject, up axis, and the eye if inside.

    Independent of unit and position of the scene, and except for rounding of the order of the rows.
    """
    if len(gaussians) == 0:
        return np.zeros(0)
    grid, weights = _grid_of(gaussians, view)
    if not weights.max() > 0:
        return np.zeros(len(gaussians))
    lab = oklab_of(base_colors(gaussians.sh))
    paint = grid.sums(weights)
    near, around = grid.blurred(paint, NEAR), grid.blurred(paint, AROUND)
    doubt = DOUBT * float(np.median(near[paint > 0]))
    contrast, detail = _contrasts(grid, weights, lab, near, around, doubt)
    cast = np.average(lab[:, 1:], axis=0, weights=weights)
    cast *= min(ADAPTED, MOST_CAST / max(float(np.hypot(*cast)), TINY))
    skin_paint = grid.sums(weights * _skin_likeness(lab - [0.0, *cast]))
    skin_around = grid.blurred(skin_paint, AROUND)
    wide = skin_around / np.maximum(around, TINY)
    here = (grid.blurred(skin_paint, NEAR) + doubt * wide) / (near + doubt)
    top, middle = grid.top(paint), grid.middle(view)
    known = np.maximum(grid.blurred(near, NEAR), TINY)
    skin = grid.blurred(smoothstep(2 * (here - wide)) * near, NEAR) / known
    part = skin_around * (_VOLUME / float(paint.sum(dtype=np.float64)))
    skin *= (1 + 0.4 * top) * (0.25 + 0.75 * middle)
    skin *= smoothstep((SKIN_PART[1] - part) / (SKIN_PART[1] - SKIN_PART[0]))
    other = contrast * (0.35 + 0.25 * _thinness(near, around) + 0.4 * top) + detail * (0.3 + 0.4 * top)
    other = grid.blurred(other * near, NEAR) / known * middle
    hidden = (1 - _skin_focus(skin, paint)) * (1 - _other_focus(other, paint))
    return np.asarray(np.clip(grid.at(1 - hidden), 0, 1))


def _contrasts(
    grid: "_Grid", weights: Array, lab: F64, near: Array, around: Array, doubt: float
) -> tuple[F64, F64]:
    """Difference of cells from the colors around, and their additional variation, both 0 to 1."""
    scaled = lab * (LIGHTNESS_WEIGHT, 1.0, 1.0)
    away, mean_squares, wide_squares = np.zeros((3, *near.shape))
    for column in scaled.T:
        sums = grid.sums(weights * column)
        wide, blurred = grid.blurred(sums, AROUND) / np.maximum(around, TINY), grid.blurred(sums, NEAR)
        away = away + ((blurred + doubt * wide) / (near + doubt) - wide) ** 2
        mean_squares = mean_squares + (blurred / np.maximum(near, TINY)) ** 2
        wide_squares = wide_squares + wide**2
    squares = grid.sums(weights * np.einsum("nc,nc->n", scaled, scaled))
    spread = grid.blurred(squares, NEAR) / np.maximum(near, TINY) - mean_squares
    spread_around = grid.blurred(squares, AROUND) / np.maximum(around, TINY) - wide_squares
    more = np.sqrt(np.maximum(spread, 0)) - np.sqrt(np.maximum(spread_around, 0))
    detail = smoothstep(more / FULL_DETAIL + 0.2) * near / (near + doubt)
    return smoothstep(np.sqrt(away) / FULL_CONTRAST), detail


def _thinness(near: Array, around: Array) -> F64:
    """Thinness of paint at each cell: 1 for a line or a point, 0 for a surface or a body.

    The density of d-dimensional paint within a deviation s is proportional to s^(d - 3).
    """
    ratio = np.maximum(near, TINY) / np.maximum(around, TINY)
    return smoothstep(np.log(ratio) / np.log(AROUND / NEAR) - 1)


def _skin_focus(signs: Array, paint: Array) -> F64:
    """Cells that look like skin, 0 to 1: those with clear signs, but no more than the clearest few."""
    low, high = _quantiles(signs, paint, SKIN_SHARES)
    low = max(low, SKIN_SIGNS[0])
    high = max(min(high, SKIN_SIGNS[1]), low + 0.1)
    return smoothstep((signs - low) / (high - low))


def _other_focus(signs: Array, paint: Array) -> F64:
    """Other salient cells, 0 to 1: the first few, with decreasing weight."""
    low, high = _quantiles(signs, paint, OTHER_SHARES)
    least, full = OTHER_SIGNS
    strength = float(smoothstep(np.array((high - least) / (full - least))))
    return np.asarray(strength * smoothstep((signs - low) / max(high - low, 1e-9)))


def _quantiles(values: Array, paint: Array, shares: tuple[float, float]) -> tuple[float, float]:
    """Quantiles of cell values, weighted by paint."""
    used = paint > 0
    order = np.argsort(values[used], kind="stable")
    below = np.cumsum(paint[used][order])
    low, high = np.interp(shares, below / below[-1], values[used][order])
    return float(low), float(high)


@dataclass(frozen=True, eq=False)
class _Grid:
    """Cells around a scene; its axes are right, down and forward of a level view.

    Attributes:
        places: [N, 3] of the Gaussians, in cells from the corner of the grid.
        cells: [N] the cell of each.
    """

    places: F64
    cells: Rows

    def sums(self, values: Array) -> F32:
        """[CELLS, CELLS, CELLS] sums of values [N] by cell."""
        sums = np.bincount(self.cells, values, CELLS**3)
        return sums.reshape((CELLS,) * 3).astype(np.float32)  # of half the time; signs are coarse

    def blurred(self, values: Array, deviation: float) -> Array:
        """Values of cells blurred by a Gaussian of this standard deviation, radii; zero outside."""
        kernel = _kernel(deviation)
        kernel /= kernel[CELLS // 2].sum()
        return _along(kernel, 2, _along(kernel, 1, _along(kernel, 0, values)))

    def top(self, paint: Array) -> F64:
        """Excess of paint below each cell over paint above, 0 (none) to 1 (all paint below)."""
        across = _kernel(ACROSS)
        spread = _along(across, 2, _along(across, 0, paint))
        down = _STEPS - _STEPS[:, None]  # from the cell of a row to that of a column
        below = np.exp(-np.maximum(down, 0) / COLUMN) * (down > 0.5 * AROUND)
        under, over = _along(below, 1, spread), _along(below.T, 1, spread)
        return smoothstep(1.6 * (under - over) / np.maximum(under + over, TINY) - 0.2)

    def middle(self, view: FirstView) -> F64:
        """Nearness of cells to the middle of the subject, or inside a scene to that of the view; 0 to 1."""
        x, y, z = np.meshgrid(_STEPS, _STEPS, _STEPS, indexing="ij", sparse=True)
        squares = x * x + y * y + z * z
        if view.eye is None:
            return np.asarray(np.exp(-0.5 * squares / MIDDLE**2))
        axes = camera_axes(view.up, 0.0, 0.0)
        ahead = axes @ camera_axes(view.up, view.azimuth, view.elevation)[2]
        cosine = (x * ahead[0] + y * ahead[1] + z * ahead[2]) / np.sqrt(np.maximum(squares, TINY))
        return np.asarray(np.exp((cosine - 1) / MIDDLE**2))

    def at(self, values: Array) -> F64:
        """[N] values of cells at the Gaussians, interpolated linearly."""
        low = np.clip(np.floor(self.places - 0.5), 0, CELLS - 2).astype(np.intp)
        part = np.clip(self.places - 0.5 - low, 0, 1)
        shares, found = np.stack([1 - part, part]), np.zeros(len(self.places))
        for x, y, z in np.ndindex(2, 2, 2):
            share = shares[x, :, 0] * shares[y, :, 1] * shares[z, :, 2]
            found += share * values[low[:, 0] + x, low[:, 1] + y, low[:, 2] + z]
        return found


_STEPS = (np.arange(CELLS) + 0.5) * (2 * REACH / CELLS) - REACH  # middles of cells, radii
_VOLUME = (np.sqrt(2 * np.pi) * AROUND * CELLS / (2 * REACH)) ** 3  # of the surroundings of a place, cells


def _kernel(deviation: float) -> F64:
    """[CELLS, CELLS] weights of a blur with this standard deviation, radii."""
    return gaussian_weights(CELLS, deviation * CELLS / (2 * REACH), least=1e-20)  # three in a float32 product


def _along(kernel: Array, axis: int, values: Array) -> Array:
    """A kernel [CELLS, CELLS] applied along one axis of the cells."""
    kernel = kernel.astype(values.dtype)
    if axis == 0:  # a single product would start threads, which is slower
        return np.asarray((kernel @ values.swapaxes(0, 1)).swapaxes(0, 1))
    return np.asarray(kernel @ values if axis == 1 else values @ kernel.T)


def _grid_of(gaussians: Gaussians, view: FirstView) -> tuple[_Grid, Array]:
    """The grid, and the paint of each Gaussian [N] in it, at most that of a full place."""
    means = gaussians.means.astype(np.float64)
    if view.eye is not None:
        away = means - view.eye
        distances = np.linalg.norm(away, axis=1)
        radius = INSIDE * float(np.median(distances)) or 1.0
        factors = np.arcsinh(distances / radius) / np.maximum(distances, 1e-9 * radius)
    else:
        low, high = view.points.min(axis=0), view.points.max(axis=0)
        away = means - 0.5 * (low + high)
        radius = 0.5 * float(np.linalg.norm(high - low)) or 1.0
        distances = np.maximum(np.linalg.norm(away, axis=1) / radius, 1.0)
        factors = (2 - 1 / distances) / distances / radius
    places = (away * factors[:, None]) @ camera_axes(view.up, 0.0, 0.0).T
    places = np.clip((places / REACH + 1) * (0.5 * CELLS), 0, CELLS)
    rows = np.minimum(places.astype(np.intp), CELLS - 1)
    with np.errstate(over="ignore", under="ignore", invalid="ignore"):
        areas = np.fmin(seen_areas(gaussians) * factors**2, NEAR**2)
    return _Grid(places, np.ravel_multi_index(tuple(rows.T), (CELLS,) * 3)), gaussians.opacities * areas


def _skin_likeness(lab: F64) -> F64:
    """Similarity of OKLab colors [N, 3] to skin of any tone in any light, [N] 0 to 1."""
    lightness, chroma = lab[:, 0], np.hypot(lab[:, 1], lab[:, 2])
    hue = np.abs(np.arctan2(lab[:, 2], lab[:, 1]) - SKIN_HUE) / SKIN_HUE_WIDTH
    return np.asarray(smoothstep(2 - hue) * _band(chroma, SKIN_CHROMA) * _band(lightness, SKIN_LIGHT))


def _band(values: F64, ends: tuple[float, float, float, float]) -> F64:
    low, from_low, to_high, high = ends
    return smoothstep((values - low) / (from_low - low)) * smoothstep((high - values) / (high - to_high))
