"""`min_transmittance`: when a pixel is finished, for every kernel, order and precision."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.rendering import reference
from brushgs.rendering.rasterize import rasterize
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.rendering.strokes import PATHS, boxes_of, random_boxes, softened, texture_of

WIDTH, HEIGHT = 70, 40
SIZE = {"width": WIDTH, "height": HEIGHT}
STOPS = [0.0, 1e-6, 1e-3, 0.02, 0.3]
IMAGES = [path for path, (kind, _) in PATHS.items() if kind == "image"]
PLANES = ("rgb", "alpha", "depth")


def crowd(dtype=np.float64) -> Boxes:
    """So many strokes that most pixels get dark."""
    boxes = random_boxes(400, WIDTH, HEIGHT, seed=7, sizes=(6, 40), dtype=dtype)
    return replace(boxes, opacities=np.sqrt(boxes.opacities))


def assert_same(actual: Frame, expected: Frame, rtol: float = 1e-10, atol: float = 1e-11) -> None:
    """Equal to rounding of float64. Measured worst over all tests below: 2e-12."""
    for name in PLANES:
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=rtol, atol=atol, err_msg=name
        )


@for_each("stop", STOPS)
@for_each("path", PATHS)
def test_kernel_agrees_with_the_definition_wherever_pixels_are_finished(path, stop):
    kind, filter = PATHS[path]
    how = {"filter": filter, "min_transmittance": stop, **SIZE}
    expected = reference.rasterize(crowd(), texture_of(kind), **how)
    assert_same(rasterize(crowd(), texture_of(kind), **how), expected)
    assert expected.alpha.max() <= 1 - stop
    assert expected.alpha.max() > 0.5 * (1 - stop)


@for_each("stop", STOPS)
@for_each("path", IMAGES)
def test_kernel_agrees_with_the_definition_in_soft_order(path, stop):
    kind, filter = PATHS[path]
    how = {"filter": filter, "width": 41, "height": 23}  # the definition of this order is slow
    boxes = softened(crowd().take(slice(None, None, 2)), 0.5)
    expected = reference.rasterize(boxes, texture_of(kind), min_transmittance=stop, **how)
    assert_same(rasterize(boxes, texture_of(kind), min_transmittance=stop, **how), expected)
    assert np.isfinite(expected.depth).all()


@pytest.mark.parametrize("is_soft", [False, True])
def test_where_no_stroke_leaves_enough_light_nothing_is_painted(is_soft):
    boxes = boxes_of(np.full((3, 2), 8.0), 30, opacities=0.9, depths=[1.0, 1.1, 1.2])
    boxes = softened(boxes, 1.0) if is_soft else boxes
    solid, how = texture_of("ellipse"), {"width": 16, "height": 16, "min_transmittance": 0.5}
    if is_soft:
        solid = replace(solid, kind="image")
    for frame in (rasterize(boxes, solid, **how), reference.rasterize(boxes, solid, **how)):
        for name in PLANES:
            assert not getattr(frame, name).any(), name


def test_a_pile_without_a_stop_takes_all_strokes_of_a_pixel():
    """In float32 a hundred strokes of full paint leave a light of zero, not NaN."""
    boxes = boxes_of(np.full((100, 2), 8.0), 30, dtype=np.float32)
    frame = rasterize(boxes, texture_of("ellipse"), width=16, height=16, min_transmittance=0)
    np.testing.assert_allclose(frame.alpha, 1)
    np.testing.assert_allclose(frame.rgb[..., 0], 1, rtol=1e-6)
    np.testing.assert_allclose(frame.depth, sum(0.99 * (k + 1) * 0.01**k for k in range(9)), rtol=1e-6)
