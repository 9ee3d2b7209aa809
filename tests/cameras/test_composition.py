"""Composed pictures: a format by what is framed, and a subject set into it with room for look and shadow."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import brushgs as bg
from brushgs.cameras.composition import SIZES, composed, format_name
from brushgs.cameras.first_view import flags_of, framed_camera, sayable
from brushgs.cameras.framing import camera_axes
from brushgs.cli.configs import paint_config
from brushgs.cli.parser import command_parser
from brushgs.first_view import find_first_view
from brushgs.options.painting import DEFAULT_SIZE, ViewConfig
from brushgs.values.camera import FirstView
from tests.cameras.test_first_view import INSIDE, assert_same
from tests.kit.for_each import for_each
from tests.scenes import real_scene

UP = np.array([0.0, -1.0, 0.0])
LEFT_LAMP = np.array([-0.75, -0.95, 0.0])  # of a view at azimuth 0: the shadow falls to the right
LEAST, MOST = 0.55, 0.70  # of the picture's width or height, whichever binds, that a subject takes
# Object -> its up axis, where it is not the first view's to find.
OBJECTS = {"koala.ply": "-y", "chair.splat": "+z"}


def standing(width: float, height: float, depth: float, **fields: object) -> FirstView:
    """The first view of a box of such a size."""
    corners = np.stack(np.meshgrid(*[(-0.5, 0.5)] * 3), axis=-1).reshape(-1, 3) * (width, height, depth)
    return replace(FirstView(corners + np.array([3.0, -4, 5]), UP, 0.0, radians(15)), **fields)


def bounds(camera: bg.Camera, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The bounds of points in shares of the picture, from its upper left corner."""
    seen = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    assert (seen[:, 2] > camera.near).all()
    places = (seen @ camera.K.T)[:, :2] / seen[:, 2:] / (camera.width, camera.height)
    return places.min(axis=0), places.max(axis=0)


def picture(view: FirstView, config: ViewConfig | None = None, lamp: np.ndarray | None = None) -> bg.Camera:
    return framed_camera(view, composed(view, config or ViewConfig(), lamp))


def middle(view: FirstView, config: ViewConfig | None = None, lamp: np.ndarray | None = None) -> np.ndarray:
    low, high = bounds(picture(view, config, lamp), view.points)
    return 0.5 * (low + high)


@settings(max_examples=40, deadline=None)
@given(
    st.tuples(*[st.floats(0.1, 10)] * 3).filter(lambda sides: sides[1] > 0.2 * max(sides[::2])),
    st.floats(-180, 180),
    st.floats(-20, 90),
    st.floats(10, 90),
    st.booleans(),
    st.sampled_from([1e-3, 1.0, 1e4]),
)
def test_a_subject_of_any_shape_fills_its_picture_and_stands_low(sides, azimuth, elevation, fov, lit, unit):
    view = standing(*(unit * side for side in sides), azimuth=radians(azimuth), elevation=radians(elevation))
    view = replace(view, points=unit * view.points)
    config = ViewConfig(fov_y=radians(fov))
    camera = picture(view, config, LEFT_LAMP if lit else None)
    low, high = bounds(camera, view.points)
    assert LEAST < (high - low).max() < MOST
    assert low.min() > 0.05
    assert high.max() < 0.95
    if elevation < 45:
        assert 0.8 < high[1] < 0.9
    assert abs(camera.width * camera.height / 921_600 - 1) < 2e-3


def test_the_format_is_that_of_what_is_framed_with_its_shadow():
    def size(*sides: float, lamp: np.ndarray | None = None) -> tuple[int, int]:
        camera = picture(standing(*sides), None, lamp)
        return camera.width, camera.height

    names = [format_name(*size(*sides)) for sides in ((0.3, 1, 0.3), (1, 1, 0.3), (3, 0.8, 0.5))]
    assert names == ["portrait", "square", "landscape"]
    wides = [width / height for width, height in (size(w, 1, 0.3) for w in (0.1, 0.4, 0.8, 1.5, 3, 5))]
    assert wides == sorted(wides)
    assert {size(w, 1, 0.3) for w in np.geomspace(0.1, 5, 40)} == set(SIZES)
    assert size(0.5, 1, 0.3, lamp=LEFT_LAMP)[0] > size(0.5, 1, 0.3)[0]


