"""Coloured brushes: what the kernel paints is what the reference says, and so are its derivatives."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture, Tint
from brushgs.rendering import reference
from brushgs.rendering.backward import BOX_COLUMNS, rasterize_backward
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import Underpaint
from tests.differences import assert_same_gradient, central_differences
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.strokes import bristles, random_boxes, set_back, softened

SIZE = {"width": 75, "height": 41}


def rainbow(rows=12, columns=30, seed=0) -> StrokeTexture:
    """A brush with smooth coverage and colours that differ much."""
    g = np.random.default_rng(seed)
    v, u = np.mgrid[:rows, :columns] / np.reshape((rows, columns), (2, 1, 1))
    coverage = np.rint(255 * np.clip(1.3 * np.sin(np.pi * u) * np.sin(np.pi * v), 0, 1)).astype(np.uint8)
    phases = g.uniform(0, 6, 3)
    rgb = 0.5 + 0.5 * np.sin(6 * u[..., None] + 9 * v[..., None] + phases)
    return replace(StrokeTexture.from_coverage(coverage), tint=Tint.of(rgb, coverage))


def mixed_set() -> BrushSet:
    return BrushSet((rainbow(), bristles(), rainbow(7, 20, 3)))


def boxes_for(brushes: BrushSet, num=40, dtype=np.float64, **options):
    boxes = random_boxes(num, **SIZE, seed=5, sizes=(1, 25), dtype=dtype)
    rows = np.random.default_rng(1).integers(0, len(brushes), num).astype(np.uint8)
    return replace(boxes, brushes=rows if len(brushes) > 1 else None, **options)


ORDERS = {"hard": lambda boxes: boxes, "soft": lambda boxes: softened(boxes, 0.8)}


@for_each(
    ("order", "filter", "more"),
    pairs_of(ORDERS, ("mip", "bilinear", "nearest"), ("plain", "underpaint", "streaks", "relief")),
)
def test_the_kernel_paints_what_the_reference_says(order, filter, more):
    brushes = mixed_set()
    boxes = ORDERS[order](boxes_for(brushes))
    options = {"filter": filter}
    if more == "underpaint":
        boxes, options["underpaint"] = set_back(boxes, 1.0), Underpaint(0.7, 0.5)
    if more == "streaks":
        options["streaks"] = 0.3
    if more == "relief":
        reliefs = np.random.default_rng(2).uniform(0.5, 2, (len(boxes), 2))
        boxes, options["relief"] = replace(boxes, reliefs=reliefs), True
    actual = rasterize(boxes, brushes, **SIZE, **options)
    expected = reference.rasterize(boxes, brushes, **SIZE, **options)
    for name in ("rgb", "alpha", "depth", *(["height"] if more == "relief" else [])):
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=1e-9, atol=1e-10, err_msg=name
        )


@pytest.mark.parametrize("filter", ["bilinear", "mip", "nearest"])
def test_gradients_are_differences_of_the_definition(filter):
    small, brushes = {"width": 33, "height": 18}, mixed_set()
    boxes = random_boxes(12, **small, seed=4, sizes=(2, 14))
    boxes = replace(
        boxes, opacities=np.linspace(0.2, 1, 12), brushes=np.resize([0, 1, 2], 12).astype(np.uint8)
    )
    g = np.random.default_rng(9)
    v_rgb, v_alpha = g.normal(size=(18, 33, 3)), g.normal(size=(18, 33))
    frame = rasterize(boxes, brushes, filter=filter, **small)
    actual = rasterize_backward(boxes, brushes, frame, v_rgb, v_alpha, filter=filter)

    def loss(values, name):
        painted = reference.rasterize(replace(boxes, **{name: values}), brushes, filter=filter, **small)
        return float((painted.rgb * v_rgb).sum() + (painted.alpha * v_alpha).sum())

    for name in set(BOX_COLUMNS) - {"depths"}:
        numerical = central_differences(lambda values, name=name: loss(values, name), getattr(boxes, name))
        assert_same_gradient(f"{filter} {name}", getattr(actual, name), numerical)


def test_a_colour_that_is_nowhere_different_changes_no_bit():
    grey = bristles()
    coverage = grey.coverage
    even = replace(grey, tint=Tint.of(np.full((*coverage.shape, 3), 0.3), coverage))
    boxes = boxes_for(BrushSet((grey,)), dtype=np.float32)
    one, other = (rasterize(boxes, texture, **SIZE) for texture in (grey, even))
    np.testing.assert_allclose(one.rgb, other.rgb, atol=1e-6)
    np.testing.assert_array_equal(one.alpha, other.alpha)


def test_an_image_keeps_its_colours_where_that_is_asked_for():
    picture = np.ones((10, 30, 4), np.float32)
    picture[:5, :, :3], picture[5:, :, :3] = (1, 0, 0), (0, 0, 1)
    picture[:, :3, 3] = 0
    path_free = StrokeTexture.of(picture)
    assert path_free.tint is None
    assert not BrushSet((path_free,)).are_colored
    tinted = StrokeTexture._of_pixels(picture, None, "two", 256, colored=True)
    np.testing.assert_allclose(tinted.tint.mean, (0.5, 0, 0.5), atol=0.02)
    assert not BrushSet((tinted,)).without_colors().are_colored
