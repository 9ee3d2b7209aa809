"""Give Gaussians the colors of a painting, in closed form.

The scene's colors, weighted by painted area, get mean and covariance of the painting's pixels by the
Monge-Kantorovich map, the linear map that does so and moves colors least.
Source: Pitie and Kokaram 2007, The linear Monge-Kantorovitch linear color mapping for example-based color
transfer, eq. 10.
"""

from dataclasses import dataclass, replace
from math import ceil, sqrt
from typing import get_args

import numpy as np

from brushgs.options.choices import ColorSpace
from brushgs.passes.color.color_map import ColorMap, map_colors
from brushgs.passes.color.color_space import Space
from brushgs.passes.reduce.contribution import paint_of
from brushgs.values.arrays import F64, Array, check
from brushgs.values.colors import split_alpha
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

# Largest stretch of color differences: more would turn noise of a gray scene into bright confetti. Trained
# scenes and paintings are within 0.2 to 4 of each other along every axis.
MAX_STRETCH = 10.0
MOST_PIXELS = 1 << 18  # of a picture that its colors are taken from


@dataclass(frozen=True, eq=False)
class Palette:
    """Mean and covariance of the colors of a painting, in the space where they are matched.

    Attributes:
        mean: [3].
        covariance: [3, 3].
        space: "lab", "linear" or "srgb", see `color_space`.
    """

    mean: F64
    covariance: F64
    space: ColorSpace = "lab"

    @classmethod
    def of_colors(cls, rgb: Array, weights: Array | None = None, *, space: ColorSpace = "lab") -> "Palette":
        """The palette of display-encoded colors [N, 3] with weights [N] >= 0; None for equal weights.

        Raises:
            TypeError: if an argument is not an array.
            ValueError: if all weights are zero, shapes are wrong or the space is unknown.

        Example:
            >>> bg.Palette.of_colors(np.array([[0.8, 0.1, 0.1], [0.1, 0.2, 0.7]])).space
            'lab'
        """
        weights = np.ones(len(rgb)) if weights is None else weights
        check("Palette", rgb=(rgb, "N 3"), weights=(weights, "N"))
        if space not in get_args(ColorSpace):
            raise ValueError(
                f"Palette: space must be one of {', '.join(get_args(ColorSpace))}, got {space!r}"
            )
        total = float(weights.sum(dtype=np.float64))
        if not total > 0:
            raise ValueError("Palette: there must be a color with a weight above zero, got none")
        colors, shares = Space(space).to(rgb), weights.astype(np.float64) / total
        mean = shares @ colors
        away = colors - mean
        return cls(mean, away.T @ (away * shares[:, None]), space)

    @classmethod
    def of_image(cls, image: Array, *, space: ColorSpace = "lab") -> "Palette":
        """The palette of a picture [H, W, C] as `read_image` returns it: gray or RGB, weighted by its alpha.

        Of a large picture every second, third, ... row and column counts.

        Raises:
            TypeError: if `image` is not an array.
            ValueError: if it is fully transparent, empty, has other channels, or the space is unknown.
        """
        channels = check("Palette", image=(image, "H W C"))["C"]
        if not 1 <= channels <= 4:
            raise ValueError(f"Palette: image must have 1 to 4 channels, got {channels}")
        every = max(1, ceil(sqrt(image.shape[0] * image.shape[1] / MOST_PIXELS)))
        rgb, alpha = split_alpha(image[::every, ::every].reshape(-1, channels))
        return cls.of_colors(rgb, alpha, space=space)


