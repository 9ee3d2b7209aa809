"""Views that options describe: what they look at, from which side, and the flags that give them again."""

from argparse import ArgumentParser
from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from brushgs.cameras.first_view import flags_of, framed_camera, framed_orbit, sayable, up_text
from brushgs.cameras.framing import AXES, MARGIN, NEAR_SHARE, plain_first_view, with_up
from brushgs.cli import flags
from brushgs.cli.parser import _joined
from brushgs.options.painting import ViewConfig
from brushgs.values.camera import FirstView
from tests.cameras.test_framing import box, cloud, pixels
from tests.kit.for_each import for_each

SIZE = (96, 64)
SCENE = cloud(box(center=(3, -4, 5)))
VIEW = plain_first_view(SCENE)
ROOM, UP = box((8, 4, 8), center=(0, 0, 6), num=300), np.array([0.0, -1, 0])
INSIDE = FirstView(ROOM, UP, 0.0, radians(6), eye=np.array([0.1, 0.2, 0]))


def assert_same(one, other):
    np.testing.assert_array_equal(one.viewmat, other.viewmat)
    np.testing.assert_array_equal(one.K, other.K)
    assert (one.width, one.height, one.near) == (other.width, other.height, other.near)


def looks(camera):
    """Position and forward axis."""
    return camera.position, camera.viewmat[2, :3]


@for_each("roll", [-120.0, -20.0, 35.0, 90.0])
def test_a_roll_turns_the_scene_clockwise_and_keeps_the_subject_whole(roll):
    config = ViewConfig(size=SIZE, roll=radians(roll))
    camera, level = framed_camera(VIEW, config), framed_camera(VIEW, ViewConfig(size=SIZE))
    np.testing.assert_allclose(looks(camera)[1], looks(level)[1], atol=1e-12)
    middle = VIEW.points.mean(axis=0)
    seen, _ = pixels(camera, [middle, middle + 0.1 * VIEW.up])
    x, y = (seen[1] - seen[0]) * (camera.width, camera.height)
    assert np.degrees(np.arctan2(x, -y)) == pytest.approx(roll, abs=4)  # clockwise from the top
    reach = np.abs(pixels(camera, VIEW.points)[0]).max(axis=0)
    assert reach.max() == pytest.approx(1 - 2 * MARGIN, abs=0.02)


def test_a_pan_moves_the_camera_aside_by_shares_of_the_picture():
    plain = framed_camera(VIEW, ViewConfig(size=SIZE, zoom=2.0))
    moved = framed_camera(VIEW, ViewConfig(size=SIZE, zoom=2.0, pan=(0.25, 0.1)))
    np.testing.assert_array_equal(moved.viewmat[:3, :3], plain.viewmat[:3, :3])
    np.testing.assert_array_equal(moved.K, plain.K)
    far = plain.position + plain.near / NEAR_SHARE * looks(plain)[1]  # at the distance of the subject
    shift = pixels(moved, [far])[0][0] - pixels(plain, [far])[0][0]
    np.testing.assert_allclose(shift, (-0.5, 0.2), atol=1e-9)  # in halves of the picture, y down


def test_a_point_is_seen_from_the_distance_that_is_given():
    point, distance = (2.5, -4.2, 5.5), 0.75
    config = ViewConfig(size=SIZE, look_at=point, distance=distance)
    for view in (VIEW, INSIDE):
        for camera in (framed_camera(view, config), *framed_orbit(view, config, 3)):
            np.testing.assert_allclose(pixels(camera, [point])[0][0], 0, atol=1e-12)
            assert np.linalg.norm(camera.position - point) == pytest.approx(distance, rel=1e-12)
            assert camera.near == NEAR_SHARE * distance


