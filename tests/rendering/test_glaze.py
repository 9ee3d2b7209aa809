"""Glazes: transparent paint, and the product of what its boxes let through."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from tests.kit.for_each import for_each
from tests.rendering.strokes import PATHS, boxes_of, random_boxes, set_back, texture_of

SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))


def glazed(boxes: Boxes, path: str, width: int, height: int):
    """What the kernel paints, and what it should."""
    kind, filter = PATHS[path]
    how = {"width": width, "height": height, "filter": filter, "blend": "glaze"}
    return rasterize(boxes, texture_of(kind), **how), reference.rasterize(boxes, texture_of(kind), **how)


def shuffled(boxes: Boxes, seed: int = 0) -> Boxes:
    """The boxes in another order: at other depths."""
    rows = np.random.default_rng(seed).permutation(len(boxes))
    columns = {name: getattr(boxes, name)[rows] for name in ("centers", "half_extents", "angles", "colors")}
    return replace(boxes, opacities=boxes.opacities[rows], ids=boxes.ids[rows], **columns)


@for_each(("width", "height"), [(1, 1), (41, 23)])
@for_each("path", PATHS)
def test_kernel_agrees_with_the_definition_in_float64(path, width, height):
    actual, expected = glazed(random_boxes(150, width, height), path, width, height)
    np.testing.assert_allclose(actual.rgb, expected.rgb, rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(actual.alpha, expected.alpha, rtol=1e-9, atol=1e-11)
    assert np.ptp(expected.rgb) > 0 or width == 1


@for_each("path", PATHS)
def test_kernel_agrees_with_the_definition_in_float32(path):
    boxes = random_boxes(150, 41, 23)
    actual, expected = glazed(boxes.astype(np.float32), path, 41, 23)[0], glazed(boxes, path, 41, 23)[1]
    assert actual.rgb.dtype == actual.alpha.dtype == np.float32
    is_off = np.abs(actual.rgb - expected.rgb).max(axis=2) > 1e-5 + 1e-4 * expected.rgb.max(axis=2)
    assert is_off.mean() <= 0.005  # pixel centres on an edge
    assert np.abs(actual.rgb - expected.rgb).mean() < 1e-4


def test_a_glaze_lets_its_colour_to_the_power_of_alpha_through():
    colors = [(0.5, 0.25, 1.0), (0.9, 0.5, 0.125)]
    boxes = boxes_of([(4, 4), (4, 4)], 100.0, colors=colors, opacities=[0.5, 0.25])
    frame = rasterize(boxes, SOLID, width=8, height=8, blend="glaze")
    tint = np.power(colors[0], 0.5) * np.power(colors[1], 0.25)
    np.testing.assert_allclose(frame.rgb, np.broadcast_to(tint, (8, 8, 3)), rtol=1e-12)
    np.testing.assert_allclose(frame.alpha, 1 - 0.5 * 0.75, rtol=1e-12)
    assert frame.depth is None


def test_where_nothing_is_painted_a_glaze_leaves_all_light():
    boxes = boxes_of([(2, 2)], 1.0, colors=(0.2, 0.3, 0.4))
    frame = rasterize(boxes, SOLID, width=40, height=40, blend="glaze")
    assert (frame.rgb[10:] == 1).all()
    assert (frame.alpha[10:] == 0).all()
    empty = rasterize(boxes.take(slice(0)), SOLID, width=3, height=2, blend="glaze")
    assert (empty.rgb == 1).all()
    assert (empty.alpha == 0).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_very_many_dark_glazes_are_black_and_finite(dtype):
    boxes = boxes_of([(4, 4)] * 3000, 100.0, colors=(0.0, 0.4, 1.0), dtype=dtype)
    frame = rasterize(boxes, SOLID, width=8, height=8, blend="glaze")
    assert (frame.rgb[..., :2] == 0).all()
    assert (frame.rgb[..., 2] == 1).all()
    assert (frame.alpha == 1).all()


def test_alpha_is_that_of_paint_that_covers():
    boxes = random_boxes(60, 40, 30)
    covered = rasterize(boxes, "flat", width=40, height=30, min_transmittance=0)
    glaze = rasterize(boxes, "flat", width=40, height=30, blend="glaze")
    np.testing.assert_allclose(glaze.alpha, covered.alpha, rtol=1e-12, atol=1e-14)


def test_a_glaze_refuses_what_only_paint_that_covers_has():
    boxes = set_back(random_boxes(3, 8, 8), 1.0)
    how = {"width": 8, "height": 8, "blend": "glaze"}
    with pytest.raises(ValueError, match="a glaze has no underpaint"):
        rasterize(boxes, "flat", underpaint=Underpaint(1.5), **how)
    with pytest.raises(ValueError, match=r"a glaze has no streaks, got 0\.1"):
        rasterize(boxes, "flat", streaks=0.1, **how)
    with pytest.raises(ValueError, match="blend must be one of cover, glaze, got 'add'"):
        rasterize(boxes, "flat", width=8, height=8, blend="add")