def recolor(
    gaussians: Gaussians,
    palette: Palette,
    strength: float = 1.0,
    *,
    weights: Array | None = None,
    shares: F64 | None = None,
) -> Gaussians:
    """Give Gaussians the colors of a painting: their mean and covariance become the palette's.

    Base colors are mapped by the Monge-Kantorovich map in the palette's space; the view-dependent terms by
    its derivative at the base color, so that highlights stay highlights. Out-of-gamut colors are kept: they
    are clipped only when a picture is written.

    Args:
        gaussians: N Gaussians.
        palette: of the painting.
        strength: 0 changes nothing, 1 matches the palette; mean and map are interpolated in between.
        weights: [N] >= 0 of the Gaussians; None for opacity x mean projected area.
        shares: [N] 0 to 1, strength for each Gaussian; only those above 0 are matched to the palette, the
            others keep their colors bit for bit. None for 1.

    Returns:
        The Gaussians with other `sh`, in the same dtype; the input itself at strength 0 or if N = 0.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if `strength` is out of range, or the weights have another length or sum to zero.

    The covariance is matched up to a stretch of `MAX_STRETCH` along each axis, which a scene of one color
    exceeds. Base colors are exact to rounding, view-dependent terms to first order.

    Example:
        >>> red_and_blue = bg.Palette.of_colors(np.array([[0.8, 0.1, 0.1], [0.1, 0.2, 0.7]]))
        >>> bg.recolor(strokes, red_and_blue, 0.5)
        Gaussians(500, SH 3)
    """
    if not 0 <= strength <= 1:
        cure = f"; for {strength:g} % write {strength / 100:g}" if 1 < strength <= 100 else ""
        raise ValueError(f"recolor: strength must be in [0, 1], got {strength:g}{cure}")
    if strength == 0 or len(gaussians) == 0:
        return gaussians
    if shares is not None:
        return _recolor_part(gaussians, palette, strength, weights, shares)
    return map_colors(gaussians, matching_map(gaussians, palette, strength, weights=weights))


def matching_map(
    gaussians: Gaussians, palette: Palette, strength: float = 1.0, *, weights: Array | None = None
) -> ColorMap:
    """The map of `recolor`, to apply also to other Gaussians of the scene; arguments as there.

    Raises:
        TypeError: if an argument has another type.
        ValueError: if there are no Gaussians, or the weights have another length or sum to zero.
    """
    weights = painted_weights(gaussians) if weights is None else weights
    check("recolor", means=(gaussians.means, "N 3"), weights=(weights, "N"))
    base = 0.5 + C0 * gaussians.sh[:, 0].astype(np.float64)
    own = Palette.of_colors(base, weights, space=palette.space)
    matrix = (1 - strength) * np.eye(3) + strength * monge_kantorovich(own.covariance, palette.covariance)
    mean = (1 - strength) * own.mean + strength * palette.mean
    return _LinearMap(Space(palette.space), own.mean, matrix, mean)


def painted_weights(gaussians: Gaussians) -> Array:
    """[N] opacity x mean projected area; 1 for all if all are 0."""
    weights = paint_of(gaussians)
    return weights if weights.any() else np.ones(len(gaussians))


def _recolor_part(
    gaussians: Gaussians, palette: Palette, strength: float, weights: Array | None, shares: F64
) -> Gaussians:
    weights = painted_weights(gaussians) if weights is None else weights
    check("recolor", means=(gaussians.means, "N 3"), weights=(weights, "N"), shares=(shares, "N"))
    rows = np.flatnonzero(shares > 0)
    part, own = gaussians.take(rows), (weights * shares)[rows]
    recolored = recolor(part, palette, strength, weights=own if own.any() else np.ones(len(rows)))
    sh, share = gaussians.sh.copy(), shares[rows, None, None].astype(gaussians.sh.dtype)
    sh[rows] = np.where(share == 1, recolored.sh, part.sh + share * (recolored.sh - part.sh))
    return replace(gaussians, sh=sh)


@dataclass(frozen=True, eq=False)
class _LinearMap:
    """The map of colors c -> matrix (c - center) + mean in a color space, a `ColorMap`."""

    space: Space
    center: F64
    matrix: F64
    mean: F64

    def colors(self, rgb: F64, features: object = None) -> F64:
        return self.space.back((self.space.to(rgb) - self.center) @ self.matrix.T + self.mean)

    def slopes(self, rgb: F64, after: F64, features: object = None) -> F64:
        return self.space.slopes(rgb, after, self.matrix)


def monge_kantorovich(source: F64, target: F64) -> F64:
    """The Monge-Kantorovich map [3, 3] from one covariance to another, its stretch at most `MAX_STRETCH`."""
    values, axes = np.linalg.eigh(source)
    # Variances below this stay invisible after the largest stretch.
    floor = max(float(np.trace(target)), float(values[-1]), np.finfo(np.float64).tiny) * 1e-8
    roots = np.sqrt(np.maximum(values, floor))
    root, inverse = (axes * roots) @ axes.T, (axes / roots) @ axes.T
    inner, axes_inner = np.linalg.eigh(root @ target @ root)
    middle = (axes_inner * np.sqrt(np.maximum(inner, 0))) @ axes_inner.T
    stretches, own = np.linalg.eigh(inverse @ middle @ inverse)
    return np.asarray((own * np.minimum(stretches, MAX_STRETCH)) @ own.T)
