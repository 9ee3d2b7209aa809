"""The depth test: boxes fade out behind a limit that each pixel sets."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering import reference
from brushgs.rendering.depth_test import SIZES, DepthTest
from brushgs.rendering.project import project
from brushgs.rendering.rasterize import rasterize
from brushgs.rendering.render import render
from brushgs.rendering.underpaint import Underpaint
from brushgs.values.boxes import Boxes
from brushgs.values.frame import Frame
from tests.kit.for_each import for_each
from tests.pairs import pairs_of
from tests.rendering.strokes import (
    PATHS,
    boxes_of,
    depth_test_of,
    random_boxes,
    set_back,
    softened,
    texture_of,
)
from tests.rendering.test_soft import CAMERA, scene_of

SOLID = StrokeTexture.from_coverage(np.ones((2, 2)))
SIZE = {"width": 41, "height": 23}
LOOKS = {
    "": {},
    "streaked": {"streaks": 0.3},
    "layered": {"underpaint": Underpaint(1.8), "streaks": 0.3},
    "glazed": {"blend": "glaze"},
}


def painted(boxes: Boxes, path: str, test: DepthTest | None, **options) -> tuple[Frame, Frame]:
    """What the kernel paints, and what it should."""
    kind, filter = PATHS[path]
    how = {"filter": filter, "in_front_of": test} | SIZE | options
    return rasterize(boxes, texture_of(kind), **how), reference.rasterize(boxes, texture_of(kind), **how)


def assert_same(actual: Frame, expected: Frame, rtol: float = 1e-9, atol: float = 1e-11) -> None:
    for name in ("rgb", "alpha", "depth"):
        if getattr(expected, name) is None:
            assert getattr(actual, name) is None
            continue
        np.testing.assert_allclose(
            getattr(actual, name), getattr(expected, name), rtol=rtol, atol=atol, err_msg=name
        )


@for_each(("path", "softness", "look"), pairs_of(PATHS, (None, 0.02, 0.5), LOOKS))
def test_kernel_agrees_with_the_definition_in_float64(path, softness, look):
    boxes = set_back(random_boxes(150, **SIZE, sizes=(0.3, 40)), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    actual, expected = painted(boxes, path, depth_test_of(boxes, **SIZE), **LOOKS[look])
    assert_same(actual, expected)
    assert not np.allclose(actual.alpha, painted(boxes, path, None, **LOOKS[look])[0].alpha)


@for_each("softness", [None, 0.5])
@for_each("path", PATHS)
def test_kernel_agrees_with_the_definition_in_float32(path, softness):
    boxes = random_boxes(150, **SIZE)
    boxes = boxes if softness is None else softened(boxes, softness)
    test = depth_test_of(boxes, **SIZE)
    actual = painted(boxes.astype(np.float32), path, test)[0]
    expected = painted(boxes, path, test)[1]
    is_off = np.abs(actual.rgb - expected.rgb).max(axis=2) > 1e-5 + 1e-4 * expected.rgb.max(axis=2)
    assert is_off.mean() <= 0.005  # pixel centres on an edge, and alphas of 1/255
    assert np.abs(actual.rgb - expected.rgb).mean() < 1e-4


@for_each("look", LOOKS)
@for_each("softness", [None, 0.5])
def test_a_limit_behind_all_boxes_changes_no_bit(softness, look):
    boxes = set_back(random_boxes(150, **SIZE), 1.0)
    boxes = boxes if softness is None else softened(boxes, softness)
    texture, how = texture_of("image"), {"filter": "mip"} | SIZE | LOOKS[look]
    plain = rasterize(boxes, texture, **how)
    for limit in (np.inf, 10.0):
        far = DepthTest(np.full((23, 41), limit), np.full(150, 0.5))
        assert_same(rasterize(boxes, texture, in_front_of=far, **how), plain, rtol=0, atol=0)


def test_a_box_fades_over_the_outer_half_of_its_tolerance():
    limits = np.array([[2.0, 2.99, 3.0, 3.25, 3.5, 4.0, np.inf]])  # gone at 3, whole from 3.5 on
    box = boxes_of([(3.5, 0.5)], 100.0, depths=[4.0], opacities=0.5)
    frame = rasterize(box, SOLID, width=7, height=1, in_front_of=DepthTest(limits, np.ones(1)))
    shares = np.array([0, 0, 0, 0.5, 1, 1, 1])
    np.testing.assert_allclose(frame.alpha[0], 0.5 * shares, rtol=1e-12)


def test_a_box_that_is_not_seen_hides_nothing():
    boxes = boxes_of([(4, 4)] * 3, 100.0, depths=[1.0, 2.0, 3.0], colors=np.eye(3))
    limit = np.full((8, 8), 2.5)
    for soft in (boxes, softened(boxes, 1e-3)):
        frame = rasterize(
            soft, SOLID, width=8, height=8, in_front_of=DepthTest(limit, np.array([9, 9, 1e-3]))
        )
        without = rasterize(soft.take(slice(2)), SOLID, width=8, height=8)
        assert_same(frame, without, rtol=1e-12)


def test_that_of_a_picture_takes_its_depth_and_the_sizes_of_strokes():
    scene = scene_of(40)
    plain = render(scene, CAMERA, "gaussian")
    boxes = project(scene, CAMERA)
    test = DepthTest.by_picture(plain, boxes, scene)
    is_solid = plain.alpha > 0.15
    np.testing.assert_array_equal(test.limit[is_solid], plain.depth[is_solid])
    assert np.isinf(test.limit[~is_solid]).all()
    sizes = np.sqrt(np.sort(scene.scales, axis=1)[:, 1:].prod(axis=1))
    np.testing.assert_allclose(test.tolerance, SIZES * sizes[boxes.ids], rtol=1e-5)
    twice = DepthTest.by_picture(plain, boxes, scene, sizes=2 * SIZES)
    np.testing.assert_allclose(twice.tolerance, 2 * test.tolerance)
    with pytest.raises(ValueError, match="must have a depth"):
        DepthTest.by_picture(replace(plain, depth=None), boxes, scene)


def test_what_is_no_depth_test_of_these_boxes_is_refused():
    with pytest.raises(TypeError, match="limit must be a NumPy array"):
        DepthTest([[1.0]], np.ones(1))
    with pytest.raises(ValueError, match="limit must not be NaN"):
        DepthTest(np.array([[1.0, np.nan]]), np.ones(1))
    for bad in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="tolerance must be finite and >= 0"):
            DepthTest(np.ones((1, 1)), np.array([bad]))
    boxes = random_boxes(3, 8, 8)
    with pytest.raises(ValueError, match=r"limit of in_front_of must have shape \[8, 8\], got \[8, 7\]"):
        rasterize(boxes, SOLID, width=8, height=8, in_front_of=DepthTest(np.ones((8, 7)), np.ones(3)))
    with pytest.raises(ValueError, match=r"tolerance of in_front_of must have shape \[3\], got \[2\]"):
        rasterize(boxes, SOLID, width=8, height=8, in_front_of=DepthTest(np.ones((8, 8)), np.ones(2)))
    with pytest.raises(TypeError, match="in_front_of must be None or DepthTest, got float"):
        rasterize(boxes, SOLID, width=8, height=8, in_front_of=1.0)
