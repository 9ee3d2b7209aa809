"""A moving scene as one set of Gaussians."""

from dataclasses import replace

import numpy as np
import pytest

from brushgs.passes.motion.canonical import LIFE_WEIGHT, MOTION_WEIGHT, canonical, features_of
from brushgs.passes.reduce.features import contracted
from tests.passes.motion.scenes import blob, clip, joined, moved, turn
from tests.passes.scenes import assert_same

TIMES = np.linspace(0, 1, 11)
STILL = turn((1, 0, 0), 0)


def test_rows_that_are_there_at_the_start_are_taken_from_it():
    body = blob(20)
    found = canonical(clip(lambda time: moved(body, turn((1, 1, 0), time), (time, 0, 0))), TIMES)
    assert_same(found.gaussians, moved(body, turn((1, 1, 0), 0), (0, 0, 0)))
    np.testing.assert_array_equal(found.gaussians.ids, np.arange(20))
    np.testing.assert_array_equal(found.references, 0)


def test_rows_that_come_later_are_taken_when_half_of_them_is_there():
    body = blob(10)
    comes = np.arange(10) >= 5

    def at(time):
        share = np.where(comes, np.clip(time, 0, 1), 1)
        return replace(moved(body, STILL, (time, 0, 0)), opacities=body.opacities * share)

    found = canonical(clip(at), TIMES)
    np.testing.assert_allclose(found.references, np.where(comes, 0.5, 0))
    expected = body.means + np.outer(np.where(comes, 0.5, 0), (1, 0, 0))
    np.testing.assert_allclose(found.gaussians.means, expected)
    np.testing.assert_allclose(found.gaussians.opacities, body.opacities * np.where(comes, 0.5, 1))


def test_rows_that_are_never_visible_are_left_out_and_those_that_rest_are_not_looked_at():
    body = blob(10)
    body = replace(body, opacities=body.opacities * (np.arange(10) % 2))
    for resting in (None, np.ones(10, bool)):
        found = canonical(clip(lambda _: body, resting=resting), TIMES)
        np.testing.assert_array_equal(found.gaussians.ids, [1, 3, 5, 7, 9])
        assert found.features.shape[1] == 0 or np.abs(found.features).max() < 1e-6


def test_features_are_distances_in_radii_of_the_scene():
    body = blob(200)
    speeds = np.zeros((200, 3))
    speeds[50:100, 0] = 0.2 / contracted(body.means)[1][50:100, 0]
    found = canonical(clip(lambda time: replace(body, means=body.means + time * speeds)), TIMES)
    apart = np.linalg.norm(found.features[50:100] - found.features[0], axis=1)
    np.testing.assert_allclose(apart, MOTION_WEIGHT * 0.2 * np.sqrt((TIMES**2).mean()), rtol=1e-4)
    np.testing.assert_allclose(found.features[:50], np.tile(found.features[0], (50, 1)), atol=1e-6)
    assert found.features.dtype == np.float32
    some = found.gaussians.take(np.array([3, 50, 199]))
    np.testing.assert_array_equal(features_of(found, some), found.features[[3, 50, 199]])


def test_where_a_row_is_not_visible_it_is_at_the_nearest_place_where_it_is():
    body, rest = blob(100), blob(100, 1)

    def at(time):  # flies off as soon as it is gone
        gone = time > 0.55
        away = moved(body, STILL, (1e6 if gone else 0, 0, 0))
        return joined(rest, replace(away, opacities=body.opacities * (not gone)))

    found = canonical(clip(at), TIMES)
    apart = np.linalg.norm(found.features[:100] - found.features[100:], axis=1)
    np.testing.assert_allclose(apart, LIFE_WEIGHT * np.sqrt(5 / 11), rtol=1e-3)


def test_a_long_clip_is_looked_at_a_few_times_and_a_short_one_once_or_twice():
    asked = []
    body = blob(10)
    scene = clip(lambda time: asked.append(time) or moved(body, STILL, (time, 0, 0)))
    canonical(scene, np.linspace(0, 1, 1000))
    assert len(asked) <= 48
    assert (asked[0], asked[-1]) == (0, 1)
    for times in (np.zeros(1), np.array([0.0, 1.0])):
        assert_same(canonical(scene, times).gaussians, body)
    with pytest.raises(ValueError, match="at least one moment"):
        canonical(scene, np.zeros(0))
    with pytest.raises(ValueError, match="rows must correspond"):
        canonical(replace(scene, has_rows=False), TIMES)
