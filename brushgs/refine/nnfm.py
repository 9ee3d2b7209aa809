"""Nearest-neighbour feature matching: every spot of a painting should look like some spot of the style image.

The loss is the mean cosine distance from each feature to the nearest one of the style image. It is computed
tile by tile: the derivative by the picture is kept, the rest of the tile let go, so that memory does not grow
with the picture (deferred back-propagation).
Source: Zhang et al. 2022, ARF, eq. 1 and section 4.2.
"""

from collections.abc import Iterator
from typing import Protocol

import torch
from torch import Tensor

TILE = 256  # pixels; a multiple of every stride
MAX_STYLE = 4096  # features of the style image: more find nearer neighbours and take longer
BLOCK = 2048  # positions whose distances to all of these are in memory at once


class Features(Protocol):
    """What turns a picture [3, H, W] into groups of features [D, h, w] at even positions."""

    @property
    def strides(self) -> tuple[int, ...]:
        """Pixels between positions, of each group; divisors of `TILE`."""
        ...

    @property
    def halo(self) -> int:
        """Pixels that a position sees around it."""
        ...

    def __call__(self, picture: Tensor) -> list[Tensor]:
        """The groups."""
        ...

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """What of groups [D, n] tells the subject, one [d, n] for each of the last groups."""
        ...


class Style:
    """A style image as sets of unit features to be near to.

    Args:
        features: what they are.
        painting: [3, H, W] RGB, 0 to 1.
        there: [H, W] alpha of the painting: features are taken where it is above one half; None for 1.
        seed: of the choice where there are more than `MAX_STYLE`.
    """

    def __init__(
        self, features: Features, painting: Tensor, there: Tensor | None = None, *, seed: int = 0
    ) -> None:
        self.features = features
        generator = torch.Generator().manual_seed(seed)
        self._sets = []
        with torch.no_grad():
            for group, stride in zip(features(painting), features.strides, strict=True):
                unit = _unit(group.flatten(1))
                if there is not None:
                    shown = there[::stride, ::stride].flatten() > 0.5
                    unit = unit[:, shown] if bool(shown.any()) else unit
                if unit.shape[1] > MAX_STYLE:
                    unit = unit[:, torch.randperm(unit.shape[1], generator=generator)[:MAX_STYLE]]
                self._sets.append(unit.contiguous())

    def distances(self, groups: list[Tensor]) -> list[Tensor]:
        """Cosine distance of each feature to the nearest of the style, [n] for each group [D, n]."""
        found = []
        for group, own in zip(groups, self._sets, strict=True):
            unit = _unit(group)
            with torch.no_grad():
                nearest = torch.cat(
                    [(block.T @ own).argmax(dim=1) for block in unit.detach().split(BLOCK, dim=1)]
                )
            found.append(1 - (unit * own[:, nearest]).sum(dim=0))
        return found


def style_gradient(
    picture: Tensor,
    style: Style,
    content: Tensor | None,
    content_weight: float,
    counts: Tensor | None = None,
) -> tuple[float, float, Tensor]:
    """Style and content loss of a picture, and the derivative of style + weight x content by its pixels.

    Args:
        picture: [3, H, W] RGB, 0 to 1.
        style: what to be near to.
        content: [3, H, W] picture whose features should be kept where they are; None for none.
        content_weight: of the mean cosine distance to these.
        counts: [H, W] what a position there counts, 0 to 1, somewhere above 0; None for all alike. An empty
            ground is no mark of a brush, and can come near to no painting.

    Returns:
        The two losses, and [3, H, W]; zeros where torch's gradients are off.
    """
    features, gradient = style.features, torch.zeros_like(picture)
    counts = torch.ones(picture.shape[1:], dtype=picture.dtype) if counts is None else counts
    totals = [counts[::stride, ::stride].sum().clamp_min(1e-6) for stride in features.strides]
    near_total = kept_total = 0.0
    for rows, columns, inner in _tiles(picture.shape[1:], features.halo):

        def seen(pixels: Tensor, inner: tuple[int, int, int, int] = inner) -> list[Tensor]:
            groups = zip(features(pixels), features.strides, strict=True)
            return [_inside(group, stride, inner).flatten(1) for group, stride in groups]

        there = counts[None, rows, columns]
        shares = [
            _inside(there[:, ::stride, ::stride], stride, inner).flatten() / total
            for stride, total in zip(features.strides, totals, strict=True)
        ]
        tile = picture[:, rows, columns].detach().requires_grad_()
        groups = seen(tile)
        near = _mean(style.distances(groups), shares)
        kept = torch.zeros(())
        if content is not None:
            with torch.no_grad():
                wanted = features.content(seen(content[:, rows, columns]))
            own = features.content(groups)
            away = [1 - (_unit(a) * _unit(b)).sum(dim=0) for a, b in zip(own, wanted, strict=True)]
            kept = _mean(away, shares[-len(away) :])
        if torch.is_grad_enabled():
            (near + content_weight * kept).backward()
            assert tile.grad is not None, "the tile is a leaf"
            gradient[:, rows, columns] += tile.grad
        near_total += float(near.detach())
        kept_total += float(kept.detach())
    return near_total, kept_total, gradient


def _mean(distances: list[Tensor], shares: list[Tensor]) -> Tensor:
    """The part of some positions in the mean over all, weighed by their shares, groups counting alike."""
    return torch.stack([(d * s).sum() for d, s in zip(distances, shares, strict=True)]).mean()


def _tiles(size: torch.Size, halo: int) -> Iterator[tuple[slice, slice, tuple[int, int, int, int]]]:
    """Rows and columns of each tile with its halo, and its top, bottom, left and right in these."""
    height, width = size
    rim = -(-halo // 32) * 32  # a multiple of every stride, so that positions stay where they are
    for top in range(0, height, TILE):
        for left in range(0, width, TILE):
            bottom, right = min(top + TILE, height), min(left + TILE, width)
            rows = slice(max(top - rim, 0), min(bottom + rim, height))
            columns = slice(max(left - rim, 0), min(right + rim, width))
            yield (
                rows,
                columns,
                (top - rows.start, bottom - rows.start, left - columns.start, right - columns.start),
            )


def _inside(group: Tensor, stride: int, inner: tuple[int, int, int, int]) -> Tensor:
    top, bottom, left, right = inner
    return group[:, top // stride : -(-bottom // stride), left // stride : -(-right // stride)]


def _unit(features: Tensor) -> Tensor:
    """Features [D, n] of length one."""
    return features / features.norm(dim=0, keepdim=True).clamp_min(1e-6)
