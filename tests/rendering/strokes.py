"""Boxes and stroke textures that the tests of the rasteriser share."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.brushes.texture import Tint
from brushgs.options.choices import Filter

# Stroke and filter of every path through the kernel.
PATHS: dict[str, tuple[str, Filter]] = {
    filter: ("image", filter) for filter in ("bilinear", "mip", "nearest")
}
PATHS |= {kind: (kind, "mip") for kind in ("gaussian", "ellipse")}
IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]


def boxes_of(
    centers, half_extents, *, angles=0.0, depths=None, colors=(1, 0.5, 0.25), opacities=1.0, dtype=np.float64
) -> bg.Boxes:
    """Boxes from columns of which single values serve all rows; nearest first in the order given."""
    centers = np.atleast_2d(np.asarray(centers, dtype))
    n = len(centers)
    depths = np.arange(1.0, n + 1) if depths is None else depths

    def column(value, *width):
        return np.broadcast_to(np.asarray(value, dtype), (n, *width)).copy()

    columns = column(half_extents, 2), column(angles), column(depths), column(colors, 3), column(opacities)
    return bg.Boxes(centers, *columns, np.arange(n, dtype=np.int32))


def random_boxes(n: int, width: int, height: int, *, seed=0, sizes=(0.3, 40.0), dtype=np.float64) -> bg.Boxes:
    """Boxes of all directions in and around a picture, of half extents between `sizes` pixels."""
    g = np.random.default_rng([seed, n])
    centers = g.uniform(-0.2, 1.2, (n, 2)) * (width, height)
    half_extents = np.exp(g.uniform(*np.log(sizes), (n, 2)))
    columns = {"angles": g.uniform(-np.pi, np.pi, n), "depths": np.sort(g.uniform(0.5, 9.0, n))}
    columns |= {"colors": g.uniform(0, 1, (n, 3)), "opacities": g.uniform(0, 1, n)}
    return boxes_of(centers, half_extents, **columns, dtype=dtype)


def softened(boxes: bg.Boxes, largest: float, *, seed: int = 0) -> bg.Boxes:
    """The boxes with softness of 0.2 to 1 times `largest`, world units."""
    share = np.random.default_rng([seed, len(boxes)]).uniform(0.2, 1, len(boxes))
    return replace(boxes, softness=(largest * share).astype(boxes.depths.dtype))


def ridges(height: int = 40, width: int = 96, *, seed: int = 0) -> bg.StrokeTexture:
    """`bristles` whose height is other noise."""
    relief = np.random.default_rng([seed, width, height]).uniform(0, 1, (height, width)).astype(np.float32)
    coverage = bristles(height, width, seed=seed).coverage / 255
    return bg.StrokeTexture.from_coverage(coverage, height=relief, name="ridges")


def bristles(height: int = 40, width: int = 96, *, seed: int = 0) -> bg.StrokeTexture:
    """Noise from texel to texel with bare and full places: the hardest image to sample."""
    g = np.random.default_rng([seed, height, width])
    coverage = np.clip(g.uniform(-0.3, 1.3, (height, width)), 0, 1)
    return bg.StrokeTexture.from_coverage(coverage, name="bristles")


def texture_of(kind: str) -> bg.StrokeTexture:
    return bristles() if kind == "image" else bg.StrokeTexture.open(kind)


def rainbow(rows: int = 12, columns: int = 30, seed: int = 0) -> bg.StrokeTexture:
    """A brush with smooth coverage and colors that differ much."""
    g = np.random.default_rng(seed)
    v, u = np.mgrid[:rows, :columns] / np.reshape((rows, columns), (2, 1, 1))
    coverage = np.rint(255 * np.clip(1.3 * np.sin(np.pi * u) * np.sin(np.pi * v), 0, 1)).astype(np.uint8)
    rgb = 0.5 + 0.5 * np.sin(6 * u[..., None] + 9 * v[..., None] + g.uniform(0, 6, 3))
    return replace(bg.StrokeTexture.from_coverage(coverage), tint=Tint.of(rgb, coverage))


CAMERA = bg.Camera.look_at((0.4, -1, -4), (0, 0, 0), width=60, height=40)


def scattered(g, n, *, spread, sizes, opacities, terms=1, shade=1.0, dtype=np.float64) -> bg.Gaussians:
    """Gaussians about the origin, of ranges of sizes and opacities, and harmonics of a deviation."""
    means, quats = spread * g.normal(size=(n, 3)), g.normal(size=(n, 4))
    scales, opacities = np.exp(g.uniform(*np.log(sizes), (n, 3))), g.uniform(*opacities, n)
    return bg.Gaussians(means, quats, scales, opacities, shade * g.normal(size=(n, terms, 3))).astype(dtype)


def scene_of(seed: int, n: int = 60, dtype=np.float64) -> bg.Gaussians:
    """Gaussians about the origin whose depths all differ by more than rounding."""
    g = np.random.default_rng(seed)
    return scattered(g, n, spread=0.8, sizes=(0.01, 0.5), opacities=(0.1, 1), dtype=dtype)
