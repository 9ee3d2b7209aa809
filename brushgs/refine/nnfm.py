"""Match features to a style image: by nearest neighbors (NNFM), or by Gram matrices.

The NNFM loss is the mean cosine distance from each feature of the picture to the nearest one of the style
image. The Gram loss is the squared distance of the matrices, for each group relative to the squared norm of
the style image's own; this replaces the constants of the paper, which depend on the sizes and scales of
layers. Losses are computed by tiles, and only gradients by pixels are kept, so that memory does not grow with
the picture (deferred back-propagation).
Sources: Zhang et al. 2022, ARF, eq. 1 and section 4.2 (NNFM); Gatys, Ecker and Bethge 2016, Image Style
Transfer Using Convolutional Neural Networks, eq. 3 to 5 (Gram matrices).
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

import torch
from torch import Tensor

TILE = 256  # pixels; a multiple of every stride
MAX_STYLE = 4096  # features of the style image; more are slower
POSITIONS_AT_A_TIME = 2048  # rows of the distance matrix in memory


class Features(Protocol):
    """A function from a picture [3, H, W] to groups of features [D, h, w] at regular positions."""

    @property
    def strides(self) -> tuple[int, ...]:
        """Pixels between positions, of each group; divisors of `TILE`."""
        ...

    @property
    def halo(self) -> int:
        """Pixels around a position on which its features depend."""
        ...

    def __call__(self, picture: Tensor) -> list[Tensor]:
        """The groups."""
        ...

    def content(self, groups: list[Tensor]) -> list[Tensor]:
        """The part of groups [D, n] that describes the content: [d, n] for each of the last groups."""
        ...


TileLoss = Callable[[list[Tensor], list[Tensor]], Tensor]
Tiles = Iterable[
    tuple[list[Tensor], list[Tensor]]
]  # features [D, n] of each group, and shares [n] of positions


class Style(Protocol):
    """A style image, and the loss of pictures to it.

    Attributes:
        features: how they are computed.
    """

    features: Features

    def loss(self, tiles: Callable[[], Tiles]) -> tuple[float, TileLoss]:
        """The loss of a picture: a constant plus a term per tile, the sum of which has its gradient.

        Args:
            tiles: iterates over all tiles of the picture, without gradients, if the loss needs a first pass.
        """
        ...


def _painted(features: Features, painting: Tensor, alpha: Tensor | None) -> Iterator[Tensor]:
    """Features [D, n] of each group where a style image is painted: alpha [H, W] above one half, or None."""
    for group, stride in zip(features(painting), features.strides, strict=True):
        found = group.flatten(1)
        if alpha is not None:
            is_painted = alpha[::stride, ::stride].flatten() > 0.5
            found = found[:, is_painted] if bool(is_painted.any()) else found
        yield found


class NearestStyle:
    """A style image as sets of unit features, for nearest neighbors.

    Args:
        features: how they are computed.
        painting: [3, H, W] RGB, 0 to 1.
        alpha: [H, W] of the style image: features are used where it is above one half; None for 1.
        seed: of the random choice if there are more than `MAX_STYLE` features.
    """

    def __init__(
        self, features: Features, painting: Tensor, alpha: Tensor | None = None, *, seed: int = 0
    ) -> None:
        self.features = features
        generator = torch.Generator().manual_seed(seed)
        self._sets = []
        with torch.no_grad():
            for found in _painted(features, painting, alpha):
                unit = _unit(found)
                if unit.shape[1] > MAX_STYLE:
                    unit = unit[:, torch.randperm(unit.shape[1], generator=generator)[:MAX_STYLE]]
                self._sets.append(unit.contiguous())

    def loss(self, tiles: Callable[[], Tiles]) -> tuple[float, TileLoss]:
        """See `Style`; no first pass is needed."""
        return 0.0, lambda groups, shares: _weighted_mean(self._distances(groups), shares)

    def _distances(self, groups: list[Tensor]) -> list[Tensor]:
        """Cosine distances of features to the nearest ones of the style, [n] for each group [D, n]."""
        distances = []
        for group, own in zip(groups, self._sets, strict=True):
            unit = _unit(group)
            with torch.no_grad():
                nearest = torch.cat(
                    [(some.T @ own).argmax(dim=1) for some in unit.detach().split(POSITIONS_AT_A_TIME, dim=1)]
                )
            distances.append(1 - (unit * own[:, nearest]).sum(dim=0))
        return distances


class GramStyle:
    """A style image as Gram matrices [D, D], the means over positions of products of two features.

    Args:
        features: how they are computed.
        painting: [3, H, W] RGB, 0 to 1.
        alpha: [H, W] of the style image: features are used where it is above one half; None for 1.
    """

    def __init__(self, features: Features, painting: Tensor, alpha: Tensor | None = None) -> None:
        self.features = features
        with torch.no_grad():
            self._grams = [(f @ f.T) / f.shape[1] for f in _painted(features, painting, alpha)]

    def loss(self, tiles: Callable[[], Tiles]) -> tuple[float, TileLoss]:
        """See `Style`: the matrices of the whole picture are needed for the gradient of each tile."""
        totals = [torch.zeros_like(gram) for gram in self._grams]
        for groups, shares in tiles():
            for total, group, share in zip(totals, groups, shares, strict=True):
                total += (group * share) @ group.T
        constant, slopes = 0.0, []
        for total, gram in zip(totals, self._grams, strict=True):
            scale = len(totals) * gram.square().sum().clamp_min(1e-12)
            slope = 2 * (total - gram) / scale
            constant += float((total - gram).square().sum() / scale - (slope * total).sum())
            slopes.append(slope)

        def of_tile(groups: list[Tensor], shares: list[Tensor]) -> Tensor:
            terms = zip(slopes, groups, shares, strict=True)
            return torch.stack(
                [((slope @ group) * group * share).sum() for slope, group, share in terms]
            ).sum()

        return constant, of_tile


def style_gradient(
    picture: Tensor,
    style: Style,
    content: Tensor | None,
    content_weight: float,
    counts: Tensor | None = None,
) -> tuple[float, float, Tensor]:
    """Style loss and content loss of a picture, and the gradient of style + weight x content by its pixels.

    Args:
        picture: [3, H, W] RGB, 0 to 1.
        style: features of the style image.
        content: [3, H, W] picture whose features should be kept; None for no content loss.
        content_weight: of the mean cosine distance to these.
        counts: [H, W] weight of each position, 0 to 1, not all 0, to exclude empty background; None for equal
            weights.

    Returns:
        The two losses, and the gradient [3, H, W]; zeros if torch's gradients are off.
    """
    features, gradient = style.features, torch.zeros_like(picture)
    counts = torch.ones(picture.shape[1:], dtype=picture.dtype) if counts is None else counts
    totals = [counts[::stride, ::stride].sum().clamp_min(1e-6) for stride in features.strides]
    tiles = list(_tiles(picture.shape[1:], features.halo))

    def features_inside(pixels: Tensor, inner: _Inner) -> list[Tensor]:
        groups = zip(features(pixels), features.strides, strict=True)
        return [_inside(group, stride, inner).flatten(1) for group, stride in groups]

    def shares_of(rows: slice, columns: slice, inner: _Inner) -> list[Tensor]:
        tile_counts = counts[None, rows, columns]
        return [
            _inside(tile_counts[:, ::stride, ::stride], stride, inner).flatten() / total
            for stride, total in zip(features.strides, totals, strict=True)
        ]

    def without_gradients() -> Tiles:
        for rows, columns, inner in tiles:
            with torch.no_grad():
                yield features_inside(picture[:, rows, columns], inner), shares_of(rows, columns, inner)

    style_loss, of_tile = style.loss(without_gradients)
    content_loss = 0.0
    for rows, columns, inner in tiles:
        shares = shares_of(rows, columns, inner)
        tile = picture[:, rows, columns].detach().requires_grad_()
        groups = features_inside(tile, inner)
        tile_style = of_tile(groups, shares)
        tile_content = torch.zeros(())
        if content is not None:
            with torch.no_grad():
                targets = features.content(features_inside(content[:, rows, columns], inner))
            own = features.content(groups)
            distances = [1 - (_unit(a) * _unit(b)).sum(dim=0) for a, b in zip(own, targets, strict=True)]
            tile_content = _weighted_mean(distances, shares[-len(distances) :])
        if torch.is_grad_enabled():
            (tile_style + content_weight * tile_content).backward()
            assert tile.grad is not None, "the tile is a leaf"
            gradient[:, rows, columns] += tile.grad
        style_loss += float(tile_style.detach())
        content_loss += float(tile_content.detach())
    return style_loss, content_loss, gradient


def _weighted_mean(distances: list[Tensor], shares: list[Tensor]) -> Tensor:
    """A tile's part of the mean over all positions, weighted by their shares; groups have equal weight."""
    return torch.stack([(d * s).sum() for d, s in zip(distances, shares, strict=True)]).mean()


