"""Color maps on Gaussians: base colors by the map, view-dependent terms by its derivative.

So highlights stay highlights. Blending is linear in color: an affine map of Gaussians and background equals
the same map of the picture, up to clipping; other maps are right to first order.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from brushgs.core.threads import num_threads_or_default
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

if TYPE_CHECKING:
    from brushgs.passes.style.features import StrokeFeatures

ROWS_AT_A_TIME = 1 << 14  # of derivatives in memory
STEP = 1e-3  # of RGB: for derivatives by differences


class ColorMap(Protocol):
    """A map of display-encoded colors; values beyond 0 to 1 are not clipped."""

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """[M, 3] the colors after the map.

        Args:
            rgb: [M, 3] before.
            features: of the M strokes with these colors; None for colors of no stroke, such as a ground.
        """

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """[M, 3, 3] the derivative of the map; `after` is the result of `colors`."""


@dataclass(frozen=True, eq=False)
class Affine:
    """The map c -> matrix c + offset.

    Attributes:
        matrix: [3, 3].
        offset: [3].
    """

    matrix: F64
    offset: F64

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        return np.asarray(rgb @ self.matrix.T + self.offset)

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        return np.broadcast_to(self.matrix, (len(rgb), 3, 3))


@dataclass(frozen=True, eq=False)
class Blend:
    """Several maps, blended by shares: c + sum of share x (map(c) - c), linear in every share.

    Attributes:
        maps: with their shares, each 0 to 1.
    """

    maps: Sequence[tuple[ColorMap, float]]

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        return rgb + sum(share * (one.colors(rgb, features) - rgb) for one, share in self.maps)

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        own = (1 - sum(share for _, share in self.maps)) * np.eye(3)
        return own + sum(
            share * one.slopes(rgb, one.colors(rgb, features), features) for one, share in self.maps
        )


@dataclass(frozen=True, eq=False)
class Chain:
    """A composition of maps.

    Attributes:
        maps: in the order of application.
    """

    maps: Sequence[ColorMap]

    def colors(self, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        for one in self.maps:
            rgb = one.colors(rgb, features)
        return rgb

    def slopes(self, rgb: F64, after: F64, features: "StrokeFeatures | None" = None) -> F64:
        """See `ColorMap`."""
        slopes = np.broadcast_to(np.eye(3), (len(rgb), 3, 3))
        for one in self.maps:
            then = one.colors(rgb, features)
            slopes, rgb = one.slopes(rgb, then, features) @ slopes, then
        return slopes


def difference_slopes(one: ColorMap, rgb: F64, features: "StrokeFeatures | None" = None) -> F64:
    """[M, 3, 3] the numerical derivative of a map, by central differences."""
    slopes = np.empty((len(rgb), 3, 3))
    for channel, step in enumerate(STEP * np.eye(3)):
        ahead, behind = one.colors(rgb + step, features), one.colors(rgb - step, features)
        slopes[:, :, channel] = (ahead - behind) / (2 * STEP)
    return slopes


def map_colors(gaussians: Gaussians, one: ColorMap, features: "StrokeFeatures | None" = None) -> Gaussians:
    """Gaussians in other colors, in the same dtype.

    Args:
        gaussians: N Gaussians.
        one: the map.
        features: of the N strokes, for maps that depend on more than color.
    """
    sh = gaussians.sh
    mapped = np.empty_like(sh)

    def map_rows(first: int) -> None:
        rows = slice(first, first + ROWS_AT_A_TIME)
        some = None if features is None else features.take(rows)
        before = 0.5 + C0 * sh[rows, 0].astype(np.float64)
        after = one.colors(before, some)
        mapped[rows, 0] = (after - 0.5) / C0
        if sh.shape[1] > 1:
            slopes = one.slopes(before, after, some).astype(sh.dtype)
            np.matmul(sh[rows, 1:], slopes.transpose(0, 2, 1), out=mapped[rows, 1:])

    with ThreadPoolExecutor(num_threads_or_default(None)) as pool:
        list(pool.map(map_rows, range(0, len(sh), ROWS_AT_A_TIME)))
    return replace(gaussians, sh=mapped)
