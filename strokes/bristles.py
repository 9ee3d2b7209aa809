"""How paint gets from a brush onto the canvas: the model behind the strokes of `draw.py`.

A stroke is laid in three steps. `sheet` runs a brush of some hundred bristles, each with its own place, load,
wobble and end, along a straight line and returns the thickness of the paint on a strip (s along the stroke,
t across it). `lay` bends that strip along a path onto the picture. `finish` lets the paint settle on the
grain of the canvas: what is thick enough covers, what is thin breaks up. All lengths are in units of the
picture's width; heights of pictures are for a width of WIDTH. Everything is drawn on SUPERSAMPLE x WIDTH
samples and averaged down, to WIDTH pixels or to twice as many.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

SUPERSAMPLE = 4
WIDTH = 256  # pixels, also the longest side that is used of a stroke image in pictures up to 2000 pixels
STRIP = (480, 1536)  # samples of a strip across and along


@dataclass(frozen=True)
class Brush:
    """A bundle of bristles and the way it is drawn.

    Lengths across are in half widths of the stroke (t from -1 to 1), along in its length (s from 0 to 1).
    """

    num_bristles: int = 110
    bristle: float = 0.016  # standard deviation of one bristle's trace, across
    clumping: float = 0.6  # how far bristles draw together, in their spacing
    load: float = 1.0  # mean paint on a bristle; 1 just covers
    load_spread: float = 0.35  # log-normal spread of the loads
    wobble: float = 0.012  # how far a bristle strays, across
    runs_dry: tuple[float, float] = (0.9, 1.6)  # s where the first and the last bristle run out of paint
    fade: float = 0.35  # length over which a bristle runs out
    start: float = 0.02  # raggedness of the landing, along
    end: float = 0.05  # raggedness of the lift
    round_start: float = 0.0  # how much later the outer bristles land, along: the rounded toe of a brush
    round_end: float = 0.0  # how much earlier they lift
    pile: float = 0.35  # paint pushed to the sides
    bead: float = 0.3  # paint left where the brush lands


def smoothstep(low, high, x):
    """0 below `low`, 1 above `high`, smooth between."""
    x = np.clip((x - low) / (high - low), 0, 1)
    return x * x * (3 - 2 * x)


def noise(rng, shape, sigma):
    """Smooth noise with standard deviation 1, correlated over `sigma` samples per axis."""
    values = gaussian_filter(rng.standard_normal(shape), sigma, mode="reflect")
    return values / values.std()


def sheet(rng, brush):
    """Thickness of the paint on a strip, [across, along]; about 1 where paint just covers."""
    across, along = STRIP
    t = np.linspace(-1.08, 1.08, across)
    s = np.linspace(0, 1, along)
    count = brush.num_bristles
    place = np.linspace(-1, 1, count) * 0.97 + rng.normal(0, 0.35 / count, count)
    place += brush.clumping * 2 / count * noise(rng, count, 2.2)
    load = brush.load * np.exp(
        brush.load_spread * (0.75 * noise(rng, count, 1.2) + 0.65 * noise(rng, count, 5))
    )
    curve = 1 - np.sqrt(1 - np.clip(np.abs(place), 0, 1) ** 2)
    begin = brush.start * (0.5 * np.abs(rng.standard_normal(count)) + 0.5 * np.abs(noise(rng, count, 4)))
    end = 1 - brush.end * (
        0.6 * np.abs(rng.standard_normal(count)) + 0.6 * (noise(rng, count, 2.5) + 0.8).clip(0)
    )
    begin, end = begin + brush.round_start * curve, end - brush.round_end * curve
    dry = rng.uniform(*brush.runs_dry, count) * 0.5 + 0.5 * np.interp(
        noise(rng, count, 4), [-1.6, 1.6], brush.runs_dry
    )
    sway = noise(rng, along, along / 5) * brush.wobble * 0.7
    thickness = np.zeros(STRIP)
    spacing = 2 / count
    for i in range(count):
        path = place[i] + sway + brush.wobble * noise(rng, along, along / 14)
        paint = load[i] * (1 + 0.16 * noise(rng, along, along / 40) + 0.12 * noise(rng, along, along / 150))
        paint *= smoothstep(dry[i] + brush.fade / 2, dry[i] - brush.fade / 2, s) if brush.fade else 1
        paint *= smoothstep(begin[i] - 0.004, begin[i] + 0.012, s) * smoothstep(
            end[i] + 0.006, end[i] - 0.02, s
        )
        sigma = brush.bristle * rng.uniform(0.7, 1.5)
        rows = np.abs(t - place[i]) < 5 * sigma + 5 * brush.wobble
        trace = np.exp(-0.5 * ((t[rows, None] - path) / sigma) ** 2)
        thickness[rows] += trace * paint * spacing / (sigma * 2.5066)
    body = smoothstep(0.1, 0.5, gaussian_filter(thickness, (across * 0.008, along * 0.004)))
    side = np.exp(-0.5 * ((np.abs(t) - 0.93) / 0.035) ** 2)[:, None] * (
        1 + 0.5 * noise(rng, STRIP, (8, along / 20))
    )
    landing = s - 0.035 - brush.round_start * (1 - np.sqrt(1 - np.clip(np.abs(t), 0, 1) ** 2))[:, None]
    head = np.exp(-0.5 * (landing / 0.022) ** 2) * (1 + 0.4 * noise(rng, STRIP, (14, 20)))
    return thickness + body * (brush.pile * side.clip(0) + brush.bead * head.clip(0))


def grain(rng, shape, weave=0.35):
    """Canvas: a weave of irregular threads, about 0 to 1, high where paint does not reach."""
    y, x = np.mgrid[: shape[0], : shape[1]] / SUPERSAMPLE
    x = x + 0.8 * noise(rng, shape, 9 * SUPERSAMPLE)
    y = y + 0.8 * noise(rng, shape, 9 * SUPERSAMPLE)
    threads = 0.25 * (
        2 + np.cos(2 * np.pi * x / 4.2) * np.sign(np.cos(np.pi * y / 4.2)) + np.cos(2 * np.pi * y / 4.2)
    )
    rough = 0.5 + 0.22 * noise(rng, shape, 0.7 * SUPERSAMPLE) + 0.16 * noise(rng, shape, 2.2 * SUPERSAMPLE)
    return weave * threads + (1 - weave) * rough


def canvas(height):
    """Pixel centers x, y of the supersampled picture, in units of its width."""
    size = SUPERSAMPLE * WIDTH
    return np.meshgrid((np.arange(size) + 0.5) / size, (np.arange(round(size * height / WIDTH)) + 0.5) / size)


def lay(strip, s, t):
    """The strip's thickness at stroke coordinates s, t of the picture's pixels; 0 off the strip."""
    rows = (t / 1.08 + 1) / 2 * (strip.shape[0] - 1)
    return map_coordinates(strip, [rows, s * (strip.shape[1] - 1)], order=1, mode="constant")


def straight(height, half_width=None, bow=0.0, margin=0.012, slant=0.0):
    """Stroke coordinates of a stroke from left to right.

    half_width(s) is relative to the widest that fits; bow is the rise of the middle in picture widths; slant
    is how much earlier its lower side lands than its middle, in lengths of the stroke.
    """
    x, y = canvas(height)
    s = (x - margin) / (1 - 2 * margin)
    middle = 0.5 * height / WIDTH + bow * (4 * (s - 0.5) ** 2 - 0.5)
    widest = 0.5 * height / WIDTH - abs(bow) / 2 - margin
    half = widest * (1.0 if half_width is None else half_width(np.clip(s, 0, 1)))
    t = (y - middle) / np.maximum(half, 1e-3)
    return s + slant * t.clip(-1.2, 1.2), t


def segment(height, start, stop, half, half_width=None):
    """Stroke coordinates of a straight stroke between two points (x, y) in picture widths."""
    x, y = canvas(height)
    along = np.subtract(stop, start)
    length = np.hypot(*along)
    along = along / length
    s = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / length
    t = ((y - start[1]) * along[0] - (x - start[0]) * along[1]) / half
    return s, t / np.maximum(half_width(np.clip(s, 0, 1)), 1e-3) if half_width else t


def over(top, bottom):
    """Wet paint laid over wet paint: the upper film hides the lower where it is thick."""
    return top + bottom * (1 - smoothstep(0.15, 0.6, top))


def finish(rng, thickness, *, dryness=0.25, soft=0.25, floor=0.1, opacity=2.1, relief=0.5):
    """Thickness -> relief and coverage: paint settles on the grain of the canvas."""
    tooth = grain(rng, thickness.shape)
    touch = smoothstep(0, 1, (thickness - floor - dryness * tooth) / soft)
    coverage = touch * (1 - np.exp(-opacity * thickness.clip(0))) / (1 - np.exp(-opacity * 1.6))
    level = 0.5 + relief * (thickness / (thickness + 0.8) - 0.1) + 0.08 * (0.5 - tooth) * np.exp(-thickness)
    level += 0.006 * noise(rng, thickness.shape, 0.6 * SUPERSAMPLE)
    return level, coverage.clip(0, 1)


def block_mean(a, side):
    """Mean of each block of side x side samples."""
    return a.reshape(a.shape[0] // side, side, -1, side).mean(axis=(1, 3))


def down(level, coverage, width):
    """Relief and coverage -> 8-bit RGBA [h, width, 4]; the relief counts by coverage, bare canvas is 0.5."""
    side = level.shape[1] // width
    alpha = block_mean(coverage, side)
    grey = (block_mean(level * coverage, side) + 1e-3 * 0.5) / (alpha + 1e-3)
    grey = np.where(alpha < 0.5 / 255, 0.5, grey).clip(0, 1)
    if width > WIDTH:  # in steps of 3 of 255, which the eye cannot tell: half the size of the file
        grey = 0.5 + np.rint((grey - 0.5) * 85) / 85
    return np.rint(np.dstack([grey, grey, grey, alpha.clip(0, 1)]) * 255).astype(np.uint8)


def round_head(s, length):
    """Half width that opens like a half circle over `length`."""
    return np.sqrt(1 - (1 - np.clip(s / length, 0, 1)) ** 2)
