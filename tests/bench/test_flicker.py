"""The painters of the flicker studies paint what the rasteriser paints."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import brushgs as bg
from tests.bench.flicker import Canvas, paint, turned
from tests.bench.order import fade, fragments, num_swaps

CAMERA = bg.Camera.look_at((0, 0, -4), (0, 0, 0), width=48, height=40)
TEXTURE = bg.StrokeTexture.open("dry_brush")


def some_boxes(num=60, seed=2):
    rng = np.random.default_rng(seed)
    return bg.Boxes(
        rng.uniform((0, 0), (48, 40), (num, 2)),
        rng.uniform((3, 2), (12, 6), (num, 2)),
        rng.uniform(-np.pi, np.pi, num),
        np.sort(rng.uniform(1, 2, num)),
        rng.uniform(0, 1, (num, 3)),
        rng.uniform(0.1, 0.6, num),
        rng.permutation(num).astype(np.int32),
    )


def places():
    return np.stack(np.meshgrid(np.arange(48), np.arange(40)), axis=-1) + 0.5


@pytest.mark.parametrize("filter", ["bilinear", "mip"])
def test_a_painting_without_pixels_is_that_of_the_kernel_at_pixel_centres(filter):
    boxes = some_boxes()
    picture, _ = Canvas(places(), TEXTURE, filter).paint(boxes)
    # The kernel samples coverage in 8 bits: 0.0005 measured.
    np.testing.assert_allclose(picture, paint(boxes, TEXTURE, CAMERA, filter), atol=2e-3)


def test_boxes_that_only_moved_slide_by_as_much_as_they_moved():
    boxes = some_boxes()
    after = replace(boxes, centers=boxes.centers + np.array([0.75, 0.0]))
    _, slides = Canvas(places(), TEXTURE, "mip").paint(boxes, after, np.full((40, 48), 1.5))
    np.testing.assert_allclose(np.hypot(*slides.slides.T), 0.75, atol=1e-9)
    np.testing.assert_allclose(slides.wholes, slides.slides, atol=1e-9)


def test_a_fade_over_no_band_is_the_order_by_depth():
    boxes = some_boxes()
    picture = fade(boxes, fragments(boxes, TEXTURE, CAMERA), np.full(60, 1e-12), CAMERA)
    np.testing.assert_allclose(picture, paint(boxes, TEXTURE, CAMERA), atol=2e-3)


def test_fading_fragments_are_what_the_kernel_paints():
    boxes = some_boxes(12, 3)
    softness = np.full(12, 0.1)
    picture = fade(boxes, fragments(boxes, TEXTURE, CAMERA), softness, CAMERA)
    painted = paint(replace(boxes, softness=softness), TEXTURE, CAMERA)
    np.testing.assert_allclose(picture, painted, atol=2e-3)
    assert np.abs(painted - paint(boxes, TEXTURE, CAMERA)).max() > 0.01


def test_two_strokes_at_one_depth_show_the_mean_of_both_orders_and_fade_without_a_jump():
    pair = replace(
        some_boxes(2, 5),
        centers=np.array([[24.0, 20], [26, 21]]),
        half_extents=np.full((2, 2), 9.0),
        colors=np.array([[0.0, 0, 0], [1, 1, 1]]),
        opacities=np.full(2, 0.7),
        ids=np.array([0, 1], np.int32),
    )

    def picture(step, softness=0.1):
        order = [0, 1] if step >= 0 else [1, 0]
        boxes = replace(pair, depths=np.ones(2)).take(order)
        boxes = replace(boxes, depths=np.array([1.0, 1.0 + abs(step)]))
        return fade(boxes, fragments(boxes, TEXTURE, CAMERA), np.full(2, softness), CAMERA)

    one, other = picture(1.0), picture(-1.0)
    assert np.abs(one - other).max() > 0.1
    np.testing.assert_allclose(picture(0.0), (one + other) / 2, atol=1e-12)
    steps = [picture(step) for step in np.linspace(-0.2, 0.2, 41)]
    largest = max(np.abs(b - a).max() for a, b in pairwise(steps))
    assert largest < 0.1 * np.abs(one - other).max()


def test_only_swaps_of_overlapping_boxes_count():
    boxes = some_boxes(3)
    boxes = replace(
        boxes, centers=np.array([[10.0, 20], [14, 20], [44, 20]]), ids=np.arange(3, dtype=np.int32)
    )
    boxes = replace(boxes, half_extents=np.full((3, 2), 4.0))

    def sorted_as(order):
        return replace(replace(boxes, depths=np.ones(3)).take(order), depths=boxes.depths)

    assert num_swaps(boxes, sorted_as([1, 0, 2])) == pytest.approx(1 / 3)
    assert num_swaps(boxes, sorted_as([0, 2, 1])) == 0


def test_a_camera_turned_about_an_axis_keeps_its_distance_and_what_it_looks_at():
    there = turned(CAMERA, np.array([0.0, -1, 0]), np.zeros(3), 0.4)
    assert np.linalg.norm(there.position) == pytest.approx(4)
    np.testing.assert_allclose(there.viewmat @ [0, 0, 0, 1], [0, 0, 4, 1], atol=1e-12)
    assert there.position[0] != pytest.approx(0)
