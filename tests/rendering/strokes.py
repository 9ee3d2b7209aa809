"""Boxes, stroke textures and paintings that the tests of the rasteriser share."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture, Tint
from brushgs.options.choices import Filter
from brushgs.rendering import reference
from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.rasterize import RasterOptions, rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians

# Stroke and filter of every path through the kernel.
PATHS: dict[str, tuple[str, Filter]] = {
    "bilinear": ("image", "bilinear"),
    "mip": ("image", "mip"),
    "nearest": ("image", "nearest"),
    "gaussian": ("gaussian", "mip"),
    "ellipse": ("ellipse", "mip"),
}
IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]
PLANES = ("rgb", "alpha", "depth", "height")
SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))
UNDERPAINT = Underpaint(1.8)
# Options of `rasterize` by words; what each needs of boxes and brushes, `painting_of` gives them.
LOOKS: dict[str, dict[str, Any]] = {
    "plain": {},
    "underpainted": {"underpaint": UNDERPAINT},
    "streaked": {"streaks": 0.3},
    "layered": {"underpaint": UNDERPAINT, "streaks": 0.3},
    "raised": {"relief": True},
    "raised layered": {"underpaint": UNDERPAINT, "streaks": 0.3, "relief": True},
    "glazed": {"blend": "glaze"},
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


def rainbow(rows: int = 12, columns: int = 30, seed: int = 0) -> StrokeTexture:
    """A brush with smooth coverage and colors that differ much."""
    g = np.random.default_rng(seed)
    v, u = np.mgrid[:rows, :columns] / np.reshape((rows, columns), (2, 1, 1))
    coverage = np.rint(255 * np.clip(1.3 * np.sin(np.pi * u) * np.sin(np.pi * v), 0, 1)).astype(np.uint8)
    rgb = 0.5 + 0.5 * np.sin(6 * u[..., None] + 9 * v[..., None] + g.uniform(0, 6, 3))
    return replace(StrokeTexture.from_coverage(coverage), tint=Tint.of(rgb, coverage))


BRUSHES: dict[str, StrokeTexture | BrushSet] = {  # of stroke images
    "bristles": bristles(),
    "ridges": ridges(),
    "tinted": BrushSet((rainbow(), bristles(), rainbow(7, 20, 3))),
    "three": BrushSet(  # of different sizes: a lacy one, a full one, and one of a single column
        (
            bristles(),
            StrokeTexture.from_coverage(np.linspace(0.6, 1, 17 * 200).reshape(17, 200)),
            StrokeTexture.from_coverage(np.full((9, 1), 0.95)),
        )
    ),
}


def with_brushes(boxes: Boxes, *, seed: int = 0, count: int = 3) -> Boxes:
    """The boxes (or Gaussians), each with one of so many brushes."""
    brushes = np.random.default_rng([seed, len(boxes)]).integers(0, count, len(boxes))
    return replace(boxes, brushes=brushes.astype(np.uint8))


class Painting(NamedTuple):
    """What `rasterize` is asked for."""

    boxes: Boxes
    brush: StrokeTexture | BrushSet
    options: dict[str, Any]

    def frame(self, **options: Any) -> Frame:
        return rasterize(self.boxes, self.brush, **self.options | options)

    def defined(self, **options: Any) -> Frame:
        return reference.rasterize(self.boxes, self.brush, RasterOptions(**self.options | options))


def painting_of(
    words: str, num: int, width: int, height: int, *, seed: int = 6, sizes=(0.3, 15), dtype=np.float64
) -> Painting:
    """A painting by words: one of `PATHS`, and of `LOOKS`, `BRUSHES`, "soft=0.2", "stop=0.1" and "cut"."""
    named = words.split()
    values = {name: float(value) for name, _, value in (w.partition("=") for w in named) if value}
    path = next(name for name in PATHS if name in named)
    look = " ".join(word for word in named if word in ("raised", *LOOKS)) or "plain"
    kind, filter = PATHS[path]
    boxes = set_back(random_boxes(num, width, height, seed=seed, sizes=sizes, dtype=dtype), 0.5)
    boxes = softened(boxes, values["soft"]) if "soft" in values else boxes
    boxes = relieved(boxes) if "raised" in look else boxes
    brush = texture_of(kind)
    if kind == "image":
        brush = BRUSHES[next((word for word in named if word in BRUSHES), "bristles")]
        boxes = with_brushes(boxes) if isinstance(brush, BrushSet) else boxes
    options = {"width": width, "height": height, "filter": filter, **LOOKS[look]}
    if "cut" in named:
        options["in_front_of"] = depth_test_of(boxes, width, height)
    if "stop" in values:
        options["min_transmittance"] = values["stop"]
    return Painting(boxes, brush, options)


CAMERA = Camera.look_at((0.4, -1, -4), (0, 0, 0), width=60, height=40)


def scene_of(seed: int, n: int = 60, dtype=np.float64) -> Gaussians:
    """Gaussians about the origin whose depths all differ by more than rounding."""
    g = np.random.default_rng(seed)
    return Gaussians(
        g.normal(size=(n, 3)) * 0.8,
        g.normal(size=(n, 4)),
        np.exp(g.uniform(np.log(0.01), np.log(0.5), (n, 3))),
        g.uniform(0.1, 1, n),
        g.normal(size=(n, 1, 3)),
    ).astype(dtype)


def assert_same(actual: Frame, expected: Frame, rtol: float = 1e-9, atol: float = 1e-11) -> None:
    """Equal to rounding of float64. Measured worst: 4e-12 relative to 1."""
    for name in PLANES:
        one, other = getattr(actual, name), getattr(expected, name)
        assert (one is None) == (other is None), name
        if one is not None:
            np.testing.assert_allclose(one, other, rtol=rtol, atol=atol, err_msg=name)


def assert_identical(actual: Frame, expected: Frame) -> None:
    for name in PLANES:
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)
