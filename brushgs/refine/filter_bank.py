"""Style features without trained weights: color, its deviation, strength and direction of marks.

At three scales, an octave apart, every position gets 25 numbers: mean and standard deviation of each channel
around it; the energy of edges and of lines (oriented derivatives of a Gaussian; Freeman and Adelson 1991)
pooled around it, as the mean over 8 directions and, for each direction, as the relative difference from that
mean; and a constant, so that a cosine depends on the strength of the others. Directions are relative,
independent of contrast: faint and bold hatching have the same direction. Each kind is scaled to a root mean
square of its weight over the style image.
"""

from functools import cache

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from kornia.color import rgb_to_grayscale
from kornia.filters import filter2d, get_gaussian_kernel1d
from torch import Tensor

from brushgs.values.colors import LUMINANCE

SCALES = (1, 2, 4)  # pixels of the picture to one pixel of the scale
STRIDES = (4, 2, 2)  # pixels of the scale between positions
DIRECTIONS = 8
# Standard deviation and half size, pixels of the scale: of the filters for edges and lines, and of pooling.
SIGMA, REACH = 1.2, 4
POOL_SIGMA, POOL_REACH = 2.0, 5
HALO = 4 * (REACH + POOL_REACH)  # receptive field around a position, pixels of the picture
CONSTANT = 0.5
FAINT = 0.01  # root energy below which directions fade: flat areas have none
# Root mean square of each kind after scaling: means of color, deviations of color, strengths, directions.
WEIGHTS = (2.0, 0.5, 0.5, 2.0)
_KINDS = (slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 24))
_CHANNELS = 24
_CONTENT_SCALES = slice(1, 3)  # coarse colors, without brush marks, describe the content


class FilterBank:
    """The features, scaled for one style image.

    Attributes:
        strides: pixels of the picture between positions, for each group.
        halo: pixels around a position on which its features depend.
    """

    strides = tuple(scale * stride for scale, stride in zip(SCALES, STRIDES, strict=True))
    halo = HALO

    def __init__(self, painting: Tensor) -> None:
        """Scale the features for a style image.

        Args:
            painting: [3, H, W] RGB, 0 to 1.
        """
        self._factors = [torch.ones(_CHANNELS, 1, 1)] * len(SCALES)
        factors = []
        with torch.no_grad():
            for group in self(painting):
                factor = torch.ones(_CHANNELS, 1, 1)
                for kind, weight in zip(_KINDS, WEIGHTS, strict=True):
                    rms = group[kind].square().sum(dim=0).mean().sqrt()
                    factor[kind] = weight / rms.clamp_min(1e-3)
                factors.append(factor)
        self._factors = factors

    def __call__(self, picture: Tensor) -> list[Tensor]:
        """Features of a picture [3, H, W]: [25, h, w] at each scale, from the first pixel on."""
        groups = []
        for scale, stride, factor in zip(SCALES, STRIDES, self._factors, strict=True):
            reduced = F.avg_pool2d(picture[None], scale, ceil_mode=True)[0] if scale > 1 else picture
            maps = factor * _scale_features(reduced, stride)
            groups.append(torch.cat([maps, torch.full_like(maps[:1], CONSTANT)]))
        return groups

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """The features [25, n] that describe the content: colors at the coarser scales."""
        return [torch.cat([group[_KINDS[0]], group[-1:]]) for group in groups[_CONTENT_SCALES]]


def _scale_features(picture: Tensor, stride: int) -> Tensor:
    """[24, h, w] features of one scale, before their weights."""
    luminance = rgb_to_grayscale(picture, torch.tensor(LUMINANCE))
    filters = oriented_filters().to(picture.dtype)
    copies = luminance.expand(len(filters), 1, -1, -1)  # `filter2d` takes one filter per row of the batch
    energy = filter2d(copies, filters, border_type="replicate")[:, 0].square()
    pooled = _pool(torch.cat([picture, picture.square(), energy]), stride)
    mean = pooled[:3]
    deviation = (pooled[3:6] - mean.square()).clamp_min(0).add(1e-5).sqrt()
    roots = pooled[6:].add(1e-8).sqrt().unflatten(0, (2, DIRECTIONS))
    strength = roots.mean(dim=1)
    directions = (roots - strength[:, None]) / (strength[:, None] + FAINT)
    return torch.cat([mean - 0.5, deviation, strength, directions.flatten(0, 1)])


def _pool(maps: Tensor, stride: int) -> Tensor:
    """Maps [C, H, W] through a Gaussian filter, at every `stride`-th pixel.

    Own code: `kornia.filters.gaussian_blur2d` filters every pixel and takes 1.4 to 2.0 times as long.
    """
    weights = get_gaussian_kernel1d(2 * POOL_REACH + 1, POOL_SIGMA, dtype=maps.dtype)
    padded = F.pad(maps[:, None], (POOL_REACH,) * 4, mode="replicate")
    rows = F.conv2d(padded, weights.view(1, 1, -1, 1), stride=(stride, 1))
    return F.conv2d(rows, weights.view(1, 1, 1, -1), stride=(1, stride))[:, 0]


@cache
def oriented_filters() -> Tensor:
    """[16, h, w] filters of norm 1: edges in 8 directions over half a turn, then lines in 8 directions."""
    y, x = np.mgrid[-REACH : REACH + 1, -REACH : REACH + 1]
    filters = []
    for kind in ("edge", "line"):
        for direction in range(DIRECTIONS):
            angle = np.pi * direction / DIRECTIONS
            across = np.cos(angle) * x + np.sin(angle) * y
            along = -np.sin(angle) * x + np.cos(angle) * y
            # Twice as long as wide, to separate neighboring directions.
            gaussian = np.exp(-0.5 * (across**2 / SIGMA**2 + along**2 / (2 * SIGMA) ** 2))
            derivative = across * gaussian if kind == "edge" else (across**2 / SIGMA**2 - 1) * gaussian
            derivative -= derivative.mean()
            filters.append(derivative / np.linalg.norm(derivative))
    return torch.tensor(np.array(filters), dtype=torch.float32)
