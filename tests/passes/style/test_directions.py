"""The fields of styles over the picture of a camera."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.form.mark_directions import marks_at
from brushgs.passes.form.orient import ASPECT
from brushgs.passes.style.directions import direction_field
from brushgs.values.style import Style, StyleMarks
from tests.passes.form.planks import aspects, long_axes, planks
from tests.passes.form.test_marks import camera_above


def style_of(angle, *, clear=1.0, aspect=4.0, shape=(9, 12)):
    pairs = np.broadcast_to(clear * np.array([np.cos(2 * angle), np.sin(2 * angle)]), (*shape, 2))
    return Style("a", marks=StyleMarks(0.1, aspect, pairs.astype(np.float32)))


def at_center(field):
    camera = field.camera
    return marks_at(field, np.array([camera.width / 2]), np.array([camera.height / 2]))[0]


def test_styles_are_added_as_vectors_in_their_shares():
    field = direction_field([(style_of(0.3), 0.5), (style_of(1.1, clear=0.6), 0.25)], camera_above())
    wanted = 0.5 * np.array([np.cos(0.6), np.sin(0.6)]) + 0.15 * np.array([np.cos(2.2), np.sin(2.2)])
    np.testing.assert_allclose(at_center(field), wanted, atol=1e-6)
    crossed = direction_field([(style_of(0.3), 0.5), (style_of(0.3 + np.pi / 2), 0.5)], camera_above())
    np.testing.assert_allclose(crossed.pairs, 0, atol=1e-7)
    for share, wanted in ((0.0, ASPECT), (1.0, 8.0), (0.5, np.sqrt(ASPECT * 8))):
        between = direction_field([(style_of(0, aspect=8.0), share)], camera_above()).aspect
        assert between == pytest.approx(wanted)
    assert direction_field([(Style("edit"), 1.0)], camera_above()).aspect == pytest.approx(ASPECT)


def test_a_style_fills_the_picture_and_is_cropped_as_a_painting_is():
    half = np.zeros((10, 20, 2), np.float32)
    half[:, :10, 0], half[:, 10:, 0] = 1, -1  # level on the left, upright on the right
    style = Style("a", marks=StyleMarks(0.1, 2.0, half))
    field = direction_field([(style, 1.0)], camera_above(width=100, height=100))
    found = marks_at(field, np.array([10.0, 90.0]), np.full(2, 50.0))
    np.testing.assert_allclose(found[:, 0], [1, -1], atol=1e-6)
    one = direction_field([(style_of(0.4, shape=(1, 1)), 1.0)], camera_above())
    np.testing.assert_allclose(at_center(one), [np.cos(0.8), np.sin(0.8)], atol=1e-6)


@pytest.mark.parametrize("aspect", [1.2, 5.0])
def test_strokes_take_the_direction_and_the_aspect_of_marks_and_keep_their_area(aspect):
    strokes, gaussians = planks()
    field = direction_field([(style_of(0.5, aspect=aspect), 1.0)], camera_above())
    after = bg.orient(strokes, gaussians, field)
    along = np.abs(long_axes(after) @ [np.cos(0.5), np.sin(0.5), 0])
    assert np.quantile(along, 0.05) > np.cos(np.radians(10))
    assert np.median(aspects(after)) == pytest.approx(aspect, rel=0.1)
    areas = [np.sort(s.scales, axis=1)[:, 1:].prod(axis=1) for s in (strokes, after)]
    np.testing.assert_allclose(areas[1], areas[0], rtol=1e-4)
