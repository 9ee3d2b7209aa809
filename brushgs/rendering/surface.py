"""What is painted on: canvas or paper, as colour, height and grain over the picture.

Lengths belong to the canvas: they are pixels of a picture of 1000 x 750 and scale with its size, so a picture
twice as large shows the same threads, twice as wide. Noise is drawn on lattices over the whole canvas, not
on tiles: nothing recurs. They begin at its upper left corner, and each number is a hash of its place: a
picture of another size or shape shows the same threads and bumps, and what paints on another machine repeats
them (`outlets/page/web/surface.js`).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.core.threads import side_by_side
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F32, Array
from brushgs.values.hashing import GOLDEN_32, hash_32, lattice

PERIOD = 3.6  # px from thread to thread
LINEN_HEIGHT = 0.2  # px, standard deviation
LINEN_TONE = 0.014  # standard deviation of the colour, over the colour: light on top of threads, dark between
# Standard deviation of the distance of neighbouring threads, over their distance. Evenly spaced threads keep
# step over the whole canvas, and make patterns of their own where a screen shows a picture smaller.
SPACING = 0.12
BEFORE = 4  # threads beyond the upper left corner, from where they are counted: waves lead there
WAVES = 0.10  # threads that a thread strays from its line, standard deviation
WAVE_LENGTH = 14.0  # px over which it does
SLUBS = 0.16  # standard deviation of the thickness from thread to thread, and along each
OVER = 0.45  # of the height of a thread, by which it rises over one and sinks under the next
# Of the weave as its threads are drawn, over 256 seeds at 1000 x 750. One canvas has few hundred threads: its
# mean strays by 0.0076 and its deviation by 0.0025, standard deviations.
WEAVE_MEAN, WEAVE_DEVIATION = 1.0046, 0.3709
# Threads narrower than this, px of the picture, fade and are gone at the second: pixels could not show them.
NARROW_THREAD = (2.4, 1.5)
PAPER_COARSE, PAPER_FINE = 3.2, 1.1  # px, half length of bumps
PAPER_SHARES = 0.65, 0.76  # of them; the squares sum to 1
PAPER_HEIGHT = 0.35  # px, standard deviation
PAPER_TONE = 0.008
# B-splines in place of the numbers of a lattice leave 151/315 of their deviation, which is 1/sqrt(3).
NOISE_GAIN = 3**0.5 * 315 / 151
STREAMS = ("columns", "rows", "one", "other", "coarse", "fine")  # of numbers, for one seed
BAND_PIXELS = 1 << 15  # made at a time: the arrays of a band of linen then take 1.5 MB
GRAIN = 0.24  # standard deviation of the grain around 1/2


@dataclass(frozen=True, eq=False)
class Recipe:
    """What a surface was made of: enough to make it anew in another size.

    Attributes:
        kind: the function that made it, "flat", "linen" or "paper".
        color: [3] or [H, W, 3].
        strength: of height and tone; 0 for a flat one.
        seed: of the threads or bumps.
    """

    kind: Literal["flat", "linen", "paper"]
    color: Array  # [3] or [H, W, 3]
    strength: float
    seed: int


@dataclass(frozen=True, eq=False)
class Surface:
    """What a picture is painted on.

    Attributes:
        rgb: [H, W, 3] colour, display-encoded.
        height: [H, W] pixels of this picture, about a mean of 0.
        grain: [H, W] the tooth, 0 (a hollow, which dry paint misses) to 1 (a tip).
        recipe: None for one that no function of this module made.
    """

    rgb: Array  # [H, W, 3]
    height: Array  # [H, W]
    grain: Array  # [H, W]
    recipe: Recipe | None = field(default=None, kw_only=True)


def flat(color: ArrayLike, *, height: int, width: int) -> Surface:
    """A smooth board of a colour, [3] or [H, W, 3]."""
    bare, full = np.zeros((height, width), np.float32), np.ones((height, width), np.float32)
    return _surface("flat", color, bare, full, 0, 0, 0, 0)


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
    return _surface("linen", color, pattern, _grain(pattern), strength, LINEN_HEIGHT, LINEN_TONE, seed)


def paper(color: ArrayLike, *, height: int, width: int, strength: float = 1.0, seed: int = 0) -> Surface:
    """Cold-pressed paper: fine bumps on coarse ones. Arguments as for `linen`."""
    pattern = _paper(height, width, seed)
    return _surface("paper", color, pattern, _grain(pattern), strength, PAPER_HEIGHT, PAPER_TONE, seed)


def in_color(surface: Surface, color: ArrayLike) -> Surface:
    """The same surface in another colour, [3] or [H, W, 3].

    Raises:
        ValueError: if it has no recipe, or the colour has another shape.
    """
    recipe = surface.recipe
    if recipe is None:
        raise ValueError("in_color: surface must be flat, linen or paper, got one without a recipe")
    height, width = surface.grain.shape
    if recipe.kind == "flat":
        return flat(color, height=height, width=width)
    weave = linen if recipe.kind == "linen" else paper
    return weave(color, height=height, width=width, strength=recipe.strength, seed=recipe.seed)


def _surface(
    kind: Literal["flat", "linen", "paper"],
    color: ArrayLike,
    pattern: F32,
    grain: F32,
    strength: float,
    height: float,
    tone: float,
    seed: int,
) -> Surface:
    rows, columns = pattern.shape
    base = np.asarray(color, np.float32)
    if base.shape not in ((3,), (rows, columns, 3)):
        raise ValueError(
            f"surface: color must have shape [3] or [{rows}, {columns}, 3], got {list(base.shape)}"
        )
    shade = 1 + np.float32(strength * tone) * pattern
    rgb = np.empty((rows, columns, 3), np.float32)
    for c in range(3):  # a third of the time of one expression, whose innermost loop would be as short
        np.multiply(base[..., c], shade, out=rgb[..., c])
    raised = np.float32(strength * height * canvas_scale(columns, rows)) * pattern
    return Surface(rgb, raised, grain, recipe=Recipe(kind, base, strength, seed))


def _grain(pattern: F32) -> F32:
    grain = np.clip(0.5 + GRAIN * pattern, 0, 1)
    return np.asarray(grain, np.float32)


@lru_cache(maxsize=2)
def _linen(height: int, width: int, seed: int) -> F32:
    """[H, W] height of the threads in standard deviations, mean 0; read-only."""
    scale = canvas_scale(width, height)
    (x, of_column), (y, of_row) = (
        _threads(_stream(seed, name), size, PERIOD * scale)
        for name, size in (("columns", width), ("rows", height))
    )
    first, second = (
        _Noise.of(_stream(seed, name), height, width, WAVE_LENGTH * scale) for name in ("one", "other")
    )
    wide, none = NARROW_THREAD
    share = float(np.clip((PERIOD * scale - none) / (wide - none), 0, 1))
    share *= share * (3 - 2 * share)

    def weave_of(band: slice) -> F32:
        one, other = first.rows(band), second.rows(band)
        up, column = _bump(x + np.float32(WAVES) * one)
        across, row = _bump(y[band, None] + np.float32(WAVES) * other)
        sign = np.where((column ^ row) & 1, np.float32(-OVER), np.float32(OVER))  # where one rises, one sinks
        weave = (of_column + np.float32(SLUBS) * other) * (up + sign * across)  # both fields serve twice
        weave = np.maximum(weave, (of_row[band, None] + np.float32(SLUBS) * one) * (across - sign * up))
        weave -= np.float32(WEAVE_MEAN)
        return np.asarray(weave * np.float32(share / WEAVE_DEVIATION), np.float32)

    return _in_bands(height, width, weave_of)


def _bump(place: F32) -> tuple[F32, NDArray[np.int32]]:
    """How high a thread is at a place among threads, 0 to 1, and which it is."""
    thread = place.astype(np.int32)  # places are > 0
    part = place - thread.astype(np.float32)
    return np.asarray(4 * part * (1 - part), np.float32), thread


def _threads(stream: int, size: int, period: float) -> tuple[F32, F32]:
    """[size] where each pixel lies among threads, whole where two meet, and how thick its own is, about 1."""
    count = int(np.ceil(1.3 * size / period)) + 16
    numbers = lattice(stream, np.arange(2, dtype=np.uint32), np.arange(count, dtype=np.uint32))
    spread = 3**0.5 * numbers.astype(np.float64)  # deviation 1
    steps, thickness = 1 + SPACING * spread[0], 1 + SLUBS * spread[1]
    place = np.interp(np.arange(size) + 0.5, (np.cumsum(steps) - BEFORE) * period, np.arange(count))
    return place.astype(np.float32), thickness[place.astype(int)].astype(np.float32)


@lru_cache(maxsize=2)
def _paper(height: int, width: int, seed: int) -> F32:
    """[H, W] height of the bumps in standard deviations, mean 0; read-only. Bumps under a pixel fade."""
    scale = canvas_scale(width, height)
    coarse, fine = (
        _Noise.of(
            _stream(seed, name), height, width, max(spacing * scale, 1), share * min(1, spacing * scale)
        )
        for name, spacing, share in zip(
            ("coarse", "fine"), (PAPER_COARSE, PAPER_FINE), PAPER_SHARES, strict=True
        )
    )
    return _in_bands(height, width, lambda band: coarse.rows(band) + fine.rows(band))


def _in_bands(height: int, width: int, pattern_of: Callable[[slice], F32]) -> F32:
    """[H, W] what a function makes of some rows, several at once: they fit into the cache; read-only."""
    pattern = np.empty((height, width), np.float32)
    num_rows = max(BAND_PIXELS // width, 1)

    def fill(first: int) -> None:
        band = slice(first, min(first + num_rows, height))
        pattern[band] = pattern_of(band)

    side_by_side(fill, range(0, height, num_rows))
    pattern.flags.writeable = False
    return pattern


def _stream(seed: int, name: str) -> int:
    """The stream of numbers of one of the fields and axes of a surface."""
    state = (seed + GOLDEN_32 * STREAMS.index(name)) % 2**32
    return int(hash_32(np.array([state], np.uint32))[0])


@dataclass(frozen=True, eq=False)
class _Noise:
    """Smooth noise over a picture, mean 0: cubic B-splines over even numbers on a lattice.

    Attributes:
        lines: [H, m] the noise of each row at the columns of the lattice.
        first: [W] the first of the four columns that each pixel lies between.
        weights: [4, W] of them.
    """

    lines: F32
    first: NDArray[np.int_]
    weights: F32

    @classmethod
    def of(cls, stream: int, height: int, width: int, spacing: float, deviation: float = 1.0) -> "_Noise":
        """That of a stream of numbers, each `spacing` pixels."""
        axes = [
            np.arange(int(np.ceil(size / spacing - 1e-6)) + 3, dtype=np.uint32) for size in (height, width)
        ]
        first, weights = _splines(height, spacing, 1.0)
        lines = _mixed(lattice(stream, *axes), first, weights[:, :, None], axis=0)
        return cls(lines, *_splines(width, spacing, deviation * NOISE_GAIN))

    def rows(self, band: slice) -> F32:
        """[h, W] some rows of it."""
        return _mixed(self.lines[band], self.first, self.weights, axis=1)


def _splines(size: int, spacing: float, gain: float) -> tuple[NDArray[np.int_], F32]:
    """[size] the first of the four numbers that each pixel lies between, and their weights [4, size]."""
    place = (np.arange(size) + 0.5) / spacing
    first = place.astype(int)
    f = place - first
    splines = ((1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3)
    return first, np.array([w * (gain / 6) for w in splines], np.float32)


def _mixed(field: F32, first: NDArray[np.int_], weights: F32, axis: int) -> F32:
    """The four numbers from `first` on along an axis, weighted and added."""
    total = np.take(field, first, axis) * weights[0]
    for k in (1, 2, 3):
        total += np.take(field, first + k, axis) * weights[k]
    return np.asarray(total, np.float32)
