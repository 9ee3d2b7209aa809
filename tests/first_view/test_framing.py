from dataclasses import replace

import numpy as np
import pytest

from brushgs.cameras.framing import frame_scene, subject
from brushgs.first_view import find_first_view
from brushgs.first_view.attached import with_attached
from brushgs.first_view.front import wrapped
from brushgs.first_view.surroundings import clear_azimuth, dense_middle
from tests.first_view.scenes import gaussians, joined, moved, on_a_plaza, relief, statue, statue_view

UP = np.array([0.0, -1.0, 0.0])


def test_a_statue_on_a_plaza_is_framed_as_if_it_stood_alone():
    view, alone = find_first_view(on_a_plaza()), statue_view()
    assert view.has_surroundings
    assert np.ptp(view.points, axis=0) == pytest.approx(np.ptp(alone.points, axis=0), rel=0.25)
    assert view.points.mean(axis=0) == pytest.approx(alone.points.mean(axis=0), abs=0.3)
    assert np.ptp(view.whole, axis=0)[0] > 15
    assert not alone.has_surroundings
    assert alone.eye is None
    assert alone.whole is None
    assert np.ptp(alone.points, axis=0) == pytest.approx(np.ptp(statue().means, axis=0), rel=0.03)


def test_what_rises_thinly_from_a_subject_in_surroundings_is_framed_and_floaters_above_are_not():
    rng = np.random.default_rng(0)
    top = statue().means[:, 1].min()
    feather = rng.uniform((-0.05, top - 0.3, -0.05), (0.05, top, 0.05), (60, 3))
    floaters = rng.uniform((-0.5, top - 3, -0.5), (0.5, top - 0.6, 0.5), (40, 3))
    added = np.concatenate([feather, floaters])
    added = gaussians(added, np.tile([0.0, 0, 1], (100, 1)), 0.03, (0.3, 0.2, 0.1))
    scene = joined(on_a_plaza(), added)
    assert dense_middle(scene)[:, 1].min() > top - 0.1
    highest = find_first_view(scene, up=UP, azimuth=0.0).points[:, 1].min()
    assert floaters[:, 1].max() < top - 0.5 < highest < top - 0.2


def test_a_subject_behind_a_board_is_seen_from_beside_it():
    rng = np.random.default_rng(0)
    board = rng.uniform((-0.8, -2.2, -2.6), (0.8, 0, -2.5), (3000, 3))
    scene = joined(on_a_plaza(), gaussians(board, np.tile([0.0, 0, 1], (3000, 1)), 0.1, (0.3, 0.2, 0.1)))
    view = statue_view()
    first = np.radians(10)
    view = replace(view, azimuth=first)
    assert clear_azimuth(on_a_plaza(), view) == first
    found = np.degrees(wrapped(clear_azimuth(scene, view)))
    assert abs(found) >= 28


def test_thin_legs_are_part_of_an_object_and_floaters_are_not():
    """Legs of little opacity, which quantiles of the opacity miss; floaters below, attached to nothing."""
    rng = np.random.default_rng(0)
    legs = rng.uniform((-0.03, 0, -0.03), (0.03, 0.55, 0.03), (160, 3))
    legs = np.concatenate([legs + np.array([x, 0.1, z]) for x in (-0.5, 0.5) for z in (-0.5, 0.5)])
    floaters = rng.uniform((-0.7, 0.75, -0.7), (0.7, 0.9, 0.7), (12, 3))
    up = np.tile([0.0, -1, 0], (len(legs), 1))
    added = gaussians(legs, up, 0.03, (0.3, 0.3, 0.3), 0.1)
    scene = joined(statue(), added, gaussians(floaters, up[:12], 0.05, (1, 1, 1), 0.5))
    middle, _ = subject(scene)
    assert middle[:, 1].max() < 0.5  # y is down
    lowest = with_attached(scene, middle)[:, 1].max()
    assert 0.6 < lowest < 0.75
    points = find_first_view(scene, up=UP, azimuth=0.0).points
    assert points[:, 1].max() == lowest


def test_a_capture_that_faces_one_way_is_seen_from_inside():
    view = find_first_view(relief())
    assert np.array_equal(view.eye, (0, 0, 0))
    assert np.array_equal(view.up, UP)
    assert (view.azimuth, view.elevation) == (0, 0)
    assert view.ups[0] == ("-y", view.probability)
    assert np.allclose(frame_scene(view, width=64, height=48).viewmat, np.eye(4))
    back = find_first_view(moved(relief(), rotation=np.diag([1.0, -1, -1])))  # along -z, with y up
    assert back.eye is not None
    assert np.array_equal(back.up, -UP)
    assert np.allclose(frame_scene(back, width=64, height=48).viewmat[2, :3], (0, 0, -1))
    sideways = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    assert find_first_view(moved(relief(), rotation=sideways)).eye is None
    assert find_first_view(relief(), up="+z").eye is None
    assert find_first_view(relief(), up="-y").eye is not None
