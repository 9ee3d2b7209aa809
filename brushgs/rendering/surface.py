"""Painting surfaces, canvas or paper: color, height and grain over the picture.

Lengths are pixels of a 1000 x 750 picture and scale with its size: a picture twice as large shows the same
threads, twice as wide. Noise lies on lattices over the whole canvas, without tiling. Lattices start at the
upper left corner, and each number is a hash of its index, so pictures of other sizes or shapes, and other
programs (`outlets/page/web/surface.js`), show the same threads and bumps. On paper of a known resolution
threads and bumps have a physical size instead, see `canvas_scale`. A part of a surface is that of the whole,
bit for bit.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from brushgs.core.threads import side_by_side
from brushgs.rendering.relief import canvas_scale
from brushgs.values.arrays import F32, Array
from brushgs.values.camera import Camera
from brushgs.values.hashing import GOLDEN_32, hash_32, lattice
from brushgs.values.part import Part

PERIOD = 3.6  # px from thread to thread
LINEN_HEIGHT = 0.2  # px, standard deviation
LINEN_TONE = 0.014  # relative standard deviation of the color: light on top of threads, dark between
# Relative standard deviation of the spacing of threads. Even spacing would give moire patterns on downscaled
# pictures.
SPACING = 0.12
BEFORE = 4  # threads before the upper left corner, which waves may reach
WAVES = 0.10  # waviness of a thread in threads, standard deviation
WAVE_LENGTH = 14.0  # px
SLUBS = 0.16  # standard deviation of the thickness, between threads and along each
OVER = 0.45  # share of its height by which a thread rises over one and sinks under the next
# Mean and deviation of the weave over 256 seeds at 1000 x 750. A canvas has few hundred threads: its own mean
# varies by 0.0076 and its deviation by 0.0025 (standard deviations).
WEAVE_MEAN, WEAVE_DEVIATION = 1.0046, 0.3709
# Thread widths, px of the picture, at which threads start to fade and are gone.
NARROW_THREAD = (2.4, 1.5)
PAPER_COARSE, PAPER_FINE = 3.2, 1.1  # px, half length of bumps
PAPER_SHARES = 0.65, 0.76  # amplitudes; the squares sum to 1
PAPER_HEIGHT = 0.35  # px, standard deviation
PAPER_TONE = 0.008
# B-splines keep 151/315 of the deviation of the lattice numbers, which is 1/sqrt(3).
NOISE_GAIN = 3**0.5 * 315 / 151
STREAMS = ("columns", "rows", "one", "other", "coarse", "fine")  # random streams of a seed
BAND_PIXELS = 1 << 15  # per band: the arrays of a band of linen then take 1.5 MB
GRAIN = 0.24  # standard deviation of the grain around 1/2


@dataclass(frozen=True, eq=False)
class Recipe:
    """Parameters of a surface, to make it again in another size.

    Attributes:
        kind: name of its function, "flat", "linen" or "paper".
        color: [3] or [H, W, 3].
        strength: of height and tone; 0 for a flat one.
        seed: of the threads or bumps.
        dpi: pixels per inch on paper; None without a physical size.
    """

    kind: Literal["flat", "linen", "paper"]
    color: Array  # [3] or [H, W, 3]
    strength: float
    seed: int
    dpi: float | None = None

    def surface(self, *, height: int, width: int, part: Part | None = None) -> "Surface":
        """The surface in a size, or a part of it."""
        if self.kind == "flat":
            return flat(self.color, height=height, width=width, part=part)
        weave = linen if self.kind == "linen" else paper
        more: dict[str, Any] = {"strength": self.strength, "seed": self.seed, "dpi": self.dpi, "part": part}
        return weave(self.color, height=height, width=width, **more)


@dataclass(frozen=True, eq=False)
class Surface:
    """A painting surface.

    Attributes:
        rgb: [H, W, 3] color, display-encoded.
        height: [H, W] pixels of this picture, mean about 0.
        grain: [H, W] the tooth, 0 (a hollow, missed by dry paint) to 1 (a tip).
        recipe: None if not made by this module.
    """

    rgb: Array  # [H, W, 3]
    height: Array  # [H, W]
    grain: Array  # [H, W]
    recipe: Recipe | None = field(default=None, kw_only=True)

    def seen_in(self, camera: Camera, part: Part | None) -> "Surface":
        """The surface in a view, or a part of it; it is made again if it is of another size."""
        size = camera.height, camera.width
        if self.grain.shape == size:
            return self if part is None else self._cut(part)
        assert self.recipe is not None, "surfaces of another size have a recipe"
        return self.recipe.surface(height=size[0], width=size[1], part=part)

    def _cut(self, part: Part) -> "Surface":
        place = part.rows, part.columns
        return Surface(self.rgb[place], self.height[place], self.grain[place])


def flat(color: ArrayLike, *, height: int, width: int, part: Part | None = None) -> Surface:
    """A smooth board of a color, [3] or [H, W, 3]."""
    sheet = _Sheet(height, width, 0, None, part or Part.whole(width, height))
    shape = sheet.part.height, sheet.part.width
    bare, full = np.zeros(shape, np.float32), np.ones(shape, np.float32)
    return _surface("flat", color, bare, full, 0, 0, 0, sheet)


def linen(
    color: ArrayLike,
    *,
    height: int,
    width: int,
    strength: float = 1.0,
    seed: int = 0,
    dpi: float | None = None,
    part: Part | None = None,
) -> Surface:
    """Canvas in plain weave: two sets of threads cross, over and under in turn, uneven and slightly wavy.

    Args:
        color: [3] or [H, W, 3], of the primed canvas.
        height: pixels, >= 1.
        width: pixels, >= 1.
        strength: of height and tone, >= 0; 1 is `LINEN_HEIGHT` and `LINEN_TONE`.
        seed: of the threads.
        dpi: pixels per inch on paper: threads are then 0.6 mm wide. None for a size by that of the picture.
        part: make only this part of the surface; None for all.
    """
    sheet = _Sheet(height, width, seed, dpi, part or Part.whole(width, height))
    pattern = _linen(sheet)
    return _surface("linen", color, pattern, _grain(pattern), strength, LINEN_HEIGHT, LINEN_TONE, sheet)


def paper(
    color: ArrayLike,
    *,
    height: int,
    width: int,
    strength: float = 1.0,
    seed: int = 0,
    dpi: float | None = None,
    part: Part | None = None,
) -> Surface:
    """Cold-pressed paper: fine bumps on coarse ones. Arguments as for `linen`."""
    sheet = _Sheet(height, width, seed, dpi, part or Part.whole(width, height))
    pattern = _paper(sheet)
    return _surface("paper", color, pattern, _grain(pattern), strength, PAPER_HEIGHT, PAPER_TONE, sheet)


def in_color(surface: Surface, color: ArrayLike) -> Surface:
    """The same surface in another color, [3] or [H, W, 3].

    Raises:
        ValueError: if it has no recipe, or the color has another shape.
    """
    if surface.recipe is None:
        raise ValueError("in_color: surface must be flat, linen or paper, got one without a recipe")
    height, width = surface.grain.shape
    recipe = replace(surface.recipe, color=np.asarray(color, np.float32))
    return recipe.surface(height=height, width=width)


@dataclass(frozen=True)
class _Sheet:
    """Parameters of the pattern of a surface, and the part to make."""

    height: int
    width: int
    seed: int
    dpi: float | None
    part: Part

    @property
    def scale(self) -> float:
        return canvas_scale(self.width, self.height, self.dpi)

    def noise(self, name: str, spacing: float, deviation: float = 1.0) -> "_Noise":
        """Noise of one of `STREAMS` with this lattice spacing in pixels."""
        return _Noise.of(_stream(self.seed, name), self, spacing, deviation)


def _surface(
    kind: Literal["flat", "linen", "paper"],
    color: ArrayLike,
    pattern: F32,
    grain: F32,
    strength: float,
    height: float,
    tone: float,
    sheet: _Sheet,
) -> Surface:
    (rows, columns), whole = pattern.shape, np.asarray(color, np.float32)
    if whole.shape not in ((3,), (sheet.height, sheet.width, 3)):
        raise ValueError(
            f"surface: color must have shape [3] or [{sheet.height}, {sheet.width}, 3], got "
            f"{list(whole.shape)}"
        )
    base = whole if whole.ndim == 1 else whole[sheet.part.rows, sheet.part.columns]
    shade = 1 + np.float32(strength * tone) * pattern
    rgb = np.empty((rows, columns, 3), np.float32)
    for c in range(3):  # by channel: a third of the time of one expression with a short inner loop
        np.multiply(base[..., c], shade, out=rgb[..., c])
    raised = np.float32(strength * height * sheet.scale) * pattern
    return Surface(rgb, raised, grain, recipe=Recipe(kind, whole, strength, sheet.seed, sheet.dpi))


def _grain(pattern: F32) -> F32:
    grain = np.clip(0.5 + GRAIN * pattern, 0, 1)
    return np.asarray(grain, np.float32)


@lru_cache(maxsize=2)
def _linen(sheet: _Sheet) -> F32:
    """[H, W] height of the threads in standard deviations, mean 0; read-only."""
    scale, part = sheet.scale, sheet.part
    (x, of_column), (y, of_row) = (
        [of[span] for of in _threads(_stream(sheet.seed, name), size, PERIOD * scale)]
        for name, size, span in (("columns", sheet.width, part.columns), ("rows", sheet.height, part.rows))
    )
    first, second = (sheet.noise(name, WAVE_LENGTH * scale) for name in ("one", "other"))
    wide, none = NARROW_THREAD
    share = float(np.clip((PERIOD * scale - none) / (wide - none), 0, 1))
    share *= share * (3 - 2 * share)

    def weave_of(band: slice) -> F32:
        one, other = first.rows(band), second.rows(band)
        up, column = _bump(x + np.float32(WAVES) * one)
        across, row = _bump(y[band, None] + np.float32(WAVES) * other)
        sign = np.where((column ^ row) & 1, np.float32(-OVER), np.float32(OVER))  # one rises, one sinks
        weave = (of_column + np.float32(SLUBS) * other) * (up + sign * across)  # both fields are used twice
        weave = np.maximum(weave, (of_row[band, None] + np.float32(SLUBS) * one) * (across - sign * up))
        weave -= np.float32(WEAVE_MEAN)
        return np.asarray(weave * np.float32(share / WEAVE_DEVIATION), np.float32)

    return _in_bands(part.height, part.width, weave_of)


def _bump(place: F32) -> tuple[F32, NDArray[np.int32]]:
    """Height of a thread, 0 to 1, and its index, at positions in threads."""
    thread = place.astype(np.int32)  # places are > 0
    part = place - thread.astype(np.float32)
    return np.asarray(4 * part * (1 - part), np.float32), thread


def _threads(stream: int, size: int, period: float) -> tuple[F32, F32]:
    """[size] position of each pixel in threads (whole numbers are borders), and relative thickness of its
    thread.
    """
    count = int(np.ceil(1.3 * size / period)) + 16
    numbers = lattice(stream, np.arange(2, dtype=np.uint32), np.arange(count, dtype=np.uint32))
    spread = 3**0.5 * numbers.astype(np.float64)  # deviation 1
    steps, thickness = 1 + SPACING * spread[0], 1 + SLUBS * spread[1]
    place = np.interp(np.arange(size) + 0.5, (np.cumsum(steps) - BEFORE) * period, np.arange(count))
    return place.astype(np.float32), thickness[place.astype(int)].astype(np.float32)


@lru_cache(maxsize=2)
def _paper(sheet: _Sheet) -> F32:
    """[H, W] height of the bumps in standard deviations, mean 0; read-only. Bumps under a pixel fade."""
    scale, part = sheet.scale, sheet.part
    coarse, fine = (
        sheet.noise(name, max(spacing * scale, 1), share * min(1, spacing * scale))
        for name, spacing, share in zip(
            ("coarse", "fine"), (PAPER_COARSE, PAPER_FINE), PAPER_SHARES, strict=True
        )
    )
    return _in_bands(part.height, part.width, lambda band: coarse.rows(band) + fine.rows(band))


def _in_bands(height: int, width: int, pattern_of: Callable[[slice], F32]) -> F32:
    """[H, W] a pattern computed in cache-sized bands in parallel; read-only."""
    pattern = np.empty((height, width), np.float32)
    num_rows = max(BAND_PIXELS // width, 1)

    def fill(first: int) -> None:
        band = slice(first, min(first + num_rows, height))
        pattern[band] = pattern_of(band)

    side_by_side(fill, range(0, height, num_rows))
    pattern.flags.writeable = False
    return pattern


def _stream(seed: int, name: str) -> int:
    """The seed of a random stream of a surface."""
    state = (seed + GOLDEN_32 * STREAMS.index(name)) % 2**32
    return int(hash_32(np.array([state], np.uint32))[0])


@dataclass(frozen=True, eq=False)
class _Noise:
    """Smooth noise over a picture, mean 0: cubic B-splines over uniform random numbers on a lattice.

    Attributes:
        lines: [H, m] the noise of each row at the columns of the lattice.
        first: [W] the first of the four columns that each pixel lies between.
        weights: [4, W] of them.
    """

    lines: F32
    first: NDArray[np.int_]
    weights: F32

    @classmethod
    def of(cls, stream: int, sheet: _Sheet, spacing: float, deviation: float) -> "_Noise":
        """Noise of a random stream with this lattice spacing in pixels."""
        first, weights = _splines(sheet.part.rows, spacing, 1.0)
        column, of_columns = _splines(sheet.part.columns, spacing, deviation * NOISE_GAIN)
        axes = [np.arange(at[0], at[-1] + 4, dtype=np.uint32) for at in (first, column)]
        lines = _mixed(lattice(stream, *axes), first - first[0], weights[:, :, None], axis=0)
        return cls(lines, column - column[0], of_columns)

    def rows(self, band: slice) -> F32:
        """[h, W] rows of the noise."""
        return _mixed(self.lines[band], self.first, self.weights, axis=1)


def _splines(span: slice, spacing: float, gain: float) -> tuple[NDArray[np.int_], F32]:
    """[size] first of the four lattice numbers of each pixel of a span, and their weights [4, size]."""
    place = (np.arange(span.start, span.stop) + 0.5) / spacing
    first = place.astype(int)
    f = place - first
    splines = ((1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3)
    return first, np.array([w * (gain / 6) for w in splines], np.float32)


def _mixed(field: F32, first: NDArray[np.int_], weights: F32, axis: int) -> F32:
    """Weighted sums of four numbers from `first` along an axis."""
    total = np.take(field, first, axis) * weights[0]
    for k in (1, 2, 3):
        total += np.take(field, first + k, axis) * weights[k]
    return np.asarray(total, np.float32)
