"""Features of a picture that need no trained weights: colour, its spread, strength and direction of marks.

At three scales, an octave apart, every position gets 25 numbers: mean and standard deviation of each channel
around it; the energy of edges and of lines (derivatives of a Gaussian, turned; Freeman and Adelson 1991)
pooled around it, as the mean over 8 directions and, for each direction, how far it stands out from that mean
as a share of it; and a constant, so that a cosine sees how strong the others are. Direction is a share
because it is none of contrast: a faint hatching runs the same way as a bold one.
Each kind is scaled to a root mean square of its weight over the painting it is compared with.
"""

from functools import cache

import numpy as np
import torch
import torch.nn.functional as F  # noqa: N812
from torch import Tensor

from brushgs.colors import LUMINANCE

SCALES = (1, 2, 4)  # pixels of the picture to one of the scale
STRIDES = (4, 2, 2)  # pixels of the scale between positions
DIRECTIONS = 8
SIGMA, REACH = 1.2, 4  # of edges and lines, pixels of the scale
POOL, POOL_REACH = 2.0, 5  # of means and energies
HALO = 4 * (REACH + POOL_REACH)  # pixels of the picture that a position sees around it
CONSTANT = 0.5
FAINT = 0.01  # energy (root) under which a direction fades: a flat ground has none
# Root mean square of each kind after scaling: colour means, colour spreads, strengths, directions.
WEIGHTS = (2.0, 0.5, 0.5, 2.0)
_KINDS = (slice(0, 3), slice(3, 6), slice(6, 8), slice(8, 24))
_CHANNELS = 24
_CONTENT_SCALES = slice(1, 3)  # what tells the subject: its colours, not the marks in which they are laid


class FilterBank:
    """The features, scaled for one painting.

    Attributes:
        strides: pixels of the picture between positions, for each group.
        halo: pixels that a position sees around it.
    """

    strides = tuple(scale * stride for scale, stride in zip(SCALES, STRIDES, strict=True))
    halo = HALO

    def __init__(self, painting: Tensor) -> None:
        """Scale the features for a painting.

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
        """Features of a picture [3, H, W], at each scale [25, h, w]: positions start at the first pixel."""
        groups = []
        for scale, stride, factor in zip(SCALES, STRIDES, self._factors, strict=True):
            reduced = F.avg_pool2d(picture[None], scale, ceil_mode=True)[0] if scale > 1 else picture
            maps = factor * _scale_features(reduced, stride)
            groups.append(torch.cat([maps, torch.full_like(maps[:1], CONSTANT)]))
        return groups

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """What of the features [25, n] tells the subject: colours at the coarser scales."""
        return [torch.cat([group[_KINDS[0]], group[-1:]]) for group in groups[_CONTENT_SCALES]]


def _scale_features(picture: Tensor, stride: int) -> Tensor:
    """[24, h, w] of one scale, not scaled."""
    luminance = torch.einsum("chw,c->hw", picture, torch.tensor(LUMINANCE, dtype=picture.dtype))
    weights = _turned_filters().to(picture.dtype)
    padded = F.pad(luminance[None, None], (REACH,) * 4, mode="replicate")
    energy = F.conv2d(padded, weights)[0].square()
    pooled = _pool(torch.cat([picture, picture.square(), energy]), stride)
    mean = pooled[:3]
    spread = (pooled[3:6] - mean.square()).clamp_min(0).add(1e-5).sqrt()
    roots = pooled[6:].add(1e-8).sqrt().unflatten(0, (2, DIRECTIONS))
    strength = roots.mean(dim=1)
    directions = (roots - strength[:, None]) / (strength[:, None] + FAINT)
    return torch.cat([mean - 0.5, spread, strength, directions.flatten(0, 1)])


def _pool(maps: Tensor, stride: int) -> Tensor:
    """Blurred maps [C, H, W], every `stride`-th pixel."""
    away = torch.arange(-POOL_REACH, POOL_REACH + 1, dtype=maps.dtype)
    weights = torch.exp(-0.5 * (away / POOL) ** 2)
    weights = weights / weights.sum()
    padded = F.pad(maps[:, None], (POOL_REACH,) * 4, mode="replicate")
    rows = F.conv2d(padded, weights.view(1, 1, -1, 1), stride=(stride, 1))
    return F.conv2d(rows, weights.view(1, 1, 1, -1), stride=(1, stride))[:, 0]


@cache
def _turned_filters() -> Tensor:
    """[16, 1, h, w] edges in 8 directions, then lines in 8 directions, over half a turn, unit length each."""
    y, x = np.mgrid[-REACH : REACH + 1, -REACH : REACH + 1]
    filters = []
    for kind in ("edge", "line"):
        for direction in range(DIRECTIONS):
            angle = np.pi * direction / DIRECTIONS
            across = np.cos(angle) * x + np.sin(angle) * y
            along = -np.sin(angle) * x + np.cos(angle) * y
            # Twice as long as wide: such filters tell neighbouring directions apart.
            bell = np.exp(-0.5 * (across**2 / SIGMA**2 + along**2 / (2 * SIGMA) ** 2))
            bent = across * bell if kind == "edge" else (across**2 / SIGMA**2 - 1) * bell
            bent -= bent.mean()
            filters.append(bent / np.linalg.norm(bent))
    return torch.tensor(np.array(filters)[:, None], dtype=torch.float32)
