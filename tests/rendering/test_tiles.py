"""Which tiles a box reaches: a missing tile shows as a hole of up to 32 x 16 pixels."""

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.rasterize import RasterOptions, rasterize
from tests.kit.for_each import for_each
from tests.rendering.paintings import relieved
from tests.rendering.strokes import boxes_of, random_boxes, ridges, softened

SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))
QUARTER = np.pi / 2


def num_wrong(boxes, width: int, height: int) -> int:
    """Pixels that are painted but should not be, or the reverse."""
    size = {"width": width, "height": height, "filter": "bilinear"}
    expected = reference.rasterize(boxes, SOLID, RasterOptions(**size)).alpha
    return np.count_nonzero((rasterize(boxes, SOLID, **size).alpha > 0) != (expected > 0))


@for_each("quarters", [-2, -1, 0, 1, 2, 3])
@for_each("lean", [0.0, 1e-17, 1e-13, -1e-13, 1e-9, -1e-9, 1e-7, -1e-6, 1e-5])
def test_boxes_that_lie_along_the_pixels_fill_all_their_tiles(quarters, lean):
    g = np.random.default_rng(1)
    for center, half in zip(g.uniform(20, 80, (15, 2)), g.uniform(10, 60, (15, 2)), strict=True):
        assert num_wrong(boxes_of([center], half, angles=quarters * QUARTER + lean), 130, 100) == 0


def test_the_outline_may_touch_the_rows_and_columns_of_tiles():
    for y in (16, 15.5, 16.5, 16 + 1e-9, 16.5 - 1e-9):
        for half in (16, 15.99, 16.01, 32):
            assert num_wrong(boxes_of([[48, y]], (40, half)), 130, 100) == 0


@pytest.mark.parametrize("length", [1e3, 1e5])
def test_needles_that_run_far_beyond_the_picture_have_no_gaps(length):
    """The outline is kept in float32: from some 1e6 px on, single pixels at its edge may be missing."""
    g = np.random.default_rng(2)
    for angle in g.uniform(-np.pi, np.pi, 30):
        along = np.array([np.cos(angle), np.sin(angle)])
        center = g.uniform(0, 1, 2) * (300, 200) - along * length * g.uniform(-0.99, 0.99)
        assert num_wrong(boxes_of([center], (length, 2), angles=angle), 300, 200) == 0


@pytest.mark.parametrize("is_soft", [False, True])
def test_tiles_that_no_stroke_reaches_are_empty_whatever_their_memory_held(is_soft):
    """The memory of a frame goes to the next one of its size; the picture's edge cuts off the last tiles."""
    size = {"width": 201, "height": 97}
    everywhere = relieved(random_boxes(500, **size, sizes=(20, 60)))
    few = relieved(boxes_of([[20, 20]], (5, 5)))
    if is_soft:
        everywhere, few = softened(everywhere, 0.2), softened(few, 0.2)
    before = rasterize(everywhere, ridges(), relief=True, **size)
    assert np.all(before.alpha > 0)
    del before
    frame = rasterize(few, ridges(), relief=True, **size)
    for plane in (frame.rgb, frame.alpha, frame.depth, frame.height):
        assert plane[:32, :32].any()
        assert not plane[32:].any()
        assert not plane[:, 32:].any()
