"""What hangs below an object is dropped, and its feet, legs, stands and ground are kept."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene, plain_first_view
from brushgs.first_view import find_first_view
from brushgs.passes.reduce.crumbs import find_crumbs
from brushgs.rendering.visibility import visible_areas
from brushgs.values.gaussians import Gaussians
from tests.kit.for_each import for_each
from tests.passes.scenes import gaussians_at, rescaled
from tests.scenes import real_scene

UP = np.array([0.0, 0.0, 1.0])
# Scene -> up, and the share of its picture that is dropped, at least and at most.
SCENES = {
    "koala.ply": ("-y", 0.01, 0.12),  # the underside of a sheet of paper
    "plant.splat": ("-y", 0.004, 0.015),  # the reflection of a pot
    "truck.splat": ("-y", 0.0, 0.0),
}


def small(means, scales):
    return gaussians_at(means, scales, dtype=np.float32)


def block(seed=0):
    """The surface of a box that stands on z = 0, 1 wide and 1.5 high."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (4000, 3))
    axis = rng.integers(0, 3, 4000)
    points[np.arange(4000), axis] = np.sign(points[np.arange(4000), axis]) * 0.5
    return small((points + np.array([0, 0, 0.5])) * (1, 1, 1.5), 0.012)


def smears(num=12):
    """Coarse streaks at the level of the floor that hang down from it."""
    places = np.random.default_rng(1).uniform(-0.3, 0.3, (num, 2))
    return small(np.column_stack([places, np.full(num, 0.02)]), (0.03, 0.03, 0.1))


@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_what_hangs_below_is_found_and_the_object_is_kept(unit):
    scene = Gaussians.joined([block(), smears(), small([[0, 0, -0.15]], 0.05)])
    scene = rescaled(scene, unit)
    view = plain_first_view(scene.take(np.arange(len(scene)) < 4000), UP)
    expected = np.arange(len(scene)) >= 4000
    np.testing.assert_array_equal(find_crumbs(scene, view), expected)
    upside_down = plain_first_view(scene.take(~expected), -UP)
    assert not find_crumbs(scene, upside_down)[:4000].any()


@pytest.mark.parametrize("fields", [{"has_surroundings": True}, {"eye": np.zeros(3)}])
def test_surroundings_and_rooms_have_no_crumbs(fields):
    scene = Gaussians.joined([block(), smears()])
    view = plain_first_view(block(), UP)
    assert find_crumbs(scene, view).any()
    assert not find_crumbs(scene, replace(view, **fields)).any()
    assert not find_crumbs(scene, replace(view, points=view.points[:1])).any()


@for_each("name", SCENES)
def test_real_scenes_lose_what_hangs_and_no_more(name):
    up, least, most = SCENES[name]
    scene = bg.clean(bg.load(real_scene(name)))
    view = find_first_view(scene, up=up, azimuth=0.0)  # with what is attached to the object, such as legs
    camera = frame_scene(view, width=240, height=240)
    areas = visible_areas(scene, camera)
    share = float(areas[find_crumbs(scene, view)].sum() / areas.sum())
    assert least <= share <= most