@for_each(
    "options, sentence",
    [
        ({"side": "left", "azimuth": 1.0}, "azimuth cannot be combined with side 'left'"),
        ({"side": "top", "elevation": 1.0}, "elevation cannot be combined with side 'top'"),
        ({"pan": (0, 11.0)}, "pan must be -10 to 10, got 11"),
        ({"look_at": (0, np.inf, 0)}, "look-at must be finite"),
        ({"look_at": None, "distance": 2.0}, "distance is that to a point: give the point too"),
        ({"look_at": "part", "distance": 2.0}, "distance is that to a point: give the point too"),
        ({"look_at": (0, 0, 0), "distance": -1.0}, "distance must be above 0, got -1"),
    ],
)
def test_options_that_describe_no_view_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        ViewConfig(**options)


def test_a_part_is_the_upper_third():
    camera = framed_camera(VIEW, ViewConfig(size=SIZE, look_at="part"))
    heights = VIEW.points @ VIEW.up
    top = VIEW.points[heights >= heights.max() - np.ptp(heights) / 3]
    assert (np.abs(pixels(camera, top)[0]) < 1).all()
    low = VIEW.points[heights < heights.min() + np.ptp(heights) / 10]
    assert pixels(camera, low)[0][:, 1].max() > 1
    cone = replace(VIEW, points=np.array([(0, -9, 0), (1, 0, 1), (1, 0, -1), (-1, 0, 0)], float))
    tip = framed_camera(cone, ViewConfig(size=SIZE, look_at="part", elevation=0.0))
    _, depths = pixels(tip, [(0, -9, 0)])
    assert depths[0] > 2, "a tip is not a point"


def test_a_scene_with_surroundings_can_be_shown_whole():
    rng = np.random.default_rng(0)
    wide = cloud(np.concatenate([box((1, 1, 1)), rng.standard_cauchy((1500, 3)) * 4]))
    view = plain_first_view(wide)
    assert view.has_surroundings
    subject, whole = (framed_camera(view, ViewConfig(size=SIZE, look_at=at)) for at in ("subject", "scene"))
    corners = np.stack(np.meshgrid(*view.whole.T), axis=-1).reshape(-1, 3)
    assert (np.abs(pixels(whole, corners)[0]) < 1).all()
    assert np.linalg.norm(whole.position) > 3 * np.linalg.norm(subject.position)
    assert VIEW.whole is None
    assert_same(*(framed_camera(VIEW, ViewConfig(size=SIZE, look_at=at)) for at in ("scene", "subject")))


@for_each(
    ("side", "degrees"), [("front", 70), ("right", 160), ("back", 250), ("left", -20), ("three-quarter", 90)]
)
def test_a_side_is_counted_from_the_front(side, degrees):
    view = replace(VIEW, front=radians(70), azimuth=radians(90))
    camera = framed_camera(view, ViewConfig(size=SIZE, side=side))
    expected = framed_camera(view, ViewConfig(size=SIZE, azimuth=radians(degrees)))
    np.testing.assert_allclose(camera.viewmat, expected.viewmat, atol=1e-12)
    low = framed_camera(view, ViewConfig(size=SIZE, side=side, elevation=-0.2))
    assert looks(low)[1] @ view.up > 0


def test_from_the_top_the_front_is_at_the_bottom_of_the_picture():
    view = replace(VIEW, front=radians(70))
    top, front = (framed_camera(view, ViewConfig(size=SIZE, side=side)) for side in ("top", "front"))
    np.testing.assert_allclose(looks(top)[1], -view.up, atol=1e-12)
    toward_viewer = -looks(front)[1] + (looks(front)[1] @ view.up) * view.up
    assert top.viewmat[1, :3] @ toward_viewer > 0.9  # down in the picture


def test_a_scene_is_seen_from_inside_where_the_camera_stands():
    camera = framed_camera(INSIDE, ViewConfig(size=SIZE))
    np.testing.assert_allclose(camera.position, INSIDE.eye, atol=1e-12)
    turned = framed_camera(INSIDE, ViewConfig(size=SIZE, azimuth=0.2))
    np.testing.assert_allclose(turned.position, INSIDE.eye, atol=1e-12)
    assert looks(turned)[1] @ looks(camera)[1] == pytest.approx(np.cos(0.2), abs=1e-3)
    for config in (ViewConfig(size=SIZE, look_at="subject"), ViewConfig(size=SIZE, side="front")):
        outside = framed_camera(INSIDE, config)
        assert (np.abs(pixels(outside, INSIDE.points)[0]) < 1).all()


