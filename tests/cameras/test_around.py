"""The views that strokes are made for: near a picture, along a path, and all around the subject."""

import numpy as np
import pytest

from brushgs.cameras import around
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.cameras.orbit import orbit
from brushgs.values.camera import Camera, FirstView
from brushgs.values.frame import Frame
from tests.scenes import still_life_of

UP = np.array([0.0, -1.0, 0.0])


@pytest.fixture(scope="module")
def view():
    return plain_first_view(still_life_of(1000))


@pytest.fixture(scope="module")
def inside():
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (1.0, 5.0)])
    return FirstView(corners, UP, 0.0, 0.0, eye=np.array([0.1, 0.2, 0.3]))


def seen(camera, points):
    """[n, 3] x, y in pixels and depth of points."""
    places = np.atleast_2d(points) @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    return np.column_stack([(places @ camera.K.T)[:, :2] / places[:, 2:], places[:, 2]])


def test_a_small_view_shows_the_same_edge_to_edge(view):
    camera = frame_scene(view, width=1280, height=720)
    small = around.small_view(camera)
    assert small.width * small.height == pytest.approx(around.PIXELS, rel=0.01)
    scale = (small.width / camera.width, small.height / camera.height, 1)
    np.testing.assert_allclose(seen(small, view.points), seen(camera, view.points) * scale)


def test_near_views_are_those_of_azimuths_and_elevations_near_by(view):
    def framed(right, higher):
        azimuth, elevation = view.azimuth + np.radians(right), view.elevation + np.radians(higher)
        return frame_scene(view, width=400, height=300, azimuth=azimuth, elevation=elevation)

    camera = framed(0, 0)
    found = around.near_views(camera, around.subject_ahead(camera, view), view.up)
    for near, expected in zip(found, (framed(*turn) for turn in around.NEAR), strict=True):
        np.testing.assert_allclose(near.viewmat[:3, :3], expected.viewmat[:3, :3], atol=1e-12)
    np.testing.assert_array_equal(found[0].viewmat, camera.viewmat)


def test_a_view_from_almost_straight_above_is_turned_down():
    camera = Camera.look_at((0.0, -5.0, -0.1), (0, 0, 0), width=40, height=30)
    for near in around.near_views(camera, (0, 0, 0), UP):
        assert near.viewmat[1, :3] @ UP < 0  # up in the picture is up
    camera = Camera.look_at((0.0, -5.0, 0.0), (0, 0, 0), width=40, height=30)
    assert len(around.near_views(camera, (0, 0, 0), UP)) == len(around.NEAR)


def test_near_views_of_a_place_turn_where_they_stand(inside):
    camera = frame_scene(inside, width=400, height=300)
    for near in around.near_views(camera, camera.position, inside.up):
        np.testing.assert_allclose(near.position, camera.position, atol=1e-12)


def test_the_middle_depth_of_a_picture_is_ahead():
    camera = Camera.look_at((0, 0, -7), (0, 0, 0), width=4, height=3)
    alpha, depth = np.zeros((3, 4)), np.zeros((3, 4))
    alpha[:2], depth[:2] = 0.5, 6.0
    alpha[0, 0], depth[0, 0] = 1.0, 100.0  # one stray does not count
    rgb = np.zeros((3, 4, 3))
    np.testing.assert_allclose(around.point_ahead(camera, Frame(rgb, alpha, depth)), (0, 0, -1), atol=1e-12)
    nothing = Frame(rgb, 0 * alpha, 0 * depth)
    np.testing.assert_array_equal(around.point_ahead(camera, nothing), camera.position)


def test_a_path_gives_at_most_some_of_its_views_evenly(view):
    frames = orbit(view, 48, width=400, height=300)
    assert len(around.path_views(frames)) == around.MOST_OF_PATH
    for few, many in zip(around.path_views(frames[::2]), around.path_views(frames), strict=True):
        np.testing.assert_array_equal(few.viewmat, many.viewmat)  # the frame rate does not count
    assert len(around.path_views(frames[:5])) == 5
    odd = around.path_views(frames[:13])
    assert len(odd) == around.MOST_OF_PATH
    np.testing.assert_array_equal(odd[0].viewmat, frames[0].viewmat)


@pytest.mark.parametrize(("width", "height"), [(400, 300), (300, 600)])
def test_a_ring_shows_the_whole_subject_from_all_around(view, width, height):
    ring = around.ring_views(view, width, height)
    assert len(ring) == len(around.RING)
    for camera in ring:
        x, y, depth = seen(camera, view.points).T
        assert depth.min() > camera.near
        assert 0 < x.min() < x.max() < camera.width
        assert 0 < y.min() < y.max() < camera.height
    facing = np.array([camera.viewmat[2, :3] for camera in ring])
    assert (facing @ facing.T - 2 * np.eye(len(ring))).max() < np.cos(np.radians(34))