_Inner = tuple[int, int, int, int]  # top, bottom, left and right of a tile in its halo


def _tiles(size: torch.Size, halo: int) -> Iterator[tuple[slice, slice, _Inner]]:
    """Rows and columns of each tile with its halo, and top, bottom, left and right of the tile in these."""
    height, width = size
    margin = -(-halo // 32) * 32  # a multiple of every stride, so that tiles and picture share positions
    for top in range(0, height, TILE):
        for left in range(0, width, TILE):
            bottom, right = min(top + TILE, height), min(left + TILE, width)
            rows = slice(max(top - margin, 0), min(bottom + margin, height))
            columns = slice(max(left - margin, 0), min(right + margin, width))
            yield (
                rows,
                columns,
                (top - rows.start, bottom - rows.start, left - columns.start, right - columns.start),
            )


def _inside(group: Tensor, stride: int, inner: _Inner) -> Tensor:
    """The positions of a group [D, h, w] that lie in the tile, not in its halo."""
    top, bottom, left, right = inner
    return group[:, top // stride : -(-bottom // stride), left // stride : -(-right // stride)]


def _unit(features: Tensor) -> Tensor:
    """Features [D, n] scaled to length 1."""
    return features / features.norm(dim=0, keepdim=True).clamp_min(1e-6)
