"""Paintings of such strokes by words, what fills them, and how two pictures are compared."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import brushgs as bg
from brushgs.rendering import reference
from brushgs.rendering.depth_test import DepthTest
from brushgs.rendering.rasterize import RasterOptions
from brushgs.rendering.underpaint import Underpaint
from tests.rendering.strokes import PATHS, bristles, rainbow, random_boxes, ridges, softened, texture_of

SOLID = bg.StrokeTexture.from_coverage(np.ones((2, 2)))
PLANES = ("rgb", "alpha", "depth", "height")
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


def filled(boxes: bg.Boxes, path: str, width: int, height: int) -> bg.Frame:
    """Boxes filled by the stroke and filter of a path."""
    kind, filter = PATHS[path]
    return bg.rasterize(boxes, texture_of(kind), width=width, height=height, filter=filter)


BRUSHES: dict[str, bg.StrokeTexture | bg.BrushSet] = {  # of stroke images
    "bristles": bristles(),
    "ridges": ridges(),
    "tinted": bg.BrushSet((rainbow(), bristles(), rainbow(7, 20, 3))),
    "three": bg.BrushSet(  # of different sizes: a lacy one, a full one, and one of a single column
        (
            bristles(),
            bg.StrokeTexture.from_coverage(np.linspace(0.6, 1, 17 * 200).reshape(17, 200)),
            bg.StrokeTexture.from_coverage(np.full((9, 1), 0.95)),
        )
    ),
}


def with_brushes(boxes: bg.Boxes, *, seed: int = 0, count: int = 3) -> bg.Boxes:
    """The boxes (or Gaussians), each with one of so many brushes."""
    brushes = np.random.default_rng([seed, len(boxes)]).integers(0, count, len(boxes))
    return replace(boxes, brushes=brushes.astype(np.uint8))


def depth_test_of(boxes: bg.Boxes, width: int, height: int, *, seed: int = 0) -> DepthTest:
    """A limit that differs from pixel to pixel, with a part that has none, and tolerances of 0.2 to 2."""
    g = np.random.default_rng([seed, len(boxes)])
    limit = g.uniform(1.0, 7.0, (height, width))
    limit[: height // 4, width // 2 :] = np.inf
    return DepthTest(limit, g.uniform(0.2, 2.0, len(boxes)))


def relieved(boxes: bg.Boxes, *, seed: int = 0) -> bg.Boxes:
    """The boxes with paint up to 1 pixel thick and a gain of up to 4."""
    g = np.random.default_rng([seed, len(boxes)])
    return replace(boxes, reliefs=g.uniform(0, (1, 4), (len(boxes), 2)).astype(boxes.depths.dtype))


def set_back(boxes: bg.Boxes, largest: float, *, seed: int = 0) -> bg.Boxes:
    """The boxes with setbacks up to `largest`, world units; one in five is 0."""
    g = np.random.default_rng([seed, len(boxes)])
    setbacks = largest * g.uniform(0, 1, len(boxes)) * (g.random(len(boxes)) < 0.8)
    return replace(boxes, setbacks=setbacks.astype(boxes.depths.dtype))


class Painting(NamedTuple):
    """What `rasterize` is asked for."""

    boxes: bg.Boxes
    brush: bg.StrokeTexture | bg.BrushSet
    options: dict[str, Any]

    def frame(self, **options: Any) -> bg.Frame:
        return bg.rasterize(self.boxes, self.brush, **self.options | options)

    def defined(self, **options: Any) -> bg.Frame:
        return reference.rasterize(self.boxes, self.brush, RasterOptions(**self.options | options))


def painting_of(words: str, num, width, height, *, seed=6, sizes=(0.3, 15), dtype=np.float64) -> Painting:
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
        boxes = with_brushes(boxes) if isinstance(brush, bg.BrushSet) else boxes
    options = {"width": width, "height": height, "filter": filter, **LOOKS[look]}
    if "cut" in named:
        options["in_front_of"] = depth_test_of(boxes, width, height)
    if "stop" in values:
        options["min_transmittance"] = values["stop"]
    return Painting(boxes, brush, options)


def assert_same(actual: bg.Frame, expected: bg.Frame, rtol: float = 1e-9, atol: float = 1e-11) -> None:
    """Equal to rounding of float64. Measured worst: 4e-12 relative to 1."""
    for name in PLANES:
        one, other = getattr(actual, name), getattr(expected, name)
        assert (one is None) == (other is None), name
        if one is not None:
            np.testing.assert_allclose(one, other, rtol=rtol, atol=atol, err_msg=name)


def assert_identical(actual: bg.Frame, expected: bg.Frame) -> None:
    for name in PLANES:
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name), err_msg=name)