def test_an_orbit_inside_a_scene_is_a_small_level_circle_that_begins_at_the_first_view():
    camera = framed_camera(INSIDE, ViewConfig(size=SIZE))
    cameras = framed_orbit(INSIDE, ViewConfig(size=SIZE), 12)
    np.testing.assert_allclose(cameras[0].viewmat, camera.viewmat, atol=1e-9)
    np.testing.assert_allclose([c.viewmat[0, :3] @ INSIDE.up for c in cameras], 0, atol=1e-12)
    moved = np.array([np.linalg.norm(c.position - camera.position) for c in cameras])
    assert 0.3 < moved.max() < 1.5  # of a room of 8
    assert min(looks(c)[1] @ looks(camera)[1] for c in cameras) > 0.97
    around = framed_orbit(INSIDE, ViewConfig(size=SIZE, look_at="subject"), 12)
    assert min(looks(c)[1] @ looks(around[0])[1] for c in around) < -0.8


def parsed(text):
    """`ViewConfig` of flags."""
    parser = ArgumentParser()
    flags.add_view(parser)
    return ViewConfig(size=SIZE, **flags.given(parser.parse_args(_joined(text.split())), "view"))


def test_an_orbit_of_rolled_views_has_the_scene_in_the_middle():
    cameras = framed_orbit(VIEW, ViewConfig(size=SIZE, roll=0.8, elevation=0.3), 48)
    seen = np.concatenate([pixels(camera, VIEW.points)[0] for camera in cameras])
    np.testing.assert_allclose(seen.min(axis=0), -seen.max(axis=0), atol=0.005)


@settings(max_examples=25, deadline=None)
@given(
    azimuth=st.floats(-400, 400),
    elevation=st.floats(-90, 90),
    roll=st.sampled_from([0.0, -20.3, 1.0]),
    zoom=st.sampled_from([1.0, 2.5, 1 / 3]),
    pan=st.sampled_from([(0.0, 0.0), (-0.1, 1 / 3)]),
    look_at=st.sampled_from([(None, None), ("part", None), ((-1.5, 2.0, 1 / 3), None), ((1, 2, 3), 1 / 3)]),
    up=st.sampled_from(["-y", "+z", "0.0175,-0.9998,0.0349", "1,2,3"]),
)
def test_the_flags_of_a_view_give_it_again_to_the_last_bit(azimuth, elevation, roll, zoom, pan, look_at, up):
    view = plain_first_view(SCENE, up)
    turns = {"azimuth": azimuth, "elevation": elevation, "roll": roll, "fov_y": 41.7}
    at = {"zoom": zoom, "pan": pan, "look_at": look_at[0], "distance": look_at[1]}
    config = ViewConfig(size=SIZE, **{name: radians(angle) for name, angle in turns.items()}, **at)
    again = parsed(flags_of(view, config))
    assert_same(framed_camera(plain_first_view(SCENE, again.up), again), framed_camera(view, config))


@settings(max_examples=100, deadline=None)
@given(
    up=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1), angle=st.floats(-7, 7)
)
def test_a_sayable_view_is_nearly_the_same_and_short_to_say(up, angle):
    up = np.array(up) / np.linalg.norm(up)
    view = FirstView(VIEW.points, up, angle, min(max(angle, -1.57), 1.57), front=-angle)
    said = sayable(view)
    assert said.up @ up > 1 - 1e-7
    assert said.azimuth == pytest.approx(angle, abs=radians(0.051))
    assert len(up_text(said.up)) <= 60
    np.testing.assert_array_equal(sayable(said).up, said.up)
    for axis in AXES:
        assert up_text(sayable(with_up(VIEW, axis)).up) == axis
