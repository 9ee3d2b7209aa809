"""Boxes thin out toward the border of the picture."""

from dataclasses import replace

import numpy as np

from brushgs.rendering.border import WIDTH, thin_to_border
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.rendering.strokes import boxes_of

CAMERA = Camera.look_at((0, 0, -5), (0, 0, 0), width=400, height=300)


def boxes_at(x: float, y: float, n: int = 4000, dtype=np.float64):
    return boxes_of(np.full((n, 2), (x, y)), 5.0, depths=np.ones(n), opacities=0.8, dtype=dtype)


def test_inside_nothing_changes_and_far_outside_nothing_is_left():
    border = WIDTH * 300
    for place in ((200, 150), (border, 150), (400 - border, 150), (200, border), (200, 300 - border)):
        boxes = boxes_at(*place)
        np.testing.assert_array_equal(thin_to_border(boxes, CAMERA).opacities, boxes.opacities)
    for place in ((-0.36 * border, 150), (200, 300 + 0.36 * border), (-1e6, 150)):
        assert not thin_to_border(boxes_at(*place), CAMERA).opacities.any()


def test_while_a_box_moves_it_fades_without_a_jump():
    path = np.linspace(-20, 60, 801)  # pixels, 0.1 apart
    faded = np.array([thin_to_border(boxes_at(x, 150, 50), CAMERA).opacities for x in path])
    assert np.abs(np.diff(faded, axis=0)).max() <= 0.8 * 0.1 / (0.25 * WIDTH * 300) + 1e-12
    assert (np.ptp(faded, axis=0) > 0.79).all()


def test_which_boxes_are_left_belongs_to_their_rows():
    boxes = boxes_at(10, 150, 300)
    thinned = thin_to_border(boxes, CAMERA)
    some = boxes.take(np.s_[100:200])
    np.testing.assert_array_equal(thin_to_border(some, CAMERA).opacities, thinned.opacities[100:200])
    assert (thin_to_border(boxes, CAMERA, seed=1).opacities != thinned.opacities).any()
    large = replace(CAMERA, K=CAMERA.K * [[2, 1, 2], [1, 2, 2], [1, 1, 1]], width=800, height=600)
    doubled = replace(boxes, centers=2 * boxes.centers)
    np.testing.assert_allclose(thin_to_border(doubled, large).opacities, thinned.opacities)


@for_each("dtype", [np.float32, np.float64])
def test_only_opacities_change_and_the_dtype_stays(dtype):
    boxes = boxes_at(10, 150, 30, dtype)
    thinned = thin_to_border(boxes, CAMERA)
    assert thinned.opacities.dtype == dtype
    for name in ("centers", "half_extents", "angles", "depths", "colors", "ids"):
        assert getattr(thinned, name) is not None
        np.testing.assert_array_equal(getattr(thinned, name), getattr(boxes, name))
    assert len(thin_to_border(boxes.take(slice(0)), CAMERA)) == 0
