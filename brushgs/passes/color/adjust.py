"""Brightness, contrast, saturation, temperature and swaps of colors, as one color map.

The first four are affine in display-encoded RGB, so a painting of adjusted strokes is the adjusted painting,
up to clipping. A swap moves one color to another: shades of the same hue move with it in OKLab, grays and
other hues stay.

After Chang et al. 2015, Palette-based Photo Recoloring: lightness by a monotone curve, chroma by a weight
that falls with distance.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PchipInterpolator

from brushgs.options.styling import AdjustConfig
from brushgs.passes.color.color_map import Affine, Chain, ColorMap, difference_slopes
from brushgs.values.arrays import F64
from brushgs.values.colors import LUMINANCE, oklab_of, rgb_of, rgb_of_oklab

if TYPE_CHECKING:
    from brushgs.passes.style.features import StrokeFeatures

MIDDLE = 0.5  # display-encoded, fixed point of contrast
# Logarithms of the gains of red, green and blue at temperature 1: about from 6500 K to 4000 K.
WARMTH = (0.25, 0.0, -0.35)
GREY = 0.04  # OKLab chroma below which a color is swapped by distance, not by hue
# Where a swap acts in full, and where it ends: angle from the hue, and chroma relative to the color; for
# grays distance in chroma, and in lightness. For colors lightness has no limit, so all shades of a hue move:
# with one, cream swapped to navy was darker than the shades below it.
HUES, CHROMA = np.radians((25.0, 55.0)), (0.65, 0.25)
GREY_CHROMA, GREY_LIGHTNESS = (0.02, 0.07), (0.10, 0.35)
GENTLE = 3.0  # minimum width of the falloff of a swap of grays, in changes of lightness, to preserve order
MOST_CHROMA = 0.32  # of OKLab within the gamut
NEAR_END = 0.05  # of lightness: colors this near to black or white move black or white with them
KEPT = 0.12  # range of lightness on both sides of a swapped color in which differences are preserved


def adjust_map(config: AdjustConfig) -> ColorMap:
    """The color map of adjustments: swaps, in their order, then one affine map of the others."""
    luminance = np.ones((3, 1)) * LUMINANCE
    gains = np.exp(config.temperature * np.array(WARMTH))
    gains /= gains @ LUMINANCE  # grays keep their luminance
    saturation = config.saturation * np.eye(3) + (1 - config.saturation) * luminance
    offset = np.full(3, MIDDLE * (1 - config.contrast) + config.brightness)
    affine = Affine(config.contrast * saturation @ np.diag(gains), offset)
    if not config.swaps:
        return affine
    return Chain([*(Swap.of(text) for text in config.swaps), affine])


@dataclass(frozen=True, eq=False)
class Gray:
    """Colors without chroma, in the same OKLab lightness: a `ColorMap`."""

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        lab = oklab_of(rgb)
        lab[:, 1:] = 0
        return rgb_of_oklab(lab)

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        return difference_slopes(self, rgb)


@dataclass(frozen=True, eq=False)
class Swap:
    """A swap of one color and its shades for another: a `ColorMap`.

    Attributes:
        before: [3] OKLab.
        after: [3] OKLab.
    """

    before: F64
    after: F64

    @classmethod
    def of(cls, text: str) -> "Swap":
        """The swap of a text "#rrggbb:#rrggbb"."""
        before, after = oklab_of(np.array([rgb_of(color) for color in text.split(":")]))
        return cls(before, after)

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        lab = oklab_of(rgb)
        weights, moved = self._weights(lab), np.empty_like(lab)
        within = np.clip(lab[:, 0], self._curve.x[0], self._curve.x[-1])
        moved[:, 0] = self._curve(within) + lab[:, 0] - within
        moved[:, 1:] = self._moved_chroma(lab[:, 1:])
        mapped = rgb_of_oklab(lab + weights[:, None] * (moved - lab))
        return np.where(weights[:, None] > 0, mapped, rgb)  # unaffected colors stay, bit for bit

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        return difference_slopes(self, rgb)

    @property
    def _chroma(self) -> float:
        return float(np.hypot(*self.before[1:]))

    def _moved_chroma(self, ab: F64) -> F64:
        """[M, 2] a and b after: colors are rotated, with chroma by a monotone curve; grays are shifted."""
        if self._chroma < GREY:
            return ab + (self.after[1:] - self.before[1:])
        old, new = complex(*self.before[1:]), complex(*self.after[1:])
        turn = new / old / abs(new / old) if abs(new) > 1e-9 else 1.0
        chroma = np.hypot(*ab.T)
        # A constant factor would move shades of a dull color that becomes bright far out of gamut.
        last = max(abs(old), abs(new), MOST_CHROMA) + 0.01
        curve = PchipInterpolator([0, abs(old), last], [0, abs(new), last])
        factors = curve(np.minimum(chroma, last)) + np.maximum(chroma - last, 0)
        turned = (ab[:, 0] + 1j * ab[:, 1]) * turn * factors / np.maximum(chroma, 1e-9)
        return np.stack([turned.real, turned.imag], axis=1)

    @cached_property
    def _curve(self) -> PchipInterpolator:
        """Lightness after as a function of lightness before: slope 1 around the color; black and white stay.

        If the color is black or white itself, these move with it.
        """
        old, new = float(self.before[0]), float(np.clip(self.after[0], 0.02, 0.98))
        kept = min(KEPT, 0.6 * min(new, 1 - new))
        knots = [(old - kept, new - kept), (old, new), (old + kept, new + kept)]
        if old - kept > NEAR_END:
            knots = [(0.0, 0.0), *knots]
        if old + kept < 1 - NEAR_END:
            knots = [*knots, (1.0, 1.0)]
        return PchipInterpolator(*np.transpose(knots))

    def _weights(self, lab: F64) -> F64:
        """[M] weight of each color, 0 to 1."""
        if self._chroma < GREY:
            whole, none = GREY_LIGHTNESS
            none = max(none, whole + GENTLE * abs(self.after[0] - self.before[0]))
            away = np.abs(lab[:, 0] - self.before[0])
            distances = np.linalg.norm(lab[:, 1:] - self.before[1:], axis=1)
            return _falling(distances, *GREY_CHROMA) * _falling(away, whole, none)
        chroma = np.linalg.norm(lab[:, 1:], axis=1)
        cosines = lab[:, 1:] @ self.before[1:] / (np.maximum(chroma, 1e-9) * self._chroma)
        angles = np.arccos(np.clip(cosines, -1, 1))
        whole, none = CHROMA
        return _falling(angles, *HUES) * _falling(-chroma / self._chroma, -whole, -none)


def _falling(values: F64, whole: float, none: float) -> F64:
    """1 up to `whole`, 0 from `none` on, smooth in between."""
    shares = np.clip((none - values) / (none - whole), 0, 1)
    return np.asarray(shares**2 * (3 - 2 * shares))
