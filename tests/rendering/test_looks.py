"""Looks of paint beside the definition: underpaint, streaks, glazes, colored brushes, the depth test."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.brushes.texture import Tint
from brushgs.rendering.constants import GAUSSIAN_SIGMAS
from brushgs.rendering.depth_test import SIZES, DepthTest
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.project import project_by
from brushgs.rendering.streaks import streak_slopes, streak_weights
from brushgs.rendering.underpaint import OPACITY, SIZE, STROKE_REACH, Underpaint
from tests.kit.for_each import for_each
from tests.rendering.paintings import BRUSHES, SOLID, assert_identical, assert_same, painting_of, with_brushes
from tests.rendering.strokes import CAMERA, boxes_of, bristles, scene_of, softened, texture_of

# Underpaint


def test_options_draw_strokes_over_underpaint_smaller_and_underpaint_by_the_gaussian():
    texture = bg.StrokeTexture.open("flat")
    plain, over = RenderOptions.of(texture), RenderOptions.of(texture, underpaint=True)
    assert plain.underpaint is None
    assert over.num_sigmas == pytest.approx(STROKE_REACH * plain.num_sigmas)
    assert over.underpaint.reach * over.num_sigmas == pytest.approx(SIZE * GAUSSIAN_SIGMAS)
    assert over.underpaint.opacity == OPACITY
    given = RenderOptions.of(texture, underpaint=Underpaint(2.0, 0.5), num_sigmas=1.5)
    assert (given.num_sigmas, given.underpaint) == (1.5, Underpaint(2.0, 0.5))
    for off in (False, None):
        assert RenderOptions.of(texture, underpaint=off) == plain
    kernel = bg.StrokeTexture.open("gaussian")
    assert RenderOptions.of(kernel, underpaint=True, streaks=0.2) == RenderOptions.of(kernel)
    # Of several brushes each has the size that is fitted to it.
    three = RenderOptions.of(BRUSHES["three"], underpaint=True)
    fitted = [texture.fitted_sigmas for texture in BRUSHES["three"].textures]
    assert len(set(fitted)) == 3
    np.testing.assert_allclose(three.num_sigmas, np.multiply(fitted, STROKE_REACH))
    np.testing.assert_allclose(np.multiply(three.num_sigmas, three.underpaint.reach), 3 * SIZE)
    strokes = with_brushes(scene_of(3))
    boxes, _ = project_by(strokes, CAMERA, three.projection_of(len(strokes), strokes.brushes))
    once = bg.project(strokes, CAMERA, num_sigmas=1, lock="anchor", fade=True)
    _, i, j = np.intersect1d(boxes.ids, once.ids, return_indices=True)
    sigmas = np.array(three.num_sigmas)[boxes.brushes[i], None]
    np.testing.assert_allclose(boxes.half_extents[i] / once.half_extents[j], np.repeat(sigmas, 2, axis=1))


def test_render_is_the_steps_and_a_sequence_takes_all_options_to_every_frame():
    scene, texture = scene_of(3), texture_of("image")
    look = {"underpaint": True, "streaks": 0.3, "order": "soft", "relief": True}
    how = RenderOptions.of(texture, **look)
    boxes, _ = project_by(scene, CAMERA, how.projection_of(len(scene)))
    steps = bg.rasterize(
        boxes, texture, height=40, width=60, underpaint=how.underpaint, streaks=0.3, relief=True
    )
    frame, plain = bg.render(scene, CAMERA, texture, **look), bg.render(scene, CAMERA, texture)
    assert_identical(frame, steps)
    for name in look:  # each is heard
        one = bg.render(scene, CAMERA, texture, **{name: look[name]})
        assert one.height is not None if name == "relief" else np.abs(one.rgb - plain.rgb).max() > 0.01
    path = [CAMERA, replace(CAMERA, near=0.02)]
    for of_path in bg.render_sequence(scene, path, texture, lock="anchor", **look):
        assert_identical(of_path, frame)
    kernel = bg.StrokeTexture.open("gaussian")
    assert_identical(bg.render(scene, CAMERA, kernel, order="soft"), bg.render(scene, CAMERA, kernel))


# Streaks


def test_streaks_fade_before_bristles_get_as_narrow_as_a_pixel():
    half_v = np.array([0, 1e-30, 1, 1.5, 3, 6, 12, 100, 3e38])
    boxes = boxes_of(np.zeros((9, 2)), np.stack([np.full(9, 5.0), half_v], 1))
    weights = streak_weights(boxes, 0.4)
    np.testing.assert_allclose(weights.sum(axis=1)[:4], 0)  # a tuft under two pixels
    np.testing.assert_allclose(weights.sum(axis=1)[4:], 0.4)
    np.testing.assert_allclose(weights[:6, 0], 0)  # a bristle under a pixel
    np.testing.assert_allclose(weights[6:, 0], 0.4)
    assert (weights >= 0).all()
    fine = boxes_of(np.zeros((4000, 2)), np.stack([np.full(4000, 5.0), np.linspace(0, 20, 4000)], 1))
    slopes = np.diff(streak_weights(fine, 0.4), axis=0) / (20 / 3999)
    middle = 0.5 * (streak_slopes(fine, 0.4)[1:] + streak_slopes(fine, 0.4)[:-1])
    np.testing.assert_allclose(slopes, middle, atol=1e-3)


# Glazes


@for_each("dtype", [np.float32, np.float64])
def test_very_many_dark_glazes_are_black_and_finite(dtype):
    boxes = boxes_of([(4, 4)] * 3000, 100.0, colors=(0.0, 0.4, 1.0), dtype=dtype)
    frame = bg.rasterize(boxes, SOLID, width=8, height=8, blend="glaze")
    assert (frame.rgb[..., :2] == 0).all()
    assert (frame.rgb[..., 2] == 1).all()
    assert (frame.alpha == 1).all()


# Brushes


def test_a_color_that_is_nowhere_different_changes_no_bit():
    grey = bristles()
    coverage = grey.coverage
    even = replace(grey, tint=Tint.of(np.full((*coverage.shape, 3), 0.3), coverage))
    painting = painting_of("mip", 40, 75, 41, dtype=np.float32)
    one, other = (painting._replace(brush=texture).frame() for texture in (grey, even))
    np.testing.assert_allclose(one.rgb, other.rgb, atol=1e-6)
    np.testing.assert_array_equal(one.alpha, other.alpha)


def test_an_image_keeps_its_colors_where_that_is_asked_for():
    picture = np.ones((10, 30, 4), np.float32)
    picture[:5, :, :3], picture[5:, :, :3] = (1, 0, 0), (0, 0, 1)
    picture[:, :3, 3] = 0
    path_free = bg.StrokeTexture.of(picture)
    assert path_free.tint is None
    assert not bg.BrushSet((path_free,)).are_colored
    tinted = bg.StrokeTexture._of_pixels(picture, None, "two", 256, colored=True)
    np.testing.assert_allclose(tinted.tint.mean, (0.5, 0, 0.5), atol=0.02)
    assert not bg.BrushSet((tinted,)).without_colors().are_colored


def test_a_stroke_keeps_its_brush_along_a_path_and_is_painted_with_it():
    strokes = with_brushes(scene_of(3, 40))
    for boxes in bg.track(strokes, [CAMERA, replace(CAMERA, near=0.02)]):
        assert len(boxes) > 10
        np.testing.assert_array_equal(boxes.brushes, strokes.brushes[boxes.ids])
    one = scene_of(3, 1)
    for brush, texture in enumerate(BRUSHES["three"].textures):
        own = replace(one, brushes=np.array([brush], np.uint8))
        assert_identical(bg.render(own, CAMERA, BRUSHES["three"]), bg.render(one, CAMERA, texture))


# The depth test


def test_a_box_that_is_not_seen_hides_nothing():
    boxes = boxes_of([(4, 4)] * 3, 100.0, depths=[1.0, 2.0, 3.0], colors=np.eye(3))
    limit = np.full((8, 8), 2.5)
    for soft in (boxes, softened(boxes, 1e-3)):
        frame = bg.rasterize(
            soft, SOLID, width=8, height=8, in_front_of=DepthTest(limit, np.array([9, 9, 1e-3]))
        )
        without = bg.rasterize(soft.take(slice(2)), SOLID, width=8, height=8)
        assert_same(frame, without, rtol=1e-12)


def test_that_of_a_picture_takes_its_depth_and_the_sizes_of_strokes():
    scene = scene_of(40)
    plain = bg.render(scene, CAMERA, "gaussian")
    boxes = bg.project(scene, CAMERA)
    test = DepthTest.by_picture(plain, boxes, scene)
    is_solid = plain.alpha > 0.15
    np.testing.assert_array_equal(test.limit[is_solid], plain.depth[is_solid])
    assert np.isinf(test.limit[~is_solid]).all()
    sizes = np.sqrt(np.sort(scene.scales, axis=1)[:, 1:].prod(axis=1))
    np.testing.assert_allclose(test.tolerance, SIZES * sizes[boxes.ids], rtol=1e-5)
    twice = DepthTest.by_picture(plain, boxes, scene, sizes=2 * SIZES)
    np.testing.assert_allclose(twice.tolerance, 2 * test.tolerance)
