from itertools import pairwise

import numpy as np
import pytest

from brushgs.still_life import moving as stage
from brushgs.still_life import still_life
from brushgs.still_life.moving import still_life_moving
from brushgs.values.quats import normalized

COLUMNS = "means", "quats", "scales", "opacities", "sh"
NUM = 4000


@pytest.fixture(scope="module")
def scene():
    return still_life_moving(NUM)


@pytest.fixture(scope="module")
def setting():
    return stage._staged(NUM, 0)


def test_it_begins_as_the_still_life_and_goes_on_from_there_without_a_jump(scene):
    still, first, next_ = still_life(NUM), scene.at(0), scene.at(1e-6)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(first, name), getattr(still, name))
        np.testing.assert_allclose(getattr(next_, name), getattr(first, name), atol=1e-5)


def test_rows_that_rest_are_equal_bit_for_bit_and_the_others_are_not(scene):
    moments = [scene.at(time) for time in np.linspace(0, scene.duration, 9)]
    changes = np.zeros(len(moments[0]), bool)
    for moment in moments[1:]:
        for name in COLUMNS:
            there, before = getattr(moment, name), getattr(moments[0], name)
            changes |= (there != before).reshape(len(there), -1).any(axis=1)
    np.testing.assert_array_equal(changes, ~scene.resting)
    assert 0.7 < scene.resting.mean() < 0.85


def test_each_motion_is_there_and_no_step_of_it_is_large(scene, setting):
    moments = [scene.at(time) for time in np.arange(30, 61) / 30]
    moved = np.linalg.norm(moments[-1].means - moments[0].means, axis=1)
    assert np.median(moved[setting.pear]) > 0.5
    assert np.quantile(moved[setting.cloth], 0.9) > 0.2
    only_lit = np.setdiff1d(setting.lit, [*setting.pear, *setting.cloth])
    assert not moved[only_lit].any()
    assert len(only_lit) > 500
    for before, after in pairwise(moments):
        assert np.abs(after.means - before.means).max() < 0.15
        in_shadow_edge = np.abs((after.sh - before.sh)[:, 0]).max(axis=1) > 0.6  # by 0.17 of the color
        assert in_shadow_edge.mean() < 5e-3  # measured: 2e-3
        cosines = (normalized(after.quats) * normalized(before.quats)).sum(axis=1)
        assert np.degrees(2 * np.arccos(np.clip(cosines, -1, 1))).max() < 12  # and q does not become -q


def test_the_pear_is_rigid_stays_on_the_cloth_and_comes_to_rest(scene, setting):
    first = scene.at(0).means[setting.pear].astype(float)
    floor = first[:, 1].max()
    is_flesh = setting.cast.surface.gloss[setting.pear] > 0
    places = []
    for time in (0.8, 1.2, 1.7, 2.2, 3.0, 4.0):
        means = scene.at(time).means[setting.pear].astype(float)
        places.append(means.mean(axis=0))
        pairs = np.random.default_rng(0).integers(len(means), size=(2, 200))
        lengths, before = (np.linalg.norm(p[pairs[0]] - p[pairs[1]], axis=1) for p in (means, first))
        np.testing.assert_allclose(lengths, before, atol=2e-6)
        assert means[is_flesh, 1].max() == pytest.approx(floor, abs=0.02)
    assert np.linalg.norm(places[1] - places[0]) > 0.3
    np.testing.assert_array_equal(places[3], places[5])


def test_moments_whose_rows_do_not_correspond(scene):
    loose = still_life_moving(NUM, has_rows=False)
    assert (loose.has_rows, loose.resting, len(loose.times)) == (False, None, 121)
    one, two = loose.at(1.0), loose.at(1.0 + 1 / 30)
    assert len(one) == len(two) == len(scene.resting) - round(0.03 * len(scene.resting))
    assert not np.array_equal(one.opacities, two.opacities)
    np.testing.assert_array_equal(one.means, loose.at(1.01).means)  # the nearest moment
    np.testing.assert_array_equal(one.means, still_life_moving(NUM, has_rows=False).at(1.0).means)
    whole = {tuple(row) for row in scene.at(1.0).means}
    assert all(tuple(row) in whole for row in one.means)
    assert np.mean([tuple(row) in {tuple(other) for other in two.means} for row in one.means[:100]]) > 0.5
