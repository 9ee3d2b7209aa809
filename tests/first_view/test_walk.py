"""Captures that surround who took them are seen from among their things, all others as they are."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.core.threads import at_most
from brushgs.first_view import find_first_view, walk
from brushgs.first_view.usable import Judge
from brushgs.first_view.walk import inside_stand, other_stands
from brushgs.values.camera import FirstView
from brushgs.values.colors import LUMINANCE
from tests.first_view.made_walks import HIGH, LONG, WIDE, street
from tests.first_view.scenes import about, gaussians, joined, moved, on_a_plaza, statue, statue_view
from tests.kit.for_each import for_each
from tests.scenes import real_scene

UP = "-y"


@cache
def street_view() -> FirstView:
    return find_first_view(street(), up=UP)


def measured(scene: bg.Gaussians, camera: bg.Camera) -> tuple[float, float, float]:
    """Share of covered pixels, mean gradient of luminance, and paint of strokes larger than a third of all.

    From a plain picture of the whole scene, in a second one of which these strokes are white, others black.
    """
    frame = bg.render(scene, camera, "gaussian", depth=False)
    shades = np.clip(frame.rgb, 0, 1) @ np.array(LUMINANCE)
    gradient = np.hypot(np.diff(shades, axis=0)[:, :-1], np.diff(shades, axis=1)[:-1]).mean()
    boxes = bg.project(scene, camera, num_sigmas=2.0)
    is_large = np.pi * boxes.half_extents.prod(axis=1) > camera.width * camera.height / 3
    white = replace(scene, sh=np.full_like(scene.sh[:, :1], -0.5 / 0.28209479))
    white.sh.setflags(write=True)
    white.sh[boxes.ids[is_large]] = 0.5 / 0.28209479
    veil = bg.render(white, camera, "gaussian", depth=False).rgb.mean()
    return float((frame.alpha > 0.9).mean()), float(gradient), float(veil)


def assert_usable(scene, view):
    covered, gradient, veil = measured(scene, frame_scene(view, width=160, height=90))
    assert covered > 0.9
    assert gradient > 0.02
    assert veil < 0.2


def test_a_street_is_seen_from_where_one_walks_in_it_and_from_two_more_places():
    view = street_view()
    x, y, z = view.eye
    assert abs(x) < WIDE
    assert -HIGH < y < -0.5
    assert abs(z) < LONG
    assert_usable(street(), view)
    for azimuth in (0, 1.6):
        outside = frame_scene(replace(view, eye=None), width=160, height=90, elevation=0.3, azimuth=azimuth)
        assert measured(street(), outside)[0] < 0.9
    others = other_stands(street(), view)
    assert len(others) >= 2
    for stand in others:
        turned = replace(view, azimuth=stand.azimuth, elevation=stand.elevation)
        assert_usable(street(), replace(turned, eye=stand.eye))
        is_apart = np.linalg.norm(stand.eye - view.eye) > 1
        assert is_apart or np.cos(stand.azimuth - view.azimuth) < 0.8


def test_unit_place_threads_and_a_given_azimuth_do_not_move_the_eye():
    scale = 1e-3
    offset = np.array([7.0, -3.0, 20.0]) * scale
    view = find_first_view(moved(street(), scale=scale, offset=offset), up=UP)
    assert view.eye == pytest.approx(scale * street_view().eye + offset, rel=1e-3)
    assert (view.azimuth, view.elevation) == pytest.approx((street_view().azimuth, street_view().elevation))
    with at_most(1):
        one = find_first_view(street(), up=UP, azimuth=1.0)
    assert np.array_equal(one.eye, street_view().eye)
    assert (one.elevation, one.azimuth) == (street_view().elevation, 1.0)


def test_a_turned_street_is_seen_from_inside_too():
    turned = moved(street(), rotation=about((1, 0, 0), -90) @ about((0, 1, 0), 30))
    view = find_first_view(turned, up="+z")
    assert view.eye is not None
    assert measured(turned, frame_scene(view, width=160, height=90))[0] > 0.9


@for_each("scene", [statue, on_a_plaza])
def test_what_is_clear_from_outside_is_not_searched(scene, monkeypatch):
    monkeypatch.setattr(walk, "find_stands", lambda *_: pytest.fail("searched"))
    view = replace(statue_view(), points=scene().means[::50].astype(np.float64))
    assert inside_stand(scene(), view) is None


def test_a_kitchen_that_was_moved_is_seen_from_inside():
    """The view from the origin, which such captures have, is lost: one as good is found."""
    kitchen = bg.load(real_scene("moving/cook_spinach.splatv"))
    kitchen = moved(kitchen, rotation=about((0, 1, 0), 70), offset=(40, 5, -30))
    view = find_first_view(kitchen, up=UP)
    assert view.eye is not None
    assert_usable(kitchen, view)


def test_a_large_floater_before_the_lens_veils_a_picture():
    camera = frame_scene(street_view(), width=64, height=36)
    place = camera.position + 2.0 * camera.viewmat[2, :3]
    floater = gaussians(place[None], -camera.viewmat[2:3, :3], 2.0, np.ones((1, 3)), 0.6)
    shown, veiled = (Judge(scene, 10_000)(camera) for scene in (street(), joined(street(), floater)))
    assert shown.is_usable
    assert not veiled.is_usable
    assert veiled.veiled > shown.veiled + 0.3
    assert veiled.clear < shown.clear
