"""The tones of a picture of strokes, for drawing: smoothed within surfaces, and with spot blacks.

Lengths are pixels in a picture of `PIXELS`, and scale with the root of the area: pictures of all sizes show
the same shapes.
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

FINE, FINE_EDGE = 3.0, 0.05  # radius over which tones are averaged, px, and the contrast of edges that stay
BROAD, BROAD_EDGE = 12.0, 0.10  # the same for the masses that become black
JUMP = 0.05  # of the depth, beyond which what is nearer crosses what is behind
HALO = 3.0  # px of paper that are left there
THINNING, STEEP = 6.0, 1.6  # px beyond a sharp outline that thinning ink reaches, and its contrast
SHARP = 0.6  # px, standard deviation of the last smoothing, in place of the steps of pixels
FADED = (0.6, 1.1)  # areas over the least one at which a region is paper, and wholly black
LAID, SKIRT = 0.8, 2.0  # share from which a pixel counts as ink, and px of the soft edge around it
EDGE = 1.6  # px, standard deviation of the smoothing of the outline of blacks
ROUND = 0.5  # share of a mask within `EDGE` at which its outline runs
LOWEST, HIGHEST, ROUNDS = 0.06, 0.46, 7  # tones between which the threshold lies, and halvings of these
CLEAR, SOLID = 0.3, 0.45  # alpha of strokes up to which paper hides nothing, and from which it hides all


@dataclass(frozen=True, eq=False)
class Tones:
    """Tones of a picture.

    Attributes:
        fine: [H, W] 0 (black) to 1 (white, and where there is nothing).
        broad: [H, W] the same of masses.
        alpha: [H, W] coverage.
        is_jump: [H, W] behind something nearer.
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
        """[H, W] the masses darker than a threshold, with smooth outlines, before small ones are left out."""
        dark = (self.masses < threshold) & self.can_be_black
        return np.asarray((self.smoothed(dark) > ROUND) & ~self.is_jump)

    @property
    def masses(self) -> F32:
        """[H, W] the tones by which masses are told."""
        return np.asarray(0.5 * (self.fine + self.broad))

    @property
    def can_be_black(self) -> Mask:
        """[H, W] surfaces, but for paper behind what is nearer."""
        return np.asarray((self.alpha > 0.5) & ~self.is_jump)

    def smoothed(self, mask: Array | Mask) -> F32:
        """[H, W] a mask averaged over its neighbourhood."""
        return np.asarray(ndimage.gaussian_filter(mask.astype(np.float32), EDGE * self.scale, truncate=3.0))


def _side(radius: float) -> int:
    """Pixels along a square window of a radius, px, at least 1."""
    return 2 * max(1, round(radius)) + 1


def _within_edges(values: F32, radius: float, contrast: float) -> F32:
    """Averages that keep edges of more than a contrast.

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
    """Spot blacks: the effect on a coat of strokes in greys, which leaves their darkest masses in one colour.

    Everything else becomes paper, which hides what lies behind. With a threshold of 0 all is paper.

    Attributes:
        threshold: tone below which a mass is black.
        least_area: of a region, share of the picture.
        ink: RGB.
        paper: RGB.
        softness: tones to both sides of the threshold over which ink thins out, for films: where a mass is as
            dark as the threshold, an edge would jump from frame to frame. 0 for a sharp edge.
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
        """See `Effect`: regions count by their whole area, paper alone by none."""
        return None if self.threshold > 0 else 0

    def areas(self, picture: Array) -> "Sequence[tuple[Array, Color]]":
        """See `Effect`: paper, and ink on it."""
        paper, ink = np.array(self.paper), np.array(self.ink)
        tint = ink - paper
        shares = ((picture - paper) @ tint) / max(float(tint @ tint), 1e-12)
        return [(np.ones_like(shares), self.paper), (shares, self.ink)]

    def stand_in(self, coat: "Coat") -> "Coat":
        """See `Effect`: the strokes of the blacks in ink, all others in the colour of the paper."""
        is_black = base_colors(coat.strokes.sh)[:, 1] < self.threshold
        colors = np.where(is_black[:, None], self.ink, self.paper)
        return replace(coat, strokes=in_colors(coat.strokes, colors), effect=None)

    def shares(self, tones: Tones) -> F32:
        """[H, W] 0 (paper) to 1 (ink): smooth within a pixel of the outline."""
        mask = tones.is_black(self.threshold)
        least = self.least_area * mask.size
        shares = _by_area(mask, least)
        if not shares.any():
            return shares
        shares += (1 - shares) * (1 - _by_area(~mask, 0.5 * least)) * ~mask  # holes in them fill likewise
        if self.softness:
            return self._thinning(tones, shares)
        near = ndimage.gaussian_filter(shares, SHARP * tones.scale, truncate=3.0)
        smooth = np.asarray(np.clip((near - 0.2) / 0.6, 0, 1), np.float32)
        whole = _without_small(smooth > LAID, least)  # a neck that was smoothed away leaves pieces
        near_whole = ndimage.maximum_filter(whole, _side(SKIRT * tones.scale))
        return np.asarray(smooth * near_whole, np.float32)

    def _thinning(self, tones: Tones, shares: F32) -> F32:
        """[H, W] the same with edges over a range of tones, near regions of these shares."""
        ramp = np.clip(0.5 + (self.threshold - tones.masses) / (2 * self.softness), 0, 1) * tones.can_be_black
        near = ndimage.maximum_filter(shares, _side(THINNING * tones.scale), mode="nearest")
        return np.asarray(near * np.clip(0.5 + STEEP * (tones.smoothed(ramp) - 0.5), 0, 1), np.float32)


def large_ones(mask: Mask, least: float) -> Mask:
    """The regions of a mask of at least a share of the picture, without holes smaller than half of that."""
    kept = _without_small(mask, least * mask.size)
    return ~_without_small(~kept, 0.5 * least * mask.size)


def _by_area(mask: Mask, least: float) -> F32:
    """[H, W] 1 in regions of a mask from a least area on, px, less in smaller ones: none pops up."""
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
    """The threshold and least area by which blacks cover a share of what is painted in some pictures.

    Args:
        pictures: of a job, at least one.
        share: 0 to 1.
        most_regions: at most, in each picture.
        least_pixels: area of a region in a picture of `PIXELS`.

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
    """The area that all but `rank` regions of a mask are below, as a share of the picture."""
    labels, count = ndimage.label(mask)
    if count <= rank:
        return 0.0
    areas = np.sort(np.bincount(labels.ravel())[1:])
    return float(areas[-rank - 1] + 1) / mask.size
