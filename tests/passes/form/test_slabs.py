"""Long marks are cut, what hangs before the camera goes, the sky stays, and the rest is left bit for bit."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.form.slabs import LONGEST, cut_slabs, shorten_slabs, too_long
from brushgs.rendering.project import project
from brushgs.values.camera import Camera
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at

CAMERA = Camera.look_at((0, 0, -4), (0, 0, 0), width=160, height=120)
DIAGONAL = 200.0


def with_small(*slabs):
    """Strokes (place, scales) first, among 200 small ones that make up a scene."""
    places = np.random.default_rng(3).uniform(-1.2, 1.2, (200, 3))
    means = np.array([*(place for place, _ in slabs), *places])
    scales = np.array([*(sizes for _, sizes in slabs), *np.full((200, 3), 0.03)])
    rows = np.arange(len(means))
    strokes = gaussians_at(means, scales, 0.5 + 0.1 * np.sin(np.outer(rows, (1, 2, 3))), dtype=np.float32)
    small = rows.astype(np.uint8)
    return replace(strokes, brushes=small, ids=rows.astype(np.int32), regions=small)


def longest_of(strokes, camera=CAMERA):
    return 2 * project(strokes, camera).half_extents.max() / DIAGONAL


def test_a_long_stroke_becomes_shorter_ones_in_its_place():
    strokes = with_small(((0, 0, 0), (0.6, 0.04, 0.01)))
    assert longest_of(strokes) > 3 * LONGEST
    found, rows = cut_slabs(strokes, [CAMERA])
    assert longest_of(found) <= LONGEST * 1.01
    pieces = found.take(rows == 0)
    assert 4 <= len(pieces) <= 12
    assert np.max(pieces.means[:, 0] + 2 * pieces.scales[:, 0]) == pytest.approx(1.2, rel=0.02)
    np.testing.assert_array_equal(pieces.means[:, 1:], 0)
    assert np.abs(pieces.means[:, 0] + pieces.means[::-1, 0]).max() < 1e-6
    for name in ("quats", "opacities", "sh", "brushes", "ids", "regions"):
        np.testing.assert_array_equal(getattr(found, name), getattr(strokes, name)[rows])
    others = rows > 0
    np.testing.assert_array_equal(found.means[others], strokes.means[rows[others]])
    np.testing.assert_array_equal(found.scales[others], strokes.scales[rows[others]])
    assert (np.diff(rows) >= 0).all()


def test_a_slab_is_cut_across_too_and_its_third_axis_stays():
    strokes = with_small(((0, 0, 0), (0.5, 0.3, 0.01)))
    found, rows = cut_slabs(strokes, [CAMERA])
    pieces = found.take(rows == 0)
    assert longest_of(found) <= LONGEST * 1.01
    assert np.max(pieces.means[:, 1] + 2 * pieces.scales[:, 1]) > 0.5
    np.testing.assert_array_equal(pieces.means[:, 2], 0)


def test_what_hangs_before_the_camera_goes_and_the_sky_is_exempt():
    strokes = with_small(((0, 0, -3.6), (0.4, 0.2, 0.01)))
    found, rows = cut_slabs(strokes, [CAMERA])
    np.testing.assert_array_equal(rows, np.arange(1, len(strokes)))
    np.testing.assert_array_equal(found.means, strokes.means[1:])
    sky = with_small(((0, 0, 60), (30.0, 20, 1)))
    assert longest_of(sky) > 1
    assert cut_slabs(sky, [CAMERA])[0] is sky


def test_all_views_count_and_one_that_is_not_asked_for_does_not():
    strokes = with_small(((0, 0, 0), (0.02, 0.02, 0.6)))
    beside = Camera.look_at((4, 0, 0), (0, 0, 0), width=160, height=120)
    assert cut_slabs(strokes, [CAMERA])[0] is strokes
    found, _ = cut_slabs(strokes, [CAMERA, beside])
    assert longest_of(found, beside) <= LONGEST * 1.01
    again, _ = cut_slabs(strokes, [beside, CAMERA])
    np.testing.assert_array_equal(again.means, found.means)


@for_each("dtype", [np.float32, np.float64])
@for_each("scale", [0.0, 1e-30, 1e20])
def test_extreme_strokes_stay_finite(dtype, scale):
    lone = gaussians_at([[0, 0, 0]], (scale, 0.1, 0), dtype=dtype)
    many = gaussians_at(np.zeros((9, 3)), scale, dtype=dtype)
    for strokes in (lone, many):
        found, rows = cut_slabs(strokes, [CAMERA])
        assert np.isfinite(found.means).all()
        assert np.isfinite(found.scales).all()
        assert len(rows) == len(found) <= 2000 * len(strokes)
        assert found.means.dtype == dtype


def test_shortened_strokes_keep_their_rows_and_their_width():
    strokes = with_small(((0, 0, 0), (0.6, 0.04, 0.01)), ((0, 0.5, 0), (0.5, 0.3, 0.01)))
    found = shorten_slabs(strokes, [CAMERA])
    assert longest_of(found) <= LONGEST * 1.01
    assert len(found) == len(strokes)
    np.testing.assert_array_equal(found.means, strokes.means)
    assert found.scales[0, 1] > 0.9 * strokes.scales[0, 1]
    np.testing.assert_array_equal(found.scales[2:], strokes.scales[2:])
    assert not too_long(found, [CAMERA]).any()
    assert shorten_slabs(found, []) is found


def test_small_strokes_no_strokes_and_no_views_change_nothing():
    strokes, small = with_small(((0, 0, 0), (0.6, 0.04, 0.01))), with_small()
    found, rows = cut_slabs(small, [CAMERA])
    assert found is small
    np.testing.assert_array_equal(rows, np.arange(len(small)))
    assert cut_slabs(strokes, [])[0] is strokes
    none = strokes.take(slice(0, 0))
    assert cut_slabs(none, [CAMERA])[0] is none
    with pytest.raises(ValueError, match="longest must be above 0"):
        cut_slabs(strokes, [CAMERA], longest=0)
