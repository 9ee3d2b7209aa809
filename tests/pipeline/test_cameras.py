"""The public cameras of Gaussians in memory are those that paintings are seen by."""

from math import degrees, radians

import numpy as np
import pytest

import brushgs as bg
from brushgs.options.painting import PaintConfig, ViewConfig
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from tests.cameras.test_first_view import assert_same
from tests.kit import for_each, still_life_of

SIZE = {"width": 96, "height": 64}
PEARS = still_life_of(1000)


def cameras_of(views=None, **view):
    """The cameras of a painting, without painting it."""
    config = PaintConfig(view=ViewConfig(size=(96, 64), **view))
    return prepare(PEARS, config, Report(), views=views, asks=["cameras"]).cameras


@for_each(
    "view",
    [
        {},
        {"side": "back", "zoom": 2.0},
        {"up": "+z", "azimuth": 0.5, "elevation": -0.2, "fov_y": radians(30), "pan": (0.1, 0.0), "roll": 0.1},
        {"look_at": (0.1, -1.0, 0.0), "distance": 4.0},
    ],
)
def test_a_scene_is_framed_as_its_painting_is(view):
    angles = {"azimuth": "azimuth_deg", "elevation": "elevation_deg", "fov_y": "fov_deg", "roll": "roll_deg"}
    ours = {angles.get(name, name): degrees(x) if name in angles else x for name, x in view.items()}
    framed, painted = bg.frame_scene(PEARS, **SIZE, **ours), cameras_of(**view)[0]
    np.testing.assert_allclose(framed.viewmat, painted.viewmat, atol=1e-12)
    np.testing.assert_allclose(framed.K, painted.K, rtol=1e-12)


@for_each("name", ["azimuth", "elevation", "fov_y", "roll"])
def test_radians_of_old_names_are_taken_with_a_warning(name):
    new = f"{name.removesuffix('_y')}_deg"
    words = f"{name} in radians is now {new} in degrees; write {new}=28.6479"
    with pytest.warns(DeprecationWarning, match=words):
        old = bg.frame_scene(PEARS, **SIZE, **{name: 0.5})
    now = bg.frame_scene(PEARS, **SIZE, **{new: degrees(0.5)})
    np.testing.assert_allclose(old.viewmat, now.viewmat, atol=1e-12)


def test_an_orbit_is_that_of_the_command():
    cameras = cameras_of(PathConfig(orbit=5), zoom=1.3)
    pairs = list(zip(bg.orbit(PEARS, 5, **SIZE, zoom=1.3), cameras, strict=True))
    assert len(pairs) == 5
    for one, other in pairs:
        assert_same(one, other)


def test_any_three_numbers_are_a_point_to_look_at():
    points = [(0, -1, 0), [0, -1, 0], np.array([0.0, -1, 0])]
    first, *others = [bg.frame_scene(PEARS, **SIZE, look_at=point) for point in points]
    for other in others:
        assert_same(first, other)
    x, y, z = first.viewmat[:3, :3] @ (0, -1, 0) + first.viewmat[:3, 3]
    np.testing.assert_allclose((x, y), 0, atol=1e-12)
    assert z > 0


@for_each(
    ("view", "error", "sentence"),
    [
        (lambda: bg.frame_scene(PEARS[:0]), ValueError, "frame_scene: gaussians must have at least one row"),
        (lambda: bg.orbit(PEARS[:0], 3), ValueError, "orbit: gaussians must have at least one row, got none"),
        (lambda: bg.orbit(PEARS, 3, angle=1), TypeError, "has no keyword 'angle'"),
        (lambda: bg.frame_scene(PEARS, fov_deg=180), ValueError, "fov-deg must be above 0 and below 180"),
        (lambda: bg.frame_scene(PEARS, azimuth_deg=0, side="left"), ValueError, "be combined with side"),
    ],
)
def test_views_that_are_none_are_refused(view, error, sentence):
    with pytest.raises(error, match=sentence):
        view()
