"""The first view by the cameras of the photographs: taken where they fit the scene, refused where not."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import camera_axes
from brushgs.first_view.photographed import UnfitError, photographed_view, up_of_views
from brushgs.formats.cameras.read import read_beside
from tests.first_view.scenes import about, moved, statue
from tests.first_view.test_framing import relief
from tests.kit.for_each import for_each
from tests.scenes import real_scene

MIDDLE = np.array([0.0, -0.7, 0.0])  # of the statue, roughly
TURN = about((1, 2, 3), 40.0)  # up is then no axis


def photographs(num=40, *, low=5.0, high=25.0, arc=360.0, away=3.2, roll=3.0, aim=3.0, middle=MIDDLE):
    """Handheld cameras around the statue, radians and degrees as people hold them."""
    rng = np.random.default_rng(3)
    cameras = []
    for number in range(num):
        azimuth, elevation = np.radians([arc * number / num, rng.uniform(low, high)])
        axes = camera_axes(np.array([0.0, -1.0, 0.0]), azimuth, elevation)
        place = middle - away * rng.uniform(0.9, 1.1) * axes[2]
        for axis, spread in ((1, aim), (0, aim), (2, roll)):
            axes = about(np.eye(3)[axis], rng.normal(0, spread)) @ axes
        viewmat = np.eye(4)
        viewmat[:3, :3], viewmat[:3, 3] = axes, -axes @ place
        cameras.append(bg.Camera(viewmat, np.array([[120.0, 0, 80], [0, 120, 60], [0, 0, 1]]), 160, 120))
    return cameras


def moved_cameras(cameras, *, rotation=None, scale=1.0, offset=(0.0, 0.0, 0.0)):
    """The same cameras before a scene that was rotated, scaled, then shifted."""
    rotation = np.eye(3) if rotation is None else rotation
    found = []
    for camera in cameras:
        viewmat = np.eye(4)
        viewmat[:3, :3] = camera.viewmat[:3, :3] @ rotation.T
        viewmat[:3, 3] = -viewmat[:3, :3] @ (scale * rotation @ camera.position + offset)
        found.append(replace(camera, viewmat=viewmat))
    return found


def test_the_view_is_that_of_a_camera_near_the_front_and_up_an_axis():
    cameras = photographs()
    view = photographed_view(statue(), cameras)
    assert np.array_equal(view.up, (0, -1, 0))
    assert view.eye is None
    assert view.probability is None
    assert abs(view.azimuth) < np.radians(45)
    assert np.radians(5) <= view.elevation <= np.radians(25)
    assert view.stood is not None
    assert len(view.stood) == len(cameras)
    assert np.array([view.azimuth, view.elevation]) in view.stood
    given = photographed_view(statue(), cameras, up=np.array([0.0, -1.0, 0.0]), azimuth=np.radians(200))
    assert abs(given.azimuth - np.radians(200 - 360)) < np.radians(30)


def test_photographs_of_one_side_decide_the_azimuth():
    turned = moved_cameras(photographs(arc=60), rotation=about((0, 1, 0), -100.0))
    view = photographed_view(statue(), turned)
    assert np.array_equal(view.up, (0, -1, 0))
    assert np.radians(90) < np.abs(view.azimuth) < np.radians(175)


def test_up_of_cameras_is_found_where_no_axis_of_the_scene_is_up():
    scene = moved(statue(), rotation=TURN, scale=30.0, offset=(5.0, -40.0, 9.0))
    cameras = moved_cameras(photographs(), rotation=TURN, scale=30.0, offset=(5.0, -40.0, 9.0))
    up = photographed_view(scene, cameras).up
    assert np.degrees(np.arccos(up @ TURN @ (0, -1, 0))) < 2.0


def test_a_scene_that_is_seen_from_inside_is_seen_from_where_a_camera_stood():
    axes = [about((0, 1, 0), angle) for angle in (-8.0, -4.0, 0.0, 4.0, 8.0)]
    cameras = []
    for number, turn in enumerate(axes):
        viewmat = np.eye(4)
        viewmat[:3, :3] = turn
        viewmat[:3, 3] = -turn @ (0.05 * (number - 2), 0.01, 0.02)
        cameras.append(bg.Camera(viewmat, np.array([[90.0, 0, 60], [0, 90, 45], [0, 0, 1]]), 120, 90))
    view = photographed_view(relief(), cameras)
    assert view.eye is not None
    assert min(np.abs(view.eye - camera.position).max() for camera in cameras) < 1e-12
    assert np.abs(view.eye).max() > 0


@for_each(
    ("cameras", "why"),
    [
        (photographs(2), r"^it holds only 2 cameras$"),
        (moved_cameras(photographs(), offset=(9.0, 0, 0)), r"only \d+ of its 40 cameras see the middle"),
        (moved_cameras(photographs(), offset=(0.7, 0, 0.0)), "look past the middle of the subject"),
        (photographs(away=20.0), r"the scene fills \d% of the picture of its best camera, not \d+% or more"),
        (photographs(roll=60.0), "do not agree on which way is up"),
        (
            moved_cameras(photographs(middle=np.zeros(3)), rotation=about((1, 0, 0), 180.0), offset=MIDDLE),
            r"its cameras have \+y up, and the scene more likely -y",
        ),
    ],
)
def test_cameras_that_do_not_fit_are_refused_and_why(cameras, why):
    with pytest.raises(UnfitError, match=why):
        photographed_view(statue(), cameras)
    with pytest.raises(UnfitError, match=r"its cameras have -y up, and \+z is stated"):
        photographed_view(statue(), photographs(), up=np.array([0.0, 0.0, 1.0]))


REAL = [
    ("koala.ply", "derived/koala_cameras.json", (0, -1, 0)),
    ("chair.splat", "nerf_synthetic_cameras.json", (0, 0, 1)),
    ("koala.ply", "koala_cameras_original.json", None),
    ("rubber_toy_cloud.ply", "nerfstudio_transforms.json", None),
]


@for_each(("scene", "cameras", "up"), REAL)
def test_real_cameras_fit_their_scene_and_no_other(scene, cameras, up):
    gaussians, found = bg.load(real_scene(scene)), read_beside(real_scene(cameras))
    if up is None:
        with pytest.raises(UnfitError):
            photographed_view(gaussians, found)
    else:
        assert np.array_equal(photographed_view(gaussians, found).up, up)


@for_each("count", [1, 2, 40])
@for_each(("axis", "degrees"), [((1, 0, 0), 0.0), ((1, 0, 0), 90.0), ((0, 0, 1), 180.0)])
def test_given_views_tell_which_way_is_up_whatever_the_scene_looks_like(count, axis, degrees):
    turn = about(axis, degrees)
    cameras = moved_cameras(photographs(count), rotation=turn)
    up = up_of_views(moved(statue(), rotation=turn), cameras)
    np.testing.assert_allclose(up, turn @ (0, -1, 0), atol=1e-9)
