"""The yardstick of the gradients: rasterising in plain torch, tile by tile in batches, with autograd.

As straightforward torch code does it: every stroke of a batch is evaluated at every pixel of the tile, and
autograd keeps all of it.
"""

import torch
from torch import Tensor

from brushgs.rendering.constants import MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE

TILE = 32  # pixels; fastest of 16, 32 and 64
BATCH = 128  # strokes


def paint(columns: dict[str, Tensor], coverage: Tensor, *, width: int, height: int) -> tuple[Tensor, Tensor]:
    """Rgb [H, W, 3] premultiplied and alpha [H, W], filter "bilinear".

    Args:
        columns: those of `brushgs.Boxes` by name, nearest first.
        coverage: [h, w] 0 to 1.
        width: pixels.
        height: pixels.
    """
    centers, half = columns["centers"].detach(), columns["half_extents"].detach()
    cosine, sine = columns["angles"].detach().cos().abs(), columns["angles"].detach().sin().abs()
    reach_x, reach_y = cosine * half[:, 0] + sine * half[:, 1], sine * half[:, 0] + cosine * half[:, 1]
    rows = []
    for y0 in range(0, height, TILE):
        y1, tiles = min(y0 + TILE, height), []
        in_row = (centers[:, 1] + reach_y > y0) & (centers[:, 1] - reach_y < y1)
        for x0 in range(0, width, TILE):
            x1 = min(x0 + TILE, width)
            ids = (in_row & (centers[:, 0] + reach_x > x0) & (centers[:, 0] - reach_x < x1)).nonzero()[:, 0]
            y, x = torch.meshgrid(torch.arange(y0, y1) + 0.5, torch.arange(x0, x1) + 0.5, indexing="ij")
            tile = _paint_tile(columns, coverage, ids, x.reshape(-1), y.reshape(-1))
            tiles.append(tile.reshape(y1 - y0, x1 - x0, 4))
        rows.append(torch.cat(tiles, 1))
    picture = torch.cat(rows)
    return picture[..., :3], picture[..., 3]


def _paint_tile(columns: dict[str, Tensor], coverage: Tensor, ids: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """[pixels, 4] rgb and alpha."""
    rgb, light = torch.zeros(len(x), 3), torch.ones(len(x))
    for batch in ids.split(BATCH) if len(ids) else ():
        center, half, angle, color, opacity = (
            columns[name][batch] for name in ("centers", "half_extents", "angles", "colors", "opacities")
        )
        dx, dy = x - center[:, :1], y - center[:, 1:]
        cosine, sine = angle.cos()[:, None], angle.sin()[:, None]
        s, t = (cosine * dx + sine * dy) / half[:, :1], (cosine * dy - sine * dx) / half[:, 1:]
        alpha = (opacity[:, None] * _sample(coverage, s, t)).clamp(max=MAX_ALPHA)
        is_painted = (s.abs() < 1) & (t.abs() < 1) & (alpha >= MIN_ALPHA)
        alpha = torch.where(is_painted, alpha, 0)
        after = light * torch.cumprod(1 - alpha, 0)
        alpha = torch.where(after >= MIN_TRANSMITTANCE, alpha, 0)
        after = light * torch.cumprod(1 - alpha, 0)
        before = torch.cat([light[None], after[:-1]])
        rgb = rgb + (before * alpha).T @ color
        light = after[-1]
        if bool((light < MIN_TRANSMITTANCE / (1 - MAX_ALPHA)).all()):
            break
    return torch.cat([rgb, 1 - light[:, None]], 1)


def _sample(coverage: Tensor, s: Tensor, t: Tensor) -> Tensor:
    height, width = coverage.shape
    u, v = ((1 + s) / 2 * (width - 1)).clamp(0, width - 1), ((1 + t) / 2 * (height - 1)).clamp(0, height - 1)
    column, row = u.detach().long().clamp(max=width - 2), v.detach().long().clamp(max=height - 2)
    fu, fv, texels, first = u - column, v - row, coverage.reshape(-1), row * width + column
    upper = texels[first] * (1 - fu) + texels[first + 1] * fu
    lower = texels[first + width] * (1 - fu) + texels[first + width + 1] * fu
    return upper * (1 - fv) + lower * fv
