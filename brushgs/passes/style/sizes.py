"""The length, width and color variation of the marks in a painting.

The subject of a painting is coarser than its marks and varies at any distance. So the picture is high-passed:
its blur at 3 % of the shorter side is subtracted. In the rest, the correlation of two points falls with their
distance like the share of point pairs within one mark. It is measured along and across the marks, whose
directions the structure tensor gives at their own scale.

For oblong marks that overlap at random ("dead leaves") this share is K / (2 A - K), with A the area of a mark
and K the overlap of a mark with its shifted copy. The same high-pass is applied to this model. Length and
width are those for which model and picture fall to half at the same distances. So marks that are not small
relative to the high-pass are measured correctly as well.
Sources: Matheron 1968, dead leaves; Lee, Mumford and Huang 2001, Occlusion models for natural images; Bigun
and Granlund 1987, structure tensor.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from brushgs.passes.style.averages import shorter_side
from brushgs.values.arrays import F64, Array, Mask
from brushgs.values.style import MarkSpectrum

# Standard deviation of the subtracted blur, of the shorter side. If marks are as wide as the blur, the
# measured shape is that of the blur, hardly longer than wide: then the next is taken, as for washes. Long
# marks up to 1.4 times as wide are measured at most 25 % too narrow; the next blur would measure the subject
# instead.
HIGH_PASSES = 0.03, 0.06, 0.12
LONG, WIDEST_LONG = 4.0, 1.4
# Long marks wider than this share of the first blur may be bands of narrower ones: half the blur is tried,
# down to this many pixels. For marks of one size that finds at least this share of their width.
WIDE_FOR_FIRST = 0.8
LEAST_BLUR = 3.0
ONE_SIZE = 0.85
FINE = 1.2  # pixels: standard deviation of the smoothing before slopes are taken
AREA = 0.025  # of the shorter side: deviation of the window of the structure tensor
FAINT = 0.2  # of the mean energy of a high-passed picture: below, there are no marks
COHERENT = 0.5  # coherence from which marks count as running side by side
NUM_SAMPLES = 24_000  # places of a picture
CLEARNESS = 0.5  # exponent of the coherence as a weight
NUM_FAR = 20  # distances beyond 8 pixels, in equal ratios
LEAST_CLEAR = 0.05  # weight of places where marks have no direction
FARTHEST = 4.0  # largest distance between compared points, in deviations of the blur
CELLS = 10  # along the shorter side: areas whose sizes make up the spectrum
LEAST_OF_CELL = 60  # samples
PERCENTILES = (20, 50, 80)
MOST_ASPECT = 20.0
STEPS = 7  # of fitting the model, which is then within 1 %
GRID = 256  # points of the model per side
SCAN = 0.45  # pixels: blur of a picture by its sampling
LEAST_WIDTH = 1.0  # pixels
SURE_OF_DEVIATION = 0.6745 * np.sqrt(2)  # median distance of two normal numbers, in deviations


@dataclass(frozen=True)
class Sizes:
    """Sizes of the marks of a painting.

    Attributes:
        length: along, share of the shorter side.
        width: across, share of the shorter side.
        lightness: standard deviation of lightness between adjacent marks, OKLab.
        chroma: the same for a and b.
        coherent: sizes where marks run side by side; None if the painting has no such area.
        incoherent: sizes where they do not; likewise.
        flow: [2, H, W] angles of the marks in the measured picture, radians, and their coherence, 0 to 1.
    """

    length: float
    width: float
    lightness: float
    chroma: float
    coherent: MarkSpectrum | None = None
    incoherent: MarkSpectrum | None = None
    flow: Array | None = None

    @property
    def aspect(self) -> float:
        """Length over width, 1 to 20."""
        return float(np.clip(self.length / self.width, 1.0, MOST_ASPECT))


@dataclass(frozen=True, eq=False)
class _Samples:
    """Sampled places of a picture.

    Attributes:
        x, y: [n] pixels.
        angles: [n] of the marks there, radians.
        coherence: [n] 0 to 1.
        cells: [n] the area that a place belongs to.
    """

    x: F64
    y: F64
    angles: F64
    coherence: F64
    cells: NDArray[np.intp]


def mark_sizes(lab: Array) -> Sizes:
    """Measure the marks of a painting.

    Args:
        lab: [3, H, W] OKLab of a painting.
    """
    for share in HIGH_PASSES:
        found = _sizes_below(lab, share)
        if found.width < share * (WIDEST_LONG if found.aspect > LONG else 1):
            break
    return found if share > HIGH_PASSES[0] else _of_streaks(lab, found, share)


def _of_streaks(lab: Array, found: Sizes, share: float) -> Sizes:
    """The sizes of the streaks that bands consist of; `found` if long marks have one size.

    A narrower blur measures narrower marks in bands; for marks of one size it is too narrow, and measures
    about the same width. Streaks get the length of their bands, since a narrow blur also removes variation
    along them.
    """
    wide, short = found, shorter_side(lab.shape[1:])
    while found.aspect > LONG and found.width > WIDE_FOR_FIRST * share and 0.5 * share * short >= LEAST_BLUR:
        share *= 0.5
        narrower = _sizes_below(lab, share)
        if narrower.width > ONE_SIZE * found.width:
            break
        found = narrower
    return replace(found, length=max(wide.length, found.length))


def _sizes_below(lab: Array, share: float) -> Sizes:
    """Sizes of marks, measured after subtracting a blur of a share of the shorter side."""
    short = shorter_side(lab.shape[1:])
    high_pass = share * short
    fine = _high_passed(lab.astype(np.float32), high_pass)
    flow = _flow(fine, short)
    samples = _samples(flow, short)
    distances = np.concatenate([np.arange(0, 8, 0.5), np.geomspace(8, FARTHEST * high_pass + 9, NUM_FAR)])
    along, across = (
        _correlations(fine, samples, samples.angles + turn, distances) for turn in (0, np.pi / 2)
    )
    weights = samples.coherence**CLEARNESS
    length, width = _fitted(
        _half_at(distances, along @ weights), _half_at(distances, across @ weights), high_pass
    )
    is_coherent = samples.coherence > COHERENT
    coherent, incoherent = (
        _spectrum(along, across, distances, high_pass, samples, mask, short)
        for mask in (is_coherent, ~is_coherent)
    )
    lightness, chroma = _differences(lab, samples, 1.5 * width)
    return Sizes(
        min(length / short, 1.0), min(width / short, 1.0), lightness, chroma, coherent, incoherent, flow
    )


def _high_passed(lab: Array, high_pass: float) -> Array:
    from scipy.ndimage import gaussian_filter

    fine = np.stack([plane - gaussian_filter(plane, high_pass, mode="nearest") for plane in lab])
    energy = gaussian_filter((fine**2).sum(axis=0), high_pass, mode="nearest")
    return np.asarray(fine / np.sqrt(energy + FAINT * energy.mean() + np.finfo(np.float32).tiny))


def _flow(fine: Array, short: float) -> Array:
    """[2, H, W] angles of the marks of a high-passed picture at their own scale, and their coherence."""
    from scipy.ndimage import gaussian_filter

    xx, xy, yy = np.zeros((3, *fine.shape[1:]), fine.dtype)
    for plane in fine:
        slope_y, slope_x = np.gradient(gaussian_filter(plane, FINE))
        xx += slope_x * slope_x
        xy += slope_x * slope_y
        yy += slope_y * slope_y
    xx, xy, yy = (gaussian_filter(product, AREA * short) for product in (xx, xy, yy))
    angles = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
    return np.stack([angles, np.hypot(xx - yy, 2 * xy) / np.maximum(xx + yy, 1e-12)])


def _samples(flow: Array, short: float) -> _Samples:
    """Sample places all over a picture."""
    height, width = flow.shape[1:]
    angles, coherence = flow
    rng = np.random.default_rng(0)
    x, y = rng.integers(0, width, NUM_SAMPLES), rng.integers(0, height, NUM_SAMPLES)
    side = max(short / CELLS, 1.0)
    cells = (y // side).astype(np.intp) * int(width // side + 1) + (x // side).astype(np.intp)
    return _Samples(x.astype(np.float64), y.astype(np.float64), angles[y, x], coherence[y, x], cells)


def _correlations(fine: Array, samples: _Samples, angles: F64, distances: F64) -> F64:
    """[K, n] scalar products of colors at places and at a distance from them, mean of both directions."""
    here = _colors(fine, samples.x, samples.y)
    found = np.empty((len(distances), here.shape[1]))
    step_x, step_y = np.cos(angles), np.sin(angles)
    for k, distance in enumerate(distances):
        ahead, behind = (
            _colors(fine, samples.x + reach * step_x, samples.y + reach * step_y)
            for reach in (distance, -distance)
        )
        found[k] = 0.5 * np.einsum("cn,cn->n", here, ahead + behind)
    return found


def _colors(lab: Array, x: F64, y: F64) -> F64:
    """[3, n] bilinear interpolation: a tenth of the time of `map_coordinates`."""
    height, width = lab.shape[1:]
    x, y = np.clip(x, 0, width - 1.001), np.clip(y, 0, height - 1.001)
    j, i = x.astype(np.intp), y.astype(np.intp)
    right, below = x - j, y - i
    flat, first = lab.reshape(3, -1), i * width + j
    upper = (1 - right) * flat[:, first] + right * flat[:, first + 1]
    lower = (1 - right) * flat[:, first + width] + right * flat[:, first + width + 1]
    return np.asarray((1 - below) * upper + below * lower)


def _fitted(along: float, across: float, high_pass: float) -> tuple[float, float]:
    """Length and width, pixels, of marks whose correlation falls to half at these distances."""
    wanted = np.array([max(along, across), min(along, across)])
    sizes = np.maximum(3 * wanted, LEAST_WIDTH)
    for _ in range(STEPS):
        found = np.array(_model_half_at(float(sizes[0]), float(sizes[1]), high_pass))
        sizes = np.clip(sizes * (wanted / found) ** 1.3, LEAST_WIDTH, 20 * high_pass)
    return float(max(sizes)), float(min(sizes))


def _model_half_at(length: float, width: float, high_pass: float) -> tuple[float, float]:
    """Where the correlation of high-passed dead leaves falls to half, along and across, pixels."""
    # Each axis has its own step, so that enough points cover both sides of long marks.
    steps = [max(12 * max(size, high_pass) / GRID, size / 40) for size in (length, width)]
    offsets = [step * np.minimum(np.arange(GRID), GRID - np.arange(GRID)) for step in steps]
    common = np.maximum(1 - offsets[0] / length, 0)[:, None] * np.maximum(1 - offsets[1] / width, 0)
    squared = [(2 * np.pi * np.fft.fftfreq(GRID, step)) ** 2 for step in steps]
    frequencies = squared[0][:, None] + squared[1]
    passed = (1 - np.exp(-0.5 * high_pass**2 * frequencies)) ** 2 * np.exp(-(SCAN**2) * frequencies)
    falling = np.fft.ifft2(np.fft.fft2(common / (2 - common)) * passed).real
    half = GRID // 2
    return _half_at(offsets[0][:half], falling[:half, 0]), _half_at(offsets[1][:half], falling[0, :half])


def _half_at(distances: F64, falling: F64) -> float:
    """The distance at which half of the first value is reached; the last distance if it is not."""
    below = np.flatnonzero(falling < 0.5 * falling[0])
    if len(below) == 0 or below[0] == 0:
        return float(distances[-1])
    k = int(below[0])
    share = (falling[k - 1] - 0.5 * falling[0]) / (falling[k - 1] - falling[k])
    return float(distances[k - 1] + share * (distances[k] - distances[k - 1]))


def _spectrum(
    along: F64, across: F64, distances: F64, high_pass: float, samples: _Samples, mask: Mask, short: float
) -> MarkSpectrum | None:
    """The spectrum of sizes at the places of a mask; None if no area has enough of them."""
    found = []
    for cell in np.unique(samples.cells[mask]):
        own = np.flatnonzero(mask & (samples.cells == cell))
        if len(own) >= LEAST_OF_CELL:
            halves = [_half_at(distances, falling[:, own].sum(axis=1)) for falling in (along, across)]
            found.append((max(halves), min(halves)))
    if not found:
        return None
    # The model is fitted to percentiles, not to each area: it is monotone, and the slowest step.
    percentiles = np.percentile(np.array(found), PERCENTILES, axis=0)
    sizes = np.array([_fitted(float(u), float(v), high_pass) for u, v in percentiles]) / short
    lengths, widths = np.sort(np.minimum(sizes, 1.0), axis=0).T.tolist()  # no mark is longer than the picture
    return MarkSpectrum(float(mask.mean()), tuple(lengths), tuple(widths))


def _differences(lab: Array, samples: _Samples, distance: float) -> tuple[float, float]:
    """Deviation of lightness and of chroma between adjacent marks."""
    turned = samples.angles + np.pi / 2
    beside = samples.x + distance * np.cos(turned), samples.y + distance * np.sin(turned)
    differences = np.abs(_colors(lab, *beside) - _colors(lab, samples.x, samples.y))
    weights = samples.coherence + LEAST_CLEAR
    lightness, a, b = (_weighted_median(values, weights) / SURE_OF_DEVIATION for values in differences)
    return float(lightness), float(np.hypot(a, b) / np.sqrt(2))


def _weighted_median(values: F64, weights: F64) -> float:
    order = np.argsort(values)
    sums = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(sums, 0.5 * sums[-1])])
