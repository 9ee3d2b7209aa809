"""Carry the paint of a scene to the palette of a painting, by a smooth color map that keeps structure.

Colors are split into luma and two chroma differences, all linear in display-encoded RGB. Structure is in
luma: luma after depends on luma before alone, by a rising curve of bounded slope, fitted to match the
quantiles of the painting. Chroma is free: samples of the scene's paint, at their new luma, are carried to the
painting's by sliced optimal transport. A smooth function of color is fitted to the result: an affine map and
a sum of wide Gaussian bumps, by ridge regression. Equal colors stay equal, and noise of the transport does
not enter the map. Sources: Pitie, Kokaram and Dahyot 2007, Automated color grading using color distribution
transfer; Rabin et al. 2011, Wasserstein barycenter and its application to texture mixing; Bonneel et al.
2015.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from brushgs.passes.color.color_map import Affine, ColorMap, difference_slopes
from brushgs.passes.style.features import StrokeFeatures
from brushgs.values.arrays import F64, Array, check
from brushgs.values.colors import LUMINANCE, oklab_of, rgb_of_oklab
from brushgs.values.style import Style, StylePalette

NUM_SAMPLES = 1024  # of the scene's paint and of the painting, equally weighted
SLOPES = 0.4, 2.5  # limits of the slope of the luma curve
NUM_KNOTS = 17  # of the curve, from black to white
KEPT = 0.005  # weight of the squared difference of the slope from 1, by paint, against squared luma
STIFFNESS = 0.02  # of the curve: weight of its second differences against the quantiles
ROUNDS, DIRECTIONS = 24, 16  # of the sliced transport
NUM_BUMPS = 96
WIDTHS = 0.20, 0.10  # of the bumps: luma, chroma
# Ridges of the bumps relative to their mean square: the first is used with which the map stretches color
# differences of the paint at most this much. More would turn the noise of a gray scene into confetti.
RIDGES = 0.004, 0.016, 0.064, 0.25, 1.0
MOST_STRETCH = 9.0
PURE = 0.95  # share of a painting with less chroma than its limit
LEAST_CHROMA = 0.012  # OKLab: a painting with a lower limit of chroma (about 4 in CIELAB) is black and white
KNEE = 0.7  # share of a limit of chroma from which compression starts
INK_EDGE = 0.03  # OKLab: softness of the change from one color of a print to the next
AFFINE_RIDGE = 1e-4  # ridge of the slopes of chroma, and their largest value, for the same reason
MOST_SLOPE = 3.0
_SEED = 20161

# Rows: luma, red - luma, blue - luma.
_SPLIT = np.array([LUMINANCE, np.array([1, 0, 0]) - LUMINANCE, np.array([0, 0, 1]) - LUMINANCE])
_JOIN = np.linalg.inv(_SPLIT)


@dataclass(frozen=True, eq=False)
class PaletteMap:
    """A color map from a scene to a painting, a `ColorMap`.

    Attributes:
        knots: [K] luma before, rising, evenly spaced.
        lumas: [K] luma after; a cubic of continuous slope between knots, linear beyond them.
        affine: [2, 4] chroma after = affine[:, :3] @ (luma, chroma) + affine[:, 3], plus the bumps.
        centers: [B, 3] of the bumps in luma and chroma before.
        weights: [B, 2] what each bump adds.
    """

    knots: F64
    lumas: F64
    affine: F64
    centers: F64
    weights: F64

    def colors(self, rgb: F64, features: StrokeFeatures | None = None) -> F64:
        """See `ColorMap`."""
        split = rgb @ _SPLIT.T
        after = np.empty_like(split)
        after[:, 0] = self._curve(split[:, 0])[0]
        bumps = _bumps(split, self.centers)
        after[:, 1:] = split @ self.affine[:, :3].T + self.affine[:, 3] + bumps @ self.weights
        return np.asarray(after @ _JOIN.T)

    def slopes(self, rgb: F64, after: F64, features: StrokeFeatures | None = None) -> F64:
        """See `ColorMap`."""
        split = rgb @ _SPLIT.T
        slopes = np.zeros((len(rgb), 3, 3))
        slopes[:, 0, 0] = self._curve(split[:, 0])[1]
        bumps = _bumps(split, self.centers)
        # d bump / d x = bump (center - x) / width^2
        pulled = bumps @ (self.weights[:, :, None] * self.centers[:, None]).reshape(len(self.centers), 6)
        turned = pulled.reshape(-1, 2, 3) - (bumps @ self.weights)[:, :, None] * split[:, None]
        slopes[:, 1:] = self.affine[:, :3] + turned / np.square(_widths())
        return np.asarray(_JOIN @ slopes @ _SPLIT)

    def _curve(self, luma: F64) -> tuple[F64, F64]:
        """[M] luma after, and its slope."""
        step = self.knots[1] - self.knots[0]
        rises = np.gradient(self.lumas, step)
        within = np.clip(luma, self.knots[0], self.knots[-1])
        place = (within - self.knots[0]) / step
        row = np.minimum(place.astype(np.intp), len(self.knots) - 2)
        t = place - row
        one, other = self.lumas[row], self.lumas[row + 1]
        m, n = rises[row] * step, rises[row + 1] * step
        value = one + t * (m + t * (3 * (other - one) - 2 * m - n + t * (2 * (one - other) + m + n)))
        slope = (m + t * (2 * (3 * (other - one) - 2 * m - n) + 3 * t * (2 * (one - other) + m + n))) / step
        return value + slope * (luma - within), slope


def is_grey(palette: StylePalette | None) -> bool:
    """Whether a painting is black and white."""
    return palette is not None and most_chroma(palette) < LEAST_CHROMA


@dataclass(frozen=True, eq=False)
class ChromaLimit:
    """A soft limit of chroma, a `ColorMap`; lightness and hue stay.

    Attributes:
        most: largest OKLab chroma; 0 gives grays.
    """

    most: float

    def colors(self, rgb: F64, features: StrokeFeatures | None = None) -> F64:
        """See `ColorMap`."""
        lab = oklab_of(rgb)
        chroma = np.hypot(lab[:, 1], lab[:, 2])
        knee, rest = KNEE * self.most, (1 - KNEE) * self.most
        over = np.maximum(chroma - knee, 0)
        limited = knee + rest * over / (rest + over) if self.most > 0 else np.zeros(len(lab))
        is_over = chroma > knee
        if not is_over.any():
            return rgb
        lab[is_over, 1:] *= (limited[is_over] / np.maximum(chroma[is_over], 1e-12))[:, None]
        found = np.array(rgb)
        found[is_over] = rgb_of_oklab(lab[is_over])
        return found

    def slopes(self, rgb: F64, after: F64, features: StrokeFeatures | None = None) -> F64:
        """See `ColorMap`."""
        return difference_slopes(self, rgb)


@dataclass(frozen=True, eq=False)
class FlatColors:
    """The tones of a print: each moves most of the way to the nearest of a few, a `ColorMap`.

    It is smooth, so tones between two of them do not jump. Hue and chroma stay: a print has more of both than
    a few colors show.

    Attributes:
        inks: [K, 3] OKLab.
        share: of the way, 0 to 1.
    """

    inks: F64
    share: float

    def flat(self, lab: F64) -> F64:
        """[N, 3] OKLab after, from OKLab before."""
        squares = ((lab[:, None] - self.inks) ** 2).sum(axis=2)
        weights = np.exp(-0.5 * (squares - squares.min(axis=1, keepdims=True)) / INK_EDGE**2)
        wanted = (weights / weights.sum(axis=1, keepdims=True)) @ self.inks[:, 0]
        return np.column_stack([lab[:, 0] + self.share * (wanted - lab[:, 0]), lab[:, 1:]])

    def colors(self, rgb: F64, features: StrokeFeatures | None = None) -> F64:
        """See `ColorMap`."""
        return rgb_of_oklab(self.flat(oklab_of(rgb)))

    def slopes(self, rgb: F64, after: F64, features: StrokeFeatures | None = None) -> F64:
        """Slope 1 everywhere: between two tones the map is steep and would amplify view-dependent color."""
        return np.tile(np.eye(3), (len(rgb), 1, 1))


def flat_colors(style: Style, share: float = 1.0) -> FlatColors:
    """The flat colors of a painting, as far as it is a print.

    Args:
        style: with a palette.
        share: of the way to them, if the painting is entirely a print.
    """
    assert style.palette is not None
    rgb = np.array([color.rgb for color in style.palette.colors])
    return FlatColors(oklab_of(np.clip(rgb, 0, 1)), share * style.flatness)


def most_chroma(palette: StylePalette) -> float:
    """The 95th percentile of the chroma of a painting, OKLab."""
    chroma = np.hypot(*oklab_of(np.clip(palette.samples, 0, 1))[:, 1:].T)
    order = np.argsort(chroma)
    sums = np.cumsum(palette.weights[order])
    return float(chroma[order][min(np.searchsorted(sums, PURE * sums[-1]), len(order) - 1)])


def palette_map(palette: StylePalette, rgb: Array, weights: Array) -> ColorMap:
    """The map that gives the paint of a scene the colors of a painting.

    Args:
        palette: of the painting.
        rgb: [N, 3] colors of the scene's paint, display-encoded.
        weights: [N] >= 0, amount of each, see `brushgs.passes.color.recolor.painted_weights`.

    Raises:
        TypeError: if an argument is not an array.
        ValueError: if the shapes do not fit.

    Equal inputs give equal maps. Without paint the map changes nothing.
    """
    check("palette_map", rgb=(rgb, "N 3"), weights=(weights, "N"))
    if not len(rgb) or not weights.sum() > 0:
        return Affine(np.eye(3), np.zeros(3))
    rng = np.random.default_rng(_SEED)
    source = _even(np.asarray(rgb, np.float64), np.asarray(weights, np.float64), rng) @ _SPLIT.T
    samples = np.clip(palette.samples, 0, 1)  # an artist may have moved a color out of range
    target = _even(samples, palette.weights, rng) @ _SPLIT.T
    knots, lumas = _luma_curve(source[:, 0], target[:, 0])
    start = PaletteMap(knots, lumas, np.zeros((2, 4)), np.zeros((0, 3)), np.zeros((0, 2)))
    moved = np.column_stack([start._curve(source[:, 0])[0], source[:, 1:]])
    arrived = _transported(moved, target, rng)
    for ridge in RIDGES:
        one = PaletteMap(knots, lumas, *_fitted(source, arrived, ridge))
        stretches = np.linalg.norm(one.slopes(source @ _JOIN.T, arrived), ord=2, axis=(1, 2))
        if np.quantile(stretches, 0.99) <= MOST_STRETCH:
            break
    return one


def _even(colors: F64, weights: F64, rng: np.random.Generator) -> F64:
    """[S, 3] colors that stand for equal weights."""
    order = np.argsort(colors @ LUMINANCE, kind="stable")
    sums = np.cumsum(weights[order])
    places = (np.arange(NUM_SAMPLES) + 0.5) / NUM_SAMPLES * sums[-1]
    return np.asarray(colors[order[np.minimum(np.searchsorted(sums, places), len(order) - 1)]])


def _luma_curve(source: F64, target: F64) -> tuple[F64, F64]:
    """Knots, and the luma at each: a fit to the quantiles of both, with bounded slope."""
    knots = np.linspace(0, 1, NUM_KNOTS)
    step = knots[1]
    before, after = np.sort(source), np.sort(target)
    place = np.clip(before / step, 0, NUM_KNOTS - 1 - 1e-9)
    row, share = place.astype(np.intp), place % 1
    # Unknowns: the luma at the first knot, and the slope of each piece.
    pieces = np.arange(NUM_KNOTS - 1)
    matrix = step * ((pieces < row[:, None]) + (pieces == row[:, None]) * share[:, None])
    matrix = np.column_stack([np.ones(len(before)), matrix]) / np.sqrt(len(before))
    stiff = np.zeros((NUM_KNOTS - 2, NUM_KNOTS))
    stiff[pieces[:-1], pieces[:-1] + 1], stiff[pieces[:-1], pieces[:-1] + 2] = -1, 1
    stiff *= STIFFNESS
    shares = np.bincount(row, minlength=NUM_KNOTS - 1) / len(before)
    kept = np.sqrt(KEPT * shares + 1e-6)  # toward slope 1, also without paint
    structure = np.zeros((NUM_KNOTS - 1, NUM_KNOTS))
    structure[pieces, pieces + 1] = kept
    rows = np.vstack([matrix, stiff, structure])
    wanted = np.concatenate([after / np.sqrt(len(before)), np.zeros(len(stiff)), kept])
    normal = np.linalg.cholesky(rows.T @ rows)
    right = np.linalg.solve(normal, rows.T @ wanted)
    bounds = np.array([(-1.0, *[SLOPES[0]] * len(pieces)), (2.0, *[SLOPES[1]] * len(pieces))])
    found = lsq_linear(normal.T, right, tuple(bounds)).x
    return knots, found[0] + np.concatenate([[0], np.cumsum(found[1:] * step)])


def _transported(source: F64, target: F64, rng: np.random.Generator) -> F64:
    """[S, 2] chroma to which sliced optimal transport carries the samples; their luma stays."""
    moved = source.copy()
    for _ in range(ROUNDS):
        directions = rng.normal(size=(DIRECTIONS, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        along, there = moved @ directions.T, target @ directions.T
        order = np.argsort(along, axis=0)
        ways = np.empty_like(along)
        np.put_along_axis(ways, order, np.sort(there, axis=0) - np.take_along_axis(along, order, 0), 0)
        # Three orthogonal directions carry three times the information of one.
        moved[:, 1:] += (3 / DIRECTIONS) * (ways @ directions)[:, 1:]
    return moved[:, 1:]


def _fitted(source: F64, arrived: F64, ridge: float) -> tuple[F64, F64, F64]:
    """The affine part, the centers and the weights of the bumps, see `PaletteMap`."""
    mean, goal = source.mean(axis=0), arrived.mean(axis=0)
    away = source - mean
    scatter = away.T @ away / len(source) + AFFINE_RIDGE * np.eye(3)
    slopes = np.linalg.solve(scatter, away.T @ (arrived - goal) / len(source)).T
    left, stretches, right = np.linalg.svd(slopes, full_matrices=False)
    slopes = (left * np.minimum(stretches, MOST_SLOPE)) @ right
    rest = arrived - goal - away @ slopes.T
    centers = np.unique(source[:: max(1, len(source) // NUM_BUMPS)], axis=0)
    bumps = _bumps(source, centers)
    between = _bumps(centers, centers)
    normal = bumps.T @ bumps / len(source) + ridge * between + 1e-9 * np.eye(len(centers))
    weights = np.linalg.solve(normal, bumps.T @ rest / len(source))
    return np.column_stack([slopes, goal - slopes @ mean]), centers, weights


def _widths() -> F64:
    return np.array([WIDTHS[0], WIDTHS[1], WIDTHS[1]])


def _bumps(split: F64, centers: F64) -> F64:
    """[M, B] height of each bump at each color."""
    one, other = split / _widths(), centers / _widths()
    squares = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2 * one @ other.T
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0)))
