"""Tones of a picture of strokes, for drawing: smoothed within surfaces, and spot blacks.

Lengths are pixels in a picture of `PIXELS` pixels, and scale with the root of the area, so that pictures of
all sizes show the same shapes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from brushgs.rendering.nested import PIXELS, scale_of
from brushgs.values.arrays import F32, Array, Mask, smoothstep
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.sh import base_colors, in_colors

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.effect import Color

FINE, FINE_EDGE = 3.0, 0.05  # averaging radius of tones, px, and contrast of the edges that are kept
BROAD, BROAD_EDGE = 12.0, 0.10  # the same for masses, which become black
JUMP = 0.05  # relative depth step that counts as an occlusion edge
HALO = 3.0  # px of paper left behind such an edge
THINNING, STEEP = 6.0, 1.6  # reach of thinning ink beyond a sharp outline, px, and its contrast
SHARP = 0.6  # px, standard deviation of the final antialiasing
FADED = (0.6, 1.1)  # area over the least area up to which a region is paper, and from which it is fully black
LAID, SKIRT = 0.8, 2.0  # share from which a pixel counts as ink, and width of the soft edge around it, px
EDGE = 1.6  # px, standard deviation of the smoothing of the outline of blacks
EDGE_MOVING = 1.2  # px, the least of it in films of any size: below, steps of pixels run along the outline
ROUND = 0.5  # level of the smoothed mask at which the outline runs
LOWEST, HIGHEST, ROUNDS = 0.06, 0.46, 7  # range of the threshold, and steps of its bisection
CLEAR, SOLID = 0.3, 0.45  # alpha of strokes up to which paper is transparent, and from which it is opaque


@dataclass(frozen=True, eq=False)
class Tones:
    """Tones of a picture.

    Attributes:
        fine: [H, W] 0 (black) to 1 (white, also where nothing is painted).
        broad: [H, W] the same for masses.
        alpha: [H, W] coverage.
        is_jump: [H, W] mask of surfaces just behind an occlusion edge.
        scale: see `scale_of`.
    """

    fine: F32
    broad: F32
    alpha: F32
    is_jump: Mask
    scale: float

    @classmethod
    def of(cls, rgb: Array, alpha: Array, depth: Array, scale: float) -> "Tones":
        """The tones of a picture of strokes in greys.

        Args:
            rgb: [H, W, 3] premultiplied.
            alpha: [H, W].
            depth: [H, W] camera z; infinite where there is no surface.
            scale: see `scale_of`.
        """
        alpha = alpha.astype(np.float32)
        value = np.asarray(rgb[..., 1] + (1 - alpha), np.float32)
        fine = _within_edges(value, FINE * scale, FINE_EDGE)
        broad = _within_edges(fine, BROAD * scale, BROAD_EDGE)
        size = _side(HALO * scale)
        with np.errstate(invalid="ignore"):
            nearest = ndimage.minimum_filter(depth, size, mode="nearest")
            is_jump = depth - nearest > JUMP * np.minimum(nearest, depth)
        is_jump &= np.isfinite(depth)
        return cls(fine, broad, alpha, is_jump, scale)

    def is_black(self, threshold: float) -> Mask:
        """[H, W] mask of masses darker than a threshold, with smooth outlines; small ones are included."""
        dark = (self.masses < threshold) & self.can_be_black
        return np.asarray((self.smoothed(dark) > ROUND) & ~self.is_jump)

    @property
    def masses(self) -> F32:
        """[H, W] tones that are compared with the threshold: the mean of fine and broad tones."""
        return np.asarray(0.5 * (self.fine + self.broad))

    @property
    def can_be_black(self) -> Mask:
        """[H, W] mask of surfaces, except behind occlusion edges."""
        return np.asarray((self.alpha > 0.5) & ~self.is_jump)

    def smoothed(self, mask: Array | Mask, least: float = 0.0) -> F32:
        """[H, W] a mask, smoothed by a Gaussian of a standard deviation of at least `least` px."""
        deviation = max(EDGE * self.scale, least)
        return np.asarray(ndimage.gaussian_filter(mask.astype(np.float32), deviation, truncate=3.0))


def _side(radius: float) -> int:
    """Side of the square window of a radius of at least 1, pixels."""
    return 2 * max(1, round(radius)) + 1


def _within_edges(values: F32, radius: float, contrast: float) -> F32:
    """Smooth values, but keep edges above a contrast.

    Source: He, Sun and Tang 2010, Guided Image Filtering.
    """
    size = _side(radius)

    def mean(of: F32) -> F32:
        return np.asarray(ndimage.uniform_filter(of, size, mode="nearest"))

    means = mean(values)
    spread = np.maximum(mean(values * values) - means * means, 0)
    share = np.asarray(spread / (spread + contrast**2), np.float32)
    return mean(share) * values + mean(np.asarray(means * (1 - share), np.float32))


@dataclass(frozen=True)
class Blacks:
    """Spot blacks: an `Effect` that paints the darkest masses of a coat of grey strokes in one color.

    The rest becomes opaque paper. With a threshold of 0 all is paper.

    Attributes:
        threshold: tone below which a mass is black.
        least_area: of a region, share of the picture.
        ink: RGB.
        paper: RGB.
        softness: range of tones on both sides of the threshold over which ink thins out, for films: their
            outlines move by less than a pixel from frame to frame. 0: sharp edge.
    """

    threshold: float
    least_area: float
    ink: tuple[float, float, float]
    paper: tuple[float, float, float]
    softness: float = 0.0

    @property
    def traits(self) -> str:
        """See `Effect`."""
        return "spot blacks"

    def __call__(self, painted: Frame, camera: Camera, surface: object = None, part: object = None) -> Frame:
        """See `Effect`."""
        assert painted.depth is not None, "coats with effects have a depth"
        shares = np.zeros(painted.alpha.shape, np.float32)
        if self.threshold > 0:
            depth = np.where(painted.alpha > 0.5, painted.depth, np.inf).astype(np.float32)
            shares = self.shares(Tones.of(painted.rgb, painted.alpha, depth, scale_of(camera)))
        dtype = painted.rgb.dtype
        paper, ink = (np.asarray(color, dtype) for color in (self.paper, self.ink))
        alpha = np.maximum(smoothstep((painted.alpha - CLEAR) / (SOLID - CLEAR)), shares).astype(dtype)
        rgb = alpha[..., None] * paper + (alpha * shares.astype(dtype))[..., None] * (ink - paper)
        return Frame(rgb, alpha, painted.depth, painted.height)

    def reach(self, camera: Camera) -> int | None:
        """See `Effect`: None, as regions are selected by their whole area; 0 for paper alone."""
        return None if self.threshold > 0 else 0

    def areas(self, picture: Array) -> "Sequence[tuple[Array, Color]]":
        """See `Effect`: paper, and ink on it."""
        paper, ink = np.array(self.paper), np.array(self.ink)
        tint = ink - paper
        shares = ((picture - paper) @ tint) / max(float(tint @ tint), 1e-12)
        return [(np.ones_like(shares), self.paper), (shares, self.ink)]

    def stand_in(self, coat: "Coat") -> "Coat":
        """See `Effect`: the strokes of the blacks in ink, all others in the color of the paper."""
        is_black = base_colors(coat.strokes.sh)[:, 1] < self.threshold
        colors = np.where(is_black[:, None], self.ink, self.paper)
        return replace(coat, strokes=in_colors(coat.strokes, colors), effect=None)

    def shares(self, tones: Tones) -> F32:
        """[H, W] 0 (paper) to 1 (ink), antialiased at the outline."""
        mask = tones.is_black(self.threshold)
        least = self.least_area * mask.size
        shares = _by_area(mask, least)
        if not shares.any():
            return shares
        shares += (1 - shares) * (1 - _by_area(~mask, 0.5 * least)) * ~mask  # small holes are filled likewise
        if self.softness:
            return self._thinning(tones, shares)
        shares = np.asarray(shares > 0.5, np.float32)  # a still has no grey ones, half as large as the least
        near = ndimage.gaussian_filter(shares, SHARP * tones.scale, truncate=3.0)
        smooth = np.asarray(np.clip((near - 0.2) / 0.6, 0, 1), np.float32)
        whole = _without_small(smooth > LAID, least)  # smoothing may have cut a region into small pieces
        near_whole = ndimage.maximum_filter(whole, _side(SKIRT * tones.scale))
        return np.asarray(smooth * near_whole, np.float32)

    def _thinning(self, tones: Tones, shares: F32) -> F32:
        """[H, W] shares of ink that thin out over a range of tones, near regions with these shares."""
        ramp = np.clip(0.5 + (self.threshold - tones.masses) / (2 * self.softness), 0, 1) * tones.can_be_black
        near = ndimage.maximum_filter(shares, _side(THINNING * tones.scale), mode="nearest")
        return np.asarray(
            near * np.clip(0.5 + STEEP * (tones.smoothed(ramp, EDGE_MOVING) - 0.5), 0, 1), np.float32
        )


def large_ones(mask: Mask, least: float) -> Mask:
    """The regions that cover at least `least` of the picture, with holes below half of that filled."""
    kept = _without_small(mask, least * mask.size)
    return ~_without_small(~kept, 0.5 * least * mask.size)


def _by_area(mask: Mask, least: float) -> F32:
    """[H, W] weight of each region by its area over `least` (px), rising smoothly so that none pops up."""
    labels, count = ndimage.label(mask)
    areas = np.bincount(labels.ravel(), minlength=count + 1)
    shares = smoothstep((areas / max(least, 1.0) - FADED[0]) / (FADED[1] - FADED[0]))
    shares[0] = 0
    return np.asarray(shares.astype(np.float32)[labels])


def _without_small(mask: Mask, least: float) -> Mask:
    labels, count = ndimage.label(mask)
    is_kept = np.bincount(labels.ravel(), minlength=count + 1) >= least
    is_kept[0] = False
    return np.asarray(is_kept[labels])


def blacks_of(
    pictures: "list[Tones]", *, share: float, most_regions: int, least_pixels: float
) -> tuple[float, float]:
    """Choose threshold and least area so that blacks cover a share of the painted area of pictures.

    Args:
        pictures: at least one.
        share: 0 to 1.
        most_regions: limit of black regions in each picture.
        least_pixels: least area of a region in a picture of `PIXELS` pixels.

    Returns:
        `Blacks.threshold` and `Blacks.least_area`.
    """
    painted = sum(float((tones.alpha > 0.5).sum()) for tones in pictures)
    low, high, least = LOWEST, HIGHEST, least_pixels / PIXELS
    for _ in range(ROUNDS):
        middle = 0.5 * (low + high)
        masks = [tones.is_black(middle) for tones in pictures]
        least = max(least_pixels / PIXELS, *(_area_of(mask, most_regions) for mask in masks))
        dark = sum(float(large_ones(mask, least).sum()) for mask in masks)
        low, high = (middle, high) if dark < share * painted else (low, middle)
    return 0.5 * (low + high), least


def _area_of(mask: Mask, rank: int) -> float:
    """Least area that only the `rank` largest regions of a mask reach, as a share of the picture."""
    labels, count = ndimage.label(mask)
    if count <= rank:
        return 0.0
    areas = np.sort(np.bincount(labels.ravel())[1:])
    return float(areas[-rank - 1] + 1) / mask.size