def test_there_is_more_room_where_a_subject_looks_and_where_its_shadow_falls():
    plain = standing(1, 1, 1)
    assert middle(plain)[0] == pytest.approx(0.5, abs=1e-3)
    assert middle(plain, None, LEFT_LAMP)[0] < 0.48
    assert middle(plain, None, LEFT_LAMP * (-1, 1, 1))[0] > 0.52
    right, left = (replace(plain, front=front) for front in (1.0, -1.0))  # azimuths grow to the right
    assert middle(right)[0] < 0.47
    assert middle(left)[0] > 0.53
    asked = ViewConfig(azimuth=0.0)  # where an azimuth is asked for no front is searched
    assert middle(right, asked)[0] == pytest.approx(0.5, abs=1e-3)


def test_the_flags_of_a_composed_picture_give_it_again():
    view = sayable(standing(1, 2, 0.7, azimuth=0.6, front=0.2, up=np.array([0.1, -0.9, 0.2])))
    turned = ViewConfig(roll=radians(5), pan=(0.1, 0.2))
    for config in (ViewConfig(), ViewConfig(side="left", zoom=1.3), turned):
        found = composed(view, config, LEFT_LAMP)
        width, height = found.size
        words = f"--size {width}x{height} {flags_of(view, found)}".split()
        again = paint_config(command_parser("render").parse_args(["a.ply", *words])).view
        assert_same(framed_camera(view, again), framed_camera(view, found))


def test_a_zoom_is_about_where_the_subject_stands_and_a_pan_moves_it():
    view = standing(1, 1.5, 0.5, front=1.0)
    place = middle(view)
    for zoom in (0.5, 2.0):
        camera = picture(view, ViewConfig(zoom=zoom))
        low, high = bounds(camera, view.points)
        np.testing.assert_allclose(0.5 * (low + high), place, atol=2e-3)
        one = bounds(picture(view), view.points)
        np.testing.assert_allclose((high - low) / (one[1] - one[0]), zoom, rtol=0.05)
    np.testing.assert_allclose(middle(view, ViewConfig(pan=(0.1, 0))), place - (0.1, 0), atol=0.03)


@for_each(
    ("view", "config"),
    [
        (INSIDE, ViewConfig()),
        (standing(1, 1, 1, has_surroundings=True), ViewConfig()),
        (standing(1, 1, 1), ViewConfig(look_at="part")),
        (standing(1, 1, 1), ViewConfig(look_at=(0.0, 1.0, 2.0), distance=3.0)),
    ],
    ids=["inside", "surroundings", "part", "point"],
)
def test_what_fills_its_picture_or_is_placed_is_framed_as_ever(view, config):
    assert_same(picture(view, config, LEFT_LAMP), framed_camera(view, replace(config, size=DEFAULT_SIZE)))


def test_flat_land_gets_a_format_and_is_as_large_as_fits():
    land = standing(1, 0.05, 1.6, elevation=radians(40))
    found = composed(land, ViewConfig(), LEFT_LAMP)
    assert found.look_at is None
    assert found.size != DEFAULT_SIZE
    assert_same(framed_camera(land, found), framed_camera(land, ViewConfig(size=found.size)))


@for_each("name", OBJECTS)
def test_real_objects_fill_their_pictures_by_their_paint(name):
    scene = bg.clean(bg.load(real_scene(name)))
    view = find_first_view(scene, up=OBJECTS[name], azimuth=0.5)
    right, down, away = camera_axes(view.up, view.azimuth, 0.0)
    camera = picture(view, None, -0.75 * right - 0.95 * down - 0.55 * away)
    scale, room = 0.2, 1.6  # of the picture, and of what is seen around it
    width, height = round(scale * room * camera.width), round(scale * room * camera.height)
    K = np.diag([scale, scale, 1]) @ camera.K
    K[:2, 2] = 0.5 * width, 0.5 * height
    around = replace(camera, K=K, width=width, height=height)
    alpha = bg.render(scene, around, "gaussian", num_threads=1).alpha.astype(np.float64)
    extents, cropped = [], 0.0
    for axis in (0, 1):
        share = np.cumsum(alpha.sum(axis=axis)) / alpha.sum()
        places = 0.5 + room * (np.arange(1, len(share) + 1) / len(share) - 0.5)
        first, last = np.interp((0.01, 0.99), share, places)
        extents.append(last - first)
        cropped += float(np.interp(0, places, share) + 1 - np.interp(1, places, share))
    assert LEAST < max(extents) < MOST
    assert cropped < 0.01
