"""The projection in the vertex shader against `project`."""

import numpy as np

import brushgs as bg
from tests.kit.for_each import for_each
from tests.outlets.page.strokes import CAMERAS, hard_strokes
from tests.outlets.page.studio import painting_of

PIXELS = 1e-3


@for_each(("lock", "antialiased", "degree"), [("anchor", False, 3), ("anchor", True, 1), ("off", False, 0)])
def test_boxes_are_those_of_project(studio, lock, antialiased, degree):
    strokes = hard_strokes(600, degree=degree, antialiased=antialiased)
    painting = painting_of(strokes, bg.StrokeTexture.open("flat"), lock=lock)
    rows = studio.load(painting, CAMERAS[0]).rows[0]
    order = np.full(rows.max() + 1, -1)
    order[rows] = np.arange(len(rows))
    for camera in CAMERAS:
        found, (expected, _) = studio.boxes(camera), painting.coats[0].boxes(camera)
        assert set(rows[found[:, 7] == 1]) == set(expected.ids)
        found = found[order[expected.ids]]
        np.testing.assert_allclose(found[:, :2], expected.centers, rtol=0, atol=PIXELS)
        np.testing.assert_allclose(found[:, 2:4], expected.half_extents, rtol=0, atol=PIXELS)
        np.testing.assert_allclose(found[:, 5], expected.depths, rtol=1e-6)
        np.testing.assert_allclose(found[:, 6], expected.opacities, rtol=0, atol=1e-6)
        np.testing.assert_allclose(found[:, 8:11], expected.colors, rtol=0, atol=1e-6)
        along, across = expected.half_extents.T.astype(np.float64)
        reach = np.maximum(along, across)
        if lock == "off":  # what is nearly round has no direction: how far its rim moves
            reach = reach * (1 - (across / along) ** 2)
        turn = 2 * np.sin((found[:, 4] - expected.angles) / 2)  # 0 at a whole turn only
        assert np.abs(turn * reach).max() < PIXELS


def test_extreme_values_give_numbers(studio):
    scales = np.float32(
        [[1e-30, 1e-30, 1e-30], [1e30, 1, 1e-30], [1e19, 1e19, 1e19], [1e-20, 1e-3, 1e5], [0, 0, 0.1]]
    )
    count = 4 * len(scales)
    means = np.zeros((count, 3), np.float32)
    means[:, 2] = np.repeat([-3.999, -3.9, 0, 1e6], len(scales))
    quats = np.tile(np.float32([1, 0.3, -0.2, 0.5]), (count, 1))
    opacities, sh = np.full(count, 0.5, np.float32), np.zeros((count, 1, 3), np.float32)
    strokes = bg.Gaussians(means, quats, np.tile(scales, (4, 1)), opacities, sh)
    studio.load(painting_of(strokes, bg.StrokeTexture.open("flat"), fade=False), CAMERAS[0])
    boxes = studio.boxes(CAMERAS[0])
    assert np.isfinite(boxes).all()
    assert np.isfinite(studio.paint(CAMERAS[0])).all()
