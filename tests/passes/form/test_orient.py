"""Strokes run along what they depict, and nothing else about them changes."""

import numpy as np
import pytest

import brushgs as bg
from brushgs.passes.form.orient import ASPECT
from brushgs.values.quats import quats_of, rotation_matrices
from tests.kit.for_each import for_each
from tests.passes.form.planks import aspects, long_axes, planks, surface, turned_frame
from tests.passes.scenes import covariances, replaced


@for_each("field", ["form", "color"])
def test_strokes_on_planks_run_along_them(field):
    frame = turned_frame()
    strokes, gaussians = planks(frame=frame)
    before = np.abs(long_axes(strokes) @ frame[:, 0])
    after = bg.orient(strokes, gaussians, field)
    along = np.abs(long_axes(after) @ frame[:, 0])
    assert np.median(before) < 0.8
    assert np.quantile(along, 0.05) > np.cos(np.radians(20))
    assert np.median(along) > np.cos(np.radians(8))
    assert np.median(aspects(after)) > 1.8
    assert aspects(after).max() <= ASPECT + 1e-9


def test_strokes_run_along_a_column_of_one_color_which_bends_around():
    random = np.random.default_rng(0)

    def column(num, size, aspect, angles):
        turn, height = random.uniform(0, 2 * np.pi, num), random.uniform(-2, 2, num)
        flat = surface(np.zeros((num, 2)), np.full((num, 3), 0.5), size, aspect=aspect, angles=angles)
        c, s, o = np.cos(turn), np.sin(turn), np.zeros(num)
        frames = np.array([[-s, o, c], [c, o, s], [o, o + 1, o]]).transpose(2, 0, 1)  # around, up, outward
        rotations = frames @ rotation_matrices(flat.quats)
        return replaced(flat, means=np.stack([c, s, height], axis=1), quats=quats_of(rotations))

    strokes = column(400, 0.15, 1.05, random.uniform(0, np.pi, 400))
    after = bg.orient(strokes, column(5000, 0.04, 1.0, 0.0))
    up = np.abs(long_axes(after)[np.abs(strokes.means[:, 2]) < 1.6, 2])
    assert np.quantile(up, 0.1) > np.cos(np.radians(20))


def test_place_normal_thickness_area_opacity_and_color_stay():
    strokes, gaussians = planks(frame=turned_frame(), dtype=np.float32)
    after = bg.orient(strokes, gaussians)
    for name in ("means", "opacities", "sh"):
        np.testing.assert_array_equal(getattr(after, name), getattr(strokes, name))
    thin = np.sort(after.scales, axis=1), np.sort(strokes.scales, axis=1)
    np.testing.assert_array_equal(thin[0][:, 0], thin[1][:, 0])
    np.testing.assert_allclose(*(scales[:, 1] * scales[:, 2] for scales in thin), rtol=1e-5)
    normals = [rotation_matrices(some.quats)[:, :, 2] for some in (strokes, after)]
    np.testing.assert_allclose(np.abs(np.einsum("ni,ni->n", *normals)), 1, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(after.quats, axis=1), 1, rtol=1e-5)


def test_slender_strokes_keep_their_axes_and_are_followed():
    random = np.random.default_rng(1)
    uv = random.uniform(-1, 1, (600, 2))
    grey = np.full((600, 3), 0.5)
    aspect = np.where(np.arange(600) % 2, 3.0, 1.05)
    strokes = surface(
        uv, grey, 0.05, aspect=aspect, angles=np.where(aspect > 2, 0.4, random.uniform(0, 3, 600))
    )
    after = bg.orient(strokes, strokes)
    slender = aspect > 2
    np.testing.assert_allclose(
        covariances(after)[slender], covariances(strokes)[slender], rtol=1e-9, atol=1e-15
    )
    axes = long_axes(after)[~slender]
    assert np.quantile(np.abs(axes @ [np.cos(0.4), np.sin(0.4), 0]), 0.1) > 0.95


def test_own_is_the_input_itself_and_an_unknown_field_is_refused():
    strokes, gaussians = planks(100, 20)
    assert bg.orient(strokes, gaussians, "own") is strokes
    with pytest.raises(ValueError, match=r"direction must be own, form, color, .* got 'shape'"):
        bg.orient(strokes, gaussians, "shape")
