"""Long marks are cut, what hangs before the camera goes, the sky stays, and the rest is left bit for bit."""

import numpy as np
import pytest

from brushgs.passes.form.slabs import LONGEST, cut_slabs, shorten_slabs, too_long
from brushgs.rendering.project import project
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from tests.kit.for_each import for_each

CAMERA = Camera.look_at((0, 0, -4), (0, 0, 0), width=160, height=120)
DIAGONAL = 200.0


def strokes_at(means, scales, dtype=np.float32):
    num = len(means)
    g = np.random.default_rng(0)
    return Gaussians(
        np.asarray(means, dtype),
        np.tile(np.array([1, 0, 0, 0], dtype), (num, 1)),
        np.asarray(scales, dtype),
        np.full(num, 0.9, dtype),
        g.normal(0, 0.3, (num, 1, 3)).astype(dtype),
        brushes=np.arange(num, dtype=np.uint8),
        ids=np.arange(num, dtype=np.int32),
        regions=np.arange(num, dtype=np.uint8),
    )


def small_ones(num=200):
    places = np.random.default_rng(3).uniform(-1.2, 1.2, (num, 3))
    return places.tolist(), np.full((num, 3), 0.03).tolist()


def with_small(means, scales):
    """These strokes first, among small ones that make up a scene."""
    others, sizes = small_ones()
    return strokes_at(means + others, scales + sizes)


def longest_of(strokes, camera=CAMERA):
    return 2 * project(strokes, camera).half_extents.max() / DIAGONAL


def test_small_strokes_are_the_input_itself():
    strokes = strokes_at(*small_ones())
    found, rows = cut_slabs(strokes, [CAMERA])
    assert found is strokes
    np.testing.assert_array_equal(rows, np.arange(len(strokes)))


def test_a_long_stroke_becomes_shorter_ones_in_its_place():
    strokes = with_small([[0, 0, 0]], [[0.6, 0.04, 0.01]])
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
    strokes = with_small([[0, 0, 0]], [[0.5, 0.3, 0.01]])
    found, rows = cut_slabs(strokes, [CAMERA])
    pieces = found.take(rows == 0)
    assert longest_of(found) <= LONGEST * 1.01
    assert np.max(pieces.means[:, 1] + 2 * pieces.scales[:, 1]) > 0.5
    np.testing.assert_array_equal(pieces.means[:, 2], 0)


def test_what_hangs_before_the_camera_goes():
    strokes = with_small([[0, 0, -3.6]], [[0.4, 0.2, 0.01]])
    found, rows = cut_slabs(strokes, [CAMERA])
    np.testing.assert_array_equal(rows, np.arange(1, len(strokes)))
    np.testing.assert_array_equal(found.means, strokes.means[1:])


def test_the_sky_is_exempt():
    strokes = with_small([[0, 0, 60]], [[30.0, 20, 1]])
    assert longest_of(strokes) > 1
    assert cut_slabs(strokes, [CAMERA])[0] is strokes


def test_all_views_count_and_one_that_is_not_asked_for_does_not():
    strokes = with_small([[0, 0, 0]], [[0.02, 0.02, 0.6]])
    beside = Camera.look_at((4, 0, 0), (0, 0, 0), width=160, height=120)
    assert cut_slabs(strokes, [CAMERA])[0] is strokes
    found, _ = cut_slabs(strokes, [CAMERA, beside])
    assert longest_of(found, beside) <= LONGEST * 1.01
    again, _ = cut_slabs(strokes, [beside, CAMERA])
    np.testing.assert_array_equal(again.means, found.means)


@for_each("dtype", [np.float32, np.float64])
@for_each("scale", [0.0, 1e-30, 1e20])
def test_extreme_strokes_stay_finite(dtype, scale):
    lone = strokes_at([[0, 0, 0]], [[scale, 0.1, 0]], dtype)
    many = strokes_at([[0, 0, 0]] * 9, [[scale] * 3] * 9, dtype)
    for strokes in (lone, many):
        found, rows = cut_slabs(strokes, [CAMERA])
        assert np.isfinite(found.means).all()
        assert np.isfinite(found.scales).all()
        assert len(rows) == len(found) <= 2000 * len(strokes)
        assert found.means.dtype == dtype


def test_shortened_strokes_keep_their_rows_and_their_width():
    strokes = with_small([[0, 0, 0], [0, 0.5, 0]], [[0.6, 0.04, 0.01], [0.5, 0.3, 0.01]])
    found = shorten_slabs(strokes, [CAMERA])
    assert longest_of(found) <= LONGEST * 1.01
    assert len(found) == len(strokes)
    np.testing.assert_array_equal(found.means, strokes.means)
    assert found.scales[0, 1] > 0.9 * strokes.scales[0, 1]
    np.testing.assert_array_equal(found.scales[2:], strokes.scales[2:])
    assert not too_long(found, [CAMERA]).any()
    assert shorten_slabs(found, []) is found


def test_no_strokes_and_no_views_change_nothing():
    strokes = with_small([[0, 0, 0]], [[0.6, 0.04, 0.01]])
    assert cut_slabs(strokes, [])[0] is strokes
    none = strokes.take(slice(0, 0))
    assert cut_slabs(none, [CAMERA])[0] is none
    with pytest.raises(ValueError, match="longest must be above 0"):
        cut_slabs(strokes, [CAMERA], longest=0)
