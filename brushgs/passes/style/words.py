"""Words that fit a painting, a scene or its strokes: colors, light and marks, each with its figure.

Words follow from colors and shapes by the thresholds below. There is no language model, and nothing is known
of what is depicted. A word fits by 1/2 at its threshold, and by more beyond; the two words of a scale are its
ends, so at most one of them fits. Colors are OKLab; lengths are shares of the shorter side of the picture.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.style.color_names import color_name
from brushgs.passes.style.palette import learn_palette
from brushgs.rendering.areas import seen_areas
from brushgs.rendering.options import RenderOptions, project_with
from brushgs.rendering.visibility import visible_areas
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of
from brushgs.values.gaussians import Gaussians
from brushgs.values.style import Style, StyleMarks, StylePalette

FITS = 0.5  # least fit of a word
LARGE_SHARE = 0.2  # of a painting: a color with this share fits by 1/2
SMALL_SHARE = 0.04  # a color with a smaller share is not named
WARMEST = np.radians(65.0)  # hue between orange and yellow
GREY = 0.02  # chroma up to which colors count neither for warmth nor for the number of hues
NUM_COLORS = 1 << 14  # largest number of strokes of a scene that are examined
NUM_NEIGHBORS = 6  # around a stroke, in the picture
MOST_SEEN = 0.9  # of a picture: its largest strokes up to this share are marks, the rest is background
GAUSSIAN_OF_BOX = 2 * np.pi / 16  # integral of a Gaussian over the area of its box of 2 deviations


@dataclass(frozen=True)
class Word:
    """A word that fits.

    Attributes:
        word: such as "muted".
        fit: 1/2 to 1; for a color share / (share + `LARGE_SHARE`).
        figure: the measure behind it, such as "mean chroma".
        value: of the figure.
    """

    word: str
    fit: float
    figure: str
    value: float


@dataclass(frozen=True)
class Scale:
    """A figure with a word for either end.

    Attributes:
        figure: its name.
        low: word for low values; empty for none.
        below: where `low` fits by 1/2.
        high: word for high values; empty for none.
        above: where `high` fits by 1/2.
        step: from 1/2 to 0.73 of a fit, in the unit of the figure.
    """

    figure: str
    low: str
    below: float
    high: str
    above: float
    step: float

    def words(self, value: float) -> Iterator[Word]:
        """The word that fits, if there is one."""
        for word, beyond in ((self.low, self.below - value), (self.high, value - self.above)):
            fit = float(1 / (1 + np.exp(-np.clip(beyond / self.step, -50, 50))))
            if word and fit >= FITS:
                yield Word(word, fit, self.figure, value)


# Tuned by eye on three paintings (`tests/kit/paintings.py`), a still life, a plush animal and a chair, and
# checked on a truck in a street and a skull: all words fitted.
LIGHTNESS = Scale("mean lightness", "dark", 0.48, "high-key", 0.72, 0.05)
CONTRAST = Scale("range of lightness", "low in contrast", 0.35, "strong in contrast", 0.62, 0.06)
CHROMA = Scale("mean chroma", "muted", 0.055, "vivid", 0.12, 0.015)
WARMTH = Scale("warmth", "cool", -0.3, "warm", 0.3, 0.15)
HUES = Scale("agreement of hues", "contrasting in hue", 0.5, "of one hue", 0.93, 0.04)
WIDTH = Scale("width of marks", "fine", 0.02, "broad", 0.055, 0.008)
ASPECT = Scale("aspect of marks", "dabbed", 1.8, "drawn-out", 3.5, 0.4)
ALIGNED = Scale("agreement of directions", "", 0.0, "aligned", 0.6, 0.1)
RESTLESS = Scale("agreement beside", "restless", 0.3, "", 0.0, 0.08)
SWIRLING = Scale("agreement beside, less over all", "", 0.0, "swirling", 0.5, 0.1)
BROKEN = Scale("difference beside", "flat in color", 0.025, "broken in color", 0.085, 0.012)
LAYERS = Scale("layers of paint", "loose", 1.5, "dense", 8.0, 0.6)
RELIEF = Scale("relief", "", 0.0, "thick", 0.3, 0.1)


def words_of_style(style: Style) -> list[Word]:
    """The words that fit a style, best first; none if the style is an edit.

    Args:
        style: of a painting.
    """
    found: list[Word] = []
    if style.palette is not None:
        found += _of_colors(style.palette)
    if style.marks is not None:
        found += _of_marks(style.marks)
    return _ranked(found)


def words_of_strokes(strokes: Gaussians, camera: Camera, *, num_threads: int | None = None) -> list[Word]:
    """The words that fit strokes, or the Gaussians of a scene, as a camera sees them, best first.

    Each stroke is weighted by its share of the picture. Marks are what is drawn: for a scene that was not
    clustered its Gaussians, which are fine.

    Args:
        strokes: N Gaussians.
        camera: the view; lengths are shares of its shorter side.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Returns:
        The words; none if nothing is visible.
    """
    options = RenderOptions.of(StrokeTexture.open("ellipse"), num_threads=num_threads)
    boxes, _ = project_with(strokes, camera, options)
    seen = visible_areas(strokes, camera, num_threads=num_threads)[boxes.ids]
    if not seen.sum() > 0:
        return []
    painted = seen_areas(boxes, camera.width, camera.height) * boxes.opacities * GAUSSIAN_OF_BOX
    order = np.argsort(-seen, kind="stable")
    rows = order[: 1 + np.searchsorted(np.cumsum(seen[order]), MOST_SEEN * seen.sum())]
    weights, colors = seen[rows], np.clip(boxes.colors[rows].astype(np.float64), 0, 1)
    half = boxes.half_extents[rows].astype(np.float64)
    width, length = 2 * np.sort(half, axis=1).T
    aspect = length / np.maximum(width, 1e-9)
    # Twice the angle of the longer side, turned by a quarter if that is the height of the box.
    angles = 2 * boxes.angles[rows].astype(np.float64) + np.where(half[:, 1] > half[:, 0], np.pi, 0.0)
    pairs = (weights * (1 - 1 / np.maximum(aspect, 1)))[:, None] * np.stack(
        [np.cos(angles), np.sin(angles)], 1
    )
    beside = _neighbors(boxes.centers[rows].astype(np.float64))
    lightness = oklab_of(colors)[:, 0]
    away = np.abs(lightness[beside] - lightness[:, None]).mean(axis=1)

    found = _of_colors(learn_palette(_sampled(colors, weights)[None]))
    found += WIDTH.words(_median(width, weights) / min(camera.width, camera.height))
    found += ASPECT.words(_median(aspect, weights))
    found += _of_directions(pairs, pairs[beside].sum(axis=1))
    found += BROKEN.words(_median(away, weights))
    found += LAYERS.words(float(painted.sum() / seen.sum()))
    return _ranked(found)


def _of_colors(palette: StylePalette) -> list[Word]:
    """Words for colors, light, and color as a whole."""
    found: list[Word] = []
    shares: dict[str, float] = {}
    for color in palette.colors:
        name = color_name(color.rgb)
        shares[name] = shares.get(name, 0.0) + color.share
    for name, share in shares.items():
        if share >= SMALL_SHARE:
            found.append(Word(name, share / (share + LARGE_SHARE), "share of the picture", share))
    lab, weights = oklab_of(np.clip(palette.samples, 0, 1)), palette.weights
    low, high = (_quantile(lab[:, 0], weights, share) for share in (0.05, 0.95))
    chroma = np.hypot(lab[:, 1], lab[:, 2])
    mean_chroma = float(weights @ chroma)
    around = weights @ lab[:, 1:]  # mean of chroma as a vector
    warm = float(around @ (np.cos(WARMEST), np.sin(WARMEST))) / (mean_chroma + GREY)
    found += LIGHTNESS.words(float(weights @ lab[:, 0]))
    found += CONTRAST.words(high - low)
    found += CHROMA.words(mean_chroma)
    found += WARMTH.words(warm)
    if mean_chroma > GREY:
        found += HUES.words(float(np.linalg.norm(around)) / mean_chroma)
    return found


def _of_marks(marks: StyleMarks) -> list[Word]:
    pairs = marks.directions.astype(np.float64)
    beside = np.zeros_like(pairs)
    for axis in (0, 1):
        for ahead in (slice(1, None), slice(None, -1)):
            behind = slice(None, -1) if ahead == slice(1, None) else slice(1, None)
            places: list[slice] = [slice(None), slice(None)]
            others = list(places)
            places[axis], others[axis] = ahead, behind
            beside[tuple(places)] += pairs[tuple(others)]
    found = list(WIDTH.words(marks.length / marks.aspect))
    found += ASPECT.words(marks.aspect)
    found += _of_directions(pairs.reshape(-1, 2), beside.reshape(-1, 2))
    found += BROKEN.words(marks.broken_lightness)
    found += RELIEF.words(marks.relief)
    return found


def _of_directions(pairs: F64, beside: F64) -> list[Word]:
    """Words for how directions agree overall, and with their neighbors.

    Args:
        pairs: [n, 2] the doubled angle as a vector, times its weight.
        beside: [n, 2] the sum over the neighbors.
    """
    clear = np.linalg.norm(pairs, axis=1)
    total = float(clear.sum())
    if not total > 0:
        return []
    over_all = float(np.linalg.norm(pairs.sum(axis=0))) / total
    lengths = np.linalg.norm(beside, axis=1)
    cosines = np.einsum("ni,ni->n", pairs, beside) / np.maximum(lengths, 1e-12)
    near = float(cosines.sum()) / total
    found = list(ALIGNED.words(over_all))
    if not found:
        found += SWIRLING.words(near - over_all)
    found += RESTLESS.words(near)
    return found


def _ranked(words: list[Word]) -> list[Word]:
    return sorted(words, key=lambda word: -word.fit)


def _neighbors(centers: F64) -> np.ndarray:
    """[n, k] rows of the neighbors of each in the picture."""
    count = min(NUM_NEIGHBORS, len(centers) - 1)
    if count < 1:
        return np.zeros((len(centers), 1), np.intp)
    found = cKDTree(centers).query(centers, k=count + 1)[1]
    return np.asarray(found[:, 1:])


def _sampled(colors: F64, weights: F64) -> F64:
    """[S, 3] colors, each as often as its weight says: at even steps through the sum of weights."""
    total = np.cumsum(weights)
    places = (np.arange(NUM_COLORS) + 0.5) / NUM_COLORS * total[-1]
    return np.asarray(colors[np.searchsorted(total, places)])


def _median(values: F64, weights: F64) -> float:
    return _quantile(values, weights, 0.5)


def _quantile(values: F64, weights: F64, share: float) -> float:
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    row = min(int(np.searchsorted(total, share * total[-1])), len(order) - 1)
    return float(values[order][row])
