from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brushgs.cameras.motion import SAME_VIEW, camera_with, is_same_view, lenses, screw_motion, view_change
from brushgs.values.camera import Camera
from brushgs.values.quats import rotation_matrices
from tests.kit.for_each import for_each

SIZE = {"width": 64, "height": 48}


def turned(axis, angle):
    half = 0.5 * angle
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return rotation_matrices(np.array([[np.cos(half), *(np.sin(half) * axis)]]))[0]


def camera(rotation=None, position=(0, 0, 0), focal=50.0, near=0.01, **size):
    rotation = np.eye(3) if rotation is None else rotation
    viewmat = np.eye(4)
    viewmat[:3, :3], viewmat[:3, 3] = rotation, -rotation @ np.asarray(position, dtype=float)
    K = [[focal, 0, 30], [0, 1.5 * focal, 20], [0, 0, 1]]
    return Camera(viewmat, K, near=near, **(SIZE | size))


def orbit_view(angle, radius=3.0, center=(1, -2, 5), tilt=0.4):
    """A camera on a circle about the y axis through a center, looking down at it."""
    viewmat = np.eye(4)
    viewmat[:3, :3] = turned((1, 0, 0), tilt) @ turned((0, 1, 0), angle)
    viewmat[:3, 3] = (0, 0, radius) - viewmat[:3, :3] @ center
    return Camera(viewmat, camera().K, **SIZE)


def between(first, second, share):
    """The camera at a share of the screw motion from one view to another."""
    (viewmat,) = screw_motion(first.viewmat[None], second.viewmat[None], share)
    (lens,) = lenses([first]) * (1 - share) + lenses([second]) * share
    return camera_with(viewmat, lens, first.width, first.height)


units = st.floats(-1, 1)
vectors = st.tuples(units, units, units).filter(lambda v: np.linalg.norm(v) > 0.1)
angles = st.one_of(st.floats(0, np.pi), st.floats(-18, 0).map(lambda e: 10.0**e))
places = st.tuples(*[st.floats(-10, 10)] * 3)


@settings(max_examples=100, deadline=None)
@given(vectors, angles, places, places, vectors, angles)
@example((1, 0, 0), np.pi, (0, 0, 0), (1, 1, 1), (0, 1, 0), 0.0)
@example((1, 0, 0), 0.0, (0, 0, 0), (0, 0, 0), (0, 1, 0), 0.0)
def test_the_ends_are_reached(axis, angle, here, there, home_axis, home):
    rotation = turned(home_axis, home)
    first, second = camera(rotation, here), camera(turned(axis, angle) @ rotation, there)
    for camera_at, share in ((first, 1e-12), (second, 1 - 1e-12)):
        np.testing.assert_allclose(between(first, second, share).viewmat, camera_at.viewmat, atol=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 6.3), st.floats(-3.1, 3.1), st.floats(0, 1), st.floats(0.01, 100))
def test_between_two_views_of_an_orbit_lies_a_view_of_the_orbit(start, step, share, radius):
    ends = [orbit_view(angle, radius) for angle in (start, start + step)]
    expected = orbit_view(start + share * step, radius)
    found = between(*ends, share)
    np.testing.assert_allclose(found.viewmat, expected.viewmat, atol=1e-9 * max(1, radius))


@for_each("step", [1e-15, 1e-12, 1e-8, 1e-4, 1e-2])
def test_tiny_turns_lose_no_digits(step):
    ends = [orbit_view(0, 1000.0), orbit_view(step, 1000.0)]
    for share in (0.25, 0.5):
        expected = orbit_view(share * step, 1000.0)
        np.testing.assert_allclose(between(*ends, share).viewmat, expected.viewmat, atol=1e-12)


@for_each("gap", [0.0, 1e-15, 1e-9, 1e-5])
def test_turns_up_to_half_a_turn_go_round_at_an_even_rate(gap):
    first, second = camera(position=(0, 0, -2)), camera(turned((0, 1, 0), np.pi - gap), (0, 0, 2))
    steps = [between(first, second, share) for share in np.linspace(0, 1, 9)]
    changes = [view_change(a, b, 1e9) for a, b in pairwise(steps)]
    np.testing.assert_allclose(changes, (np.pi - gap) / 8, atol=1e-9)
    np.testing.assert_allclose([np.linalg.norm(c.position) for c in steps], 2, atol=1e-4)


def test_a_straight_move_goes_straight_and_a_turn_in_place_stays():
    far = between(camera(), camera(position=(4, 0, 2)), 0.25)
    np.testing.assert_allclose(far.position, (1, 0, 0.5), atol=1e-15)
    here = camera(position=(3, 1, 2))
    there = camera(turned((1, 2, 3), 2.5), (3, 1, 2))
    np.testing.assert_allclose(between(here, there, 0.3).position, (3, 1, 2), atol=1e-14)


def test_view_change_is_the_larger_of_turn_and_shift():
    first = camera()
    assert view_change(first, first, 1.0) == 0
    assert view_change(first, camera(turned((1, 2, 3), 0.3), (0.1, 0, 0)), 1.0) == pytest.approx(0.3)
    assert view_change(first, camera(turned((1, 2, 3), 0.3), (3, 0, 4)), 2.0) == pytest.approx(2.5)
    assert view_change(first, camera(turned((0, 0, 1), 1e-9)), 1.0) == pytest.approx(1e-9)
    with pytest.raises(ValueError, match=r"view_change: distance must be > 0, got 0\.0"):
        view_change(first, first, 0.0)


def test_views_are_the_same_up_to_the_digits_of_a_file():
    first = camera()
    assert is_same_view(first, first, 1.0)
    for size, is_same in ((0.5 * SAME_VIEW, True), (2 * SAME_VIEW, False)):
        assert is_same_view(first, camera(turned((1, 2, 3), size)), 1.0) is is_same
        assert is_same_view(first, camera(position=(3 * size, 0, 0)), 3.0) is is_same
        assert is_same_view(first, camera(focal=50 * (1 + size)), 1.0) is is_same
    assert not is_same_view(first, camera(width=65), 1.0)
