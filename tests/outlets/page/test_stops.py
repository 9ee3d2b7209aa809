"""Stops of a page: views with titles that it leads through."""

import json

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.outlets.page.contents import Stop
from brushgs.outlets.page.export import MOST_STOPS, read_stops
from tests.outlets.page.page_file import SIZE, scene, seen, settle, shown, wait_until, write_page

CALM = {"reduced_motion": "reduce"}
ANGLES = ((0.2, 0.1), (1.9, 0.4), (-2.5, -0.2))


def stops():
    _, first = scene()
    cameras = [frame_scene(first, **SIZE, azimuth=azimuth, elevation=up) for azimuth, up in ANGLES]
    return [Stop(f"<b>{number}</b>", camera) for number, camera in enumerate(cameras)]


@pytest.fixture(scope="module")
def contents():
    return shown(stops=stops())


@pytest.fixture(scope="module")
def page(open_shared_page, tmp_path_factory, contents):
    tab = open_shared_page(write_page(tmp_path_factory.mktemp("page") / "stops.html", contents), **CALM)
    tab.evaluate("brushgs.ready")
    return tab


def assert_at(page, contents, place):
    settle(page)
    assert np.abs(seen(page, contents.header).viewmat - stops()[place].camera.viewmat).max() < 1e-6
    assert page.locator("#stopText").inner_text() == f"{place + 1}/3 <b>{place}</b>"


def test_buttons_and_keys_lead_to_the_views_of_the_stops(page, contents):
    page.locator("#stopAfter").click()
    assert_at(page, contents, 0)
    page.keyboard.press("PageDown")
    assert_at(page, contents, 1)
    page.keyboard.press("3")
    assert_at(page, contents, 2)
    page.locator("#stopAfter").click()  # the last is followed by the first
    assert_at(page, contents, 0)
    page.keyboard.press("PageUp")
    assert_at(page, contents, 2)
    page.keyboard.press("9")  # of which there is none
    assert_at(page, contents, 2)


def test_the_way_is_slow_and_ends_where_a_hand_stops_it(open_page, tmp_path, contents):
    page = open_page(write_page(tmp_path / "a.html", contents))
    page.evaluate("brushgs.ready")
    page.evaluate("brushgs.stops.go(1)")
    wait_until(page, "brushgs.controls._travel?.passed > 0.2")
    state = page.evaluate("[...brushgs.controls.state]")
    to = page.evaluate("[...brushgs.controls._travel.to]")
    assert not np.allclose(state, to, atol=1e-3)
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("brushgs.controls._travel") is None
    page.evaluate("brushgs.stops.go(1)")
    wait_until(page, "brushgs.controls._travel === null")
    settle(page)
    assert np.abs(seen(page, contents.header).viewmat - stops()[1].camera.viewmat).max() < 1e-6


def test_a_page_without_stops_shows_none(open_page, tmp_path):
    page = open_page(write_page(tmp_path / "a.html", shown()), **CALM)
    page.evaluate("brushgs.ready")
    assert not page.locator("#stops").is_visible()
    assert page.evaluate("brushgs.stops.press('PageDown')") is False


def trained(count):
    camera = {"width": 64, "height": 48, "fx": 50, "fy": 50, "rotation": np.eye(3).tolist()}
    names = [f"dir/pear {number}.jpg" for number in range(count)]
    return [camera | {"position": [number, 0, 0], "img_name": name} for number, name in enumerate(names)]


def test_stops_are_read_from_camera_files(tmp_path):
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps(trained(2)))
    found = read_stops(path)
    assert [stop.title for stop in found] == ["pear 0", "pear 1"]
    assert found[1].camera.position.tolist() == [1, 0, 0]
    path.write_text(json.dumps(trained(MOST_STOPS + 1)))
    with pytest.raises(bg.SceneError, match="has 100 views, and a page leads through at most 99"):
        read_stops(path)
