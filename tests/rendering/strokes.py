"""Boxes and stroke textures that the tests of the rasteriser share."""

from dataclasses import replace

import numpy as np

from brushgs.brushes.texture import StrokeTexture
from brushgs.options.choices import Filter
from brushgs.rendering.depth_test import DepthTest
from brushgs.values.boxes import Boxes

# Stroke and filter of every path through the kernel.
PATHS: dict[str, tuple[str, Filter]] = {
    "bilinear": ("image", "bilinear"),
    "mip": ("image", "mip"),
    "nearest": ("image", "nearest"),
    "gaussian": ("gaussian", "mip"),
    "ellipse": ("ellipse", "mip"),
}


def boxes_of(
    centers,
    half_extents,
    *,
    angles=0.0,
    depths=None,
    colors=(1.0, 0.5, 0.25),
    opacities=1.0,
    dtype=np.float64,
) -> Boxes:
    """Boxes from columns of which single values serve all rows; nearest first in the order given."""
    centers = np.atleast_2d(np.asarray(centers, dtype))
    n = len(centers)
    depths = np.arange(1.0, n + 1) if depths is None else depths

    def column(value, *width):
        return np.broadcast_to(np.asarray(value, dtype), (n, *width)).copy()

    return Boxes(
        centers,
        column(half_extents, 2),
        column(angles),
        column(depths),
        column(colors, 3),
        column(opacities),
        np.arange(n, dtype=np.int32),
    )


def random_boxes(
    n: int, width: int, height: int, *, seed: int = 0, sizes=(0.3, 40.0), dtype=np.float64
) -> Boxes:
    """Boxes of all directions in and around a picture, of half extents between `sizes` pixels."""
    g = np.random.default_rng([seed, n])
    centers = g.uniform(-0.2, 1.2, (n, 2)) * (width, height)
    half_extents = np.exp(g.uniform(*np.log(sizes), (n, 2)))
    return boxes_of(
        centers,
        half_extents,
        angles=g.uniform(-np.pi, np.pi, n),
        depths=np.sort(g.uniform(0.5, 9.0, n)),
        colors=g.uniform(0, 1, (n, 3)),
        opacities=g.uniform(0, 1, n),
        dtype=dtype,
    )


def softened(boxes: Boxes, largest: float, *, seed: int = 0) -> Boxes:
    """The boxes with softness of 0.2 to 1 times `largest`, world units."""
    share = np.random.default_rng([seed, len(boxes)]).uniform(0.2, 1, len(boxes))
    return replace(boxes, softness=(largest * share).astype(boxes.depths.dtype))


def depth_test_of(boxes: Boxes, width: int, height: int, *, seed: int = 0) -> DepthTest:
    """A limit that differs from pixel to pixel, with a part that has none, and tolerances of 0.2 to 2."""
    g = np.random.default_rng([seed, len(boxes)])
    limit = g.uniform(1.0, 7.0, (height, width))
    limit[: height // 4, width // 2 :] = np.inf
    return DepthTest(limit, g.uniform(0.2, 2.0, len(boxes)))


def set_back(boxes: Boxes, largest: float, *, seed: int = 0) -> Boxes:
    """The boxes with setbacks up to `largest`, world units; one in five is 0."""
    g = np.random.default_rng([seed, len(boxes)])
    setbacks = largest * g.uniform(0, 1, len(boxes)) * (g.random(len(boxes)) < 0.8)
    return replace(boxes, setbacks=setbacks.astype(boxes.depths.dtype))


def relieved(boxes: Boxes, *, seed: int = 0) -> Boxes:
    """The boxes with paint up to 1 pixel thick and a gain of up to 4."""
    g = np.random.default_rng([seed, len(boxes)])
    return replace(boxes, reliefs=g.uniform(0, (1, 4), (len(boxes), 2)).astype(boxes.depths.dtype))


def ridges(height: int = 40, width: int = 96, *, seed: int = 0) -> StrokeTexture:
    """`bristles` whose height is other noise."""
    relief = np.random.default_rng([seed, width, height]).uniform(0, 1, (height, width)).astype(np.float32)
    coverage = bristles(height, width, seed=seed).coverage / 255
    return StrokeTexture.from_coverage(coverage, height=relief, name="ridges")


def bristles(height: int = 40, width: int = 96, *, seed: int = 0) -> StrokeTexture:
    """Noise from texel to texel with bare and full places: the hardest image to sample."""
    g = np.random.default_rng([seed, height, width])
    coverage = np.clip(g.uniform(-0.3, 1.3, (height, width)), 0, 1)
    return StrokeTexture.from_coverage(coverage, name="bristles")


def texture_of(kind: str) -> StrokeTexture:
    return bristles() if kind == "image" else StrokeTexture.open(kind)
