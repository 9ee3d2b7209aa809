"""Directions that depend on stroke and view alone."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import brushgs as bg
from brushgs.core.native import core as _core
from brushgs.rendering.canonical import directions_of, fit_canonical
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.visibility import visible_areas
from tests.kit import for_each, still_life_of

FLAT = bg.BrushSet.open("flat")


@pytest.fixture(scope="module")
def strokes():
    return bg.cluster(still_life_of(2000), 150)


@pytest.fixture(scope="module")
def fields(strokes):
    return fit_canonical(strokes)


def turned(first, second):
    return np.abs(np.remainder(first.astype(float) - second + np.pi, 2 * np.pi) - np.pi)


def test_fields_are_unit_vectors_across_each_other(fields):
    for vectors in (fields.facing, fields.along):
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 1, atol=1e-9)
    np.testing.assert_allclose((fields.facing * fields.along).sum(axis=1), 0, atol=1e-9)


def test_a_view_straight_at_a_stroke_shows_its_vector():
    round_ones = bg.Gaussians([[0, 0, 0]], [[1, 0, 0, 0]], [[1, 1, 1]], [1.0], [[[0, 0, 0]]])
    field = replace(fit_canonical(round_ones), is_anchored=np.array([False]))
    eye = 5 * field.facing[0]
    up = field.along[0]
    camera = bg.Camera.look_at(eye, (0, 0, 0), up, width=64, height=64)
    angle = float(field.directions(round_ones, camera).angles[0])
    assert angle == pytest.approx(-np.pi / 2, abs=1e-5)  # upward in the picture


def test_near_views_agree_where_strokes_are_faced(strokes, fields):
    cameras = bg.orbit(strokes, 120, width=64, height=48)
    steps = []
    for before, now in pairwise(cameras[:41]):
        found = [fields.directions(strokes, camera).angles for camera in (before, now)]
        towards = now.position - strokes.means
        is_faced = (towards * fields.facing).sum(axis=1) > 0.2 * np.linalg.norm(towards, axis=1)
        boxes = bg.project(strokes, now)
        rows = boxes.ids[is_faced[boxes.ids]]
        steps.append(turned(*found)[rows])
    assert np.degrees(np.quantile(np.concatenate(steps), 0.995)) < 15


@for_each("elevation", [-30, 0, 50])
def test_less_paint_turns_than_along_the_longest_axes(strokes, fields, elevation):
    """By more than 15 degrees from view to view; from below the ground, too."""
    cameras = bg.orbit(strokes, 120, width=64, height=48, elevation_deg=elevation)[::2]
    shares = []
    for given in (None, fields):
        found = [directions_of(strokes, camera, RenderOptions.of(FLAT), given).angles for camera in cameras]
        seen = [visible_areas(strokes, camera) for camera in cameras[1:]]
        is_turned = [turned(*pair) > np.radians(15) for pair in pairwise(found)]
        shares.append(np.vdot(seen, is_turned) / np.sum(seen))
    assert shares[1] <= shares[0]


def test_fields_do_not_depend_on_the_number_of_threads(strokes, fields):
    one = fit_canonical(strokes, num_threads=1)
    np.testing.assert_array_equal(one.facing, fields.facing)
    np.testing.assert_array_equal(one.along, fields.along)


def test_rates_of_turn_of_the_core_are_those_of_numpy():
    rng = np.random.default_rng(5)
    toward, facing = rng.normal(size=(3, 9, 300)).astype(np.float32), rng.normal(size=(4, 3, 300))
    toward /= np.linalg.norm(toward, axis=0)
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    facing[0] = -toward[:, 0]  # seen from behind
    weights, rates = rng.random((9, 300), np.float32), np.empty((4, 300))
    _core.turn_rates(toward=toward, weights=weights, facing=facing, most=25.0, rates=rates, num_threads=2)
    x, y, z = (toward[i] * facing[:, i, None] for i in range(3))
    cosines = x + y + z
    turns = np.minimum((1 - cosines) / np.maximum(1 + cosines, 1e-3), 25.0)
    np.testing.assert_array_equal(rates, (weights * turns).sum(axis=1))
