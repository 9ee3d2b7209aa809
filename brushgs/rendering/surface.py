"""What is painted on: canvas or paper, as colour, height and grain over the picture.

Lengths belong to the canvas: they are pixels of a picture of 1000 x 750 and scale with its size, so a picture
twice as large shows the same threads, twice as wide. Noise is drawn on lattices over the whole canvas, not
on tiles: nothing recurs. Lattices of pictures of one aspect are the same, so a small picture previews a large
one.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.arrays import F32, Array
from brushgs.rendering.relief import canvas_scale

PERIOD = 3.6  # px from thread to thread
LINEN_HEIGHT = 0.2  # px, standard deviation
LINEN_TONE = 0.014  # standard deviation of the colour, over the colour: light on top of threads, dark between
# Standard deviation of the distance of neighbouring threads, over their distance. Evenly spaced threads keep
# step over the whole canvas, and make patterns of their own where a screen shows a picture smaller.
SPACING = 0.12
WAVES = 0.10  # threads that a thread strays from its line, standard deviation
WAVE_LENGTH = 14.0  # px over which it does
SLUBS = 0.16  # standard deviation of the thickness from thread to thread, and along each
OVER = 0.45  # of the height of a thread, by which it rises over one and sinks under the next
# Threads narrower than this, px of the picture, fade and are gone at the second: pixels could not show them.
NARROW_THREAD = (2.4, 1.5)
PAPER_FINE, PAPER_COARSE = 1.1, 3.2  # px, half length of bumps
PAPER_HEIGHT = 0.35  # px, standard deviation
PAPER_TONE = 0.008
GRAIN = 0.24  # standard deviation of the grain around 1/2


@dataclass(frozen=True, eq=False)
class Surface:
    """What a picture is painted on.

    Attributes:
        rgb: [H, W, 3] colour, display-encoded.
        height: [H, W] pixels of this picture, about a mean of 0.
        grain: [H, W] the tooth, 0 (a hollow, which dry paint misses) to 1 (a tip).
    """

    rgb: Array  # [H, W, 3]
    height: Array  # [H, W]
    grain: Array  # [H, W]


def flat(color: ArrayLike, *, height: int, width: int) -> Surface:
    """A smooth board of a colour, [3] or [H, W, 3]."""
    return _surface(color, np.zeros((height, width), np.float32), np.ones((height, width), np.float32), 0, 0)


def linen(color: ArrayLike, *, height: int, width: int, strength: float = 1.0, seed: int = 0) -> Surface:
    """Canvas in plain weave: two sets of threads cross, over and under in turn, uneven and slightly wavy.

    Args:
        color: [3] or [H, W, 3], of the primed canvas.
        height: pixels, >= 1.
        width: pixels, >= 1.
        strength: of height and tone, >= 0; 1 is `LINEN_HEIGHT` and `LINEN_TONE`.
        seed: another one gives other threads.
    """
    pattern = _linen(height, width, seed)
    grain = _grain(pattern)
    return _surface(color, pattern, grain, strength * LINEN_HEIGHT, strength * LINEN_TONE)


def paper(color: ArrayLike, *, height: int, width: int, strength: float = 1.0, seed: int = 0) -> Surface:
    """Cold-pressed paper: fine bumps on coarse ones. Arguments as for `linen`."""
    pattern = _paper(height, width, seed)
    grain = _grain(pattern)
    return _surface(color, pattern, grain, strength * PAPER_HEIGHT, strength * PAPER_TONE)


def _surface(color: ArrayLike, pattern: F32, grain: F32, height: float, tone: float) -> Surface:
    rows, columns = pattern.shape
    base = np.asarray(color, np.float32)
    if base.shape not in ((3,), (rows, columns, 3)):
        raise ValueError(
            f"surface: color must have shape [3] or [{rows}, {columns}, 3], got {list(base.shape)}"
        )
    shade = 1 + np.float32(tone) * pattern
    rgb = np.empty((rows, columns, 3), np.float32)
    for c in range(3):  # a third of the time of one expression, whose innermost loop would be as short
        np.multiply(base[..., c], shade, out=rgb[..., c])
    return Surface(rgb, np.float32(height * canvas_scale(columns, rows)) * pattern, grain)


def _grain(pattern: F32) -> F32:
    grain = np.clip(0.5 + GRAIN * pattern, 0, 1)
    return np.asarray(grain, np.float32)


@lru_cache(maxsize=2)
def _linen(height: int, width: int, seed: int) -> F32:
    """[H, W] height of the threads in standard deviations, mean 0; read-only."""
    scale = canvas_scale(width, height)
    draw = np.random.default_rng([seed, 1])
    (x, of_column), (y, of_row) = (_threads(draw, size, PERIOD * scale) for size in (width, height))
    one, other = (_noise(draw, height, width, WAVE_LENGTH * scale) for _ in range(2))
    up, column = _bump(x + np.float32(WAVES) * one)
    across, row = _bump(y[:, None] + np.float32(WAVES) * other)
    sign = np.where((column ^ row) & 1, np.float32(-OVER), np.float32(OVER))  # where one rises, one sinks
    weave = (of_column + np.float32(SLUBS) * other) * (up + sign * across)  # both fields serve twice
    weave = np.maximum(weave, (of_row[:, None] + np.float32(SLUBS) * one) * (across - sign * up))
    weave -= weave.mean(dtype=np.float64).astype(np.float32)
    wide, none = NARROW_THREAD
    share = float(np.clip((PERIOD * scale - none) / (wide - none), 0, 1))
    share *= share * (3 - 2 * share)
    weave *= np.float32(share / max(weave.std(dtype=np.float64), 1e-3))  # a picture of one pixel has none
    weave.flags.writeable = False
    return np.asarray(weave, np.float32)


def _bump(place: F32) -> tuple[F32, NDArray[np.int32]]:
    """How high a thread is at a place among threads, 0 to 1, and which it is."""
    thread = place.astype(np.int32)  # places are > 0
    part = place - thread.astype(np.float32)
    return np.asarray(4 * part * (1 - part), np.float32), thread


def _threads(draw: np.random.Generator, size: int, period: float) -> tuple[F32, F32]:
    """[size] where each pixel lies among threads, whole where two meet, and how thick its own is, about 1."""
    count = int(np.ceil(1.2 * size / period)) + 16
    steps = np.clip(1 + SPACING * draw.standard_normal(count), 0.6, 1.4) * period
    thickness = np.clip(1 + SLUBS * draw.standard_normal(count), 0.5, 1.5)
    place = np.interp(np.arange(size) + 0.5, np.cumsum(steps) - 4 * period, np.arange(count))
    return place.astype(np.float32), thickness[place.astype(int)].astype(np.float32)


@lru_cache(maxsize=2)
def _paper(height: int, width: int, seed: int) -> F32:
    """[H, W] height of the bumps in standard deviations, mean 0; read-only. Bumps under a pixel fade."""
    scale = canvas_scale(width, height)
    draw = np.random.default_rng([seed, 2])
    field = np.zeros((height, width), np.float32)
    for spacing, share in ((PAPER_COARSE, 0.65), (PAPER_FINE, 0.76)):  # squares of the shares sum to 1
        field += np.float32(share * min(1, spacing * scale)) * _noise(
            draw, height, width, max(spacing * scale, 1)
        )
    field -= field.mean(dtype=np.float64).astype(np.float32)
    field.flags.writeable = False
    return field


def _noise(draw: np.random.Generator, height: int, width: int, spacing: float) -> F32:
    """[H, W] smooth noise, mean 0, deviation 1: cubic B-splines over normal numbers each `spacing` pixels."""
    lattice = [int(np.ceil(size / spacing - 1e-6)) + 3 for size in (height, width)]
    field = draw.standard_normal(lattice, dtype=np.float32)
    for axis, size in enumerate((height, width)):
        place = (np.arange(size) + 0.5) / spacing
        first = place.astype(int)
        f = place - first
        splines = ((1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3)
        shape = (-1, 1) if axis == 0 else (1, -1)
        weights = [(w / 6).astype(np.float32).reshape(shape) for w in splines]
        total = np.take(field, first, axis) * weights[0]
        for k in (1, 2, 3):
            total += np.take(field, first + k, axis) * weights[k]
        field = total
    return np.asarray(
        field * np.float32(315 / 151)
    )  # the mean of the squares of the weights, along both axes
