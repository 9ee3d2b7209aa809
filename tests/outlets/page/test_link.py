"""Links and stops of a page: views that are shared, and views with titles that it leads through."""

import json
from itertools import combinations

import numpy as np
import pytest

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.outlets.page.contents import Stop
from brushgs.outlets.page.export import MOST_STOPS, read_stops
from brushgs.outlets.page.html import Preview
from tests.kit.for_each import for_each
from tests.outlets.page.page_file import SIZE, are_apart, scene, seen, settle, shown, wait_until, write_page

CALM = {"reduced_motion": "reduce"}
COPY = {"permissions": ["clipboard-read", "clipboard-write"]}
DESKTOP = {"width": 1100, "height": 500, "device_scale_factor": 0.5}  # which shows all fields of the bar


ANGLES = ((0.2, 0.1), (1.9, 0.4), (-2.5, -0.2))


def stops():
    _, first = scene()
    cameras = [frame_scene(first, **SIZE, azimuth=azimuth, elevation=up) for azimuth, up in ANGLES]
    return [Stop(f"<b>{number}</b>", camera) for number, camera in enumerate(cameras)]


@pytest.fixture(scope="module")
def contents():
    return shown(title="pears & <b>", stops=stops())


@pytest.fixture(scope="module")
def path(tmp_path_factory, contents):
    return write_page(tmp_path_factory.mktemp("page") / "pears.html", contents)


@pytest.fixture(scope="module")
def page(open_shared_page, path):
    tab = open_shared_page(path, **CALM, **COPY, **DESKTOP, is_drawn=False)
    tab.evaluate("brushgs.ready")
    return tab


def follow(page, link):
    page.evaluate("link => { location.hash = link; }", link)
    settle(page)


def test_a_link_shows_what_was_shown(page, contents):
    page.locator("#share").fill("40")
    page.locator("#ground").select_option("Black")
    for key in ("ArrowLeft", "ArrowUp", "+", "Shift+ArrowRight"):
        page.locator("#painting").press(key)
    settle(page)
    before = seen(page, contents.header).viewmat
    page.locator("#link").press("Enter")  # which wakes the bar, where it has faded
    link = page.locator("#linkText").input_value()
    code = page.locator("#embedText").input_value()  # for another page: it holds no markup of a title
    assert code.startswith('<iframe src="file://')
    assert 'title="pears &#38; &#60;b&#62;"' in code
    assert link.startswith(page.url.split("#")[0] + "#view=")
    page.locator("#copyLink").click()
    assert page.evaluate("navigator.clipboard.readText()") == link
    wait_until(page, "document.getElementById('notice').textContent === 'Link copied'")
    page.evaluate("brushgs.controls.home()")
    page.locator("#share").fill("100")
    page.locator("#ground").select_option("As painted")
    settle(page)
    follow(page, link.split("#")[1])
    assert np.abs(seen(page, contents.header).viewmat - before).max() < 1e-3
    assert page.evaluate("[brushgs.look.share, brushgs.panel.groundChoice]") == [0.4, "black"]


@for_each(
    "link",
    [
        "view=", "view=1,2,3", "view=a,b,c,d,e,f", "view=0,0,0,0,0,0", "view=0,0,-1,0,0,0",
        "view=NaN,0,1,0,0,0", "view=1e999,0,1,0,0,0", "share=0&brush=99&ground=<b>",
        "share=1e9&brush=-1&ground=%00", "%E0%A4%A&=&&",
    ],
)  # fmt: skip
def test_a_link_that_says_nothing_changes_nothing(page, link):
    page.evaluate("brushgs.controls.home()")
    follow(page, "view=0,0,1,0,0,0")
    said = "[[...brushgs.controls.target], brushgs.look.share, brushgs.panel.groundChoice]"
    before = page.evaluate(said)
    follow(page, link)
    assert page.evaluate(said) == before


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


def test_the_way_is_slow_and_ends_where_a_hand_stops_it(open_page, path, contents):
    page = open_page(path, is_drawn=False)
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


def test_stops_caption_notice_and_bar_do_not_overlap(open_page, contents, tmp_path):
    caption = "Three pears on a table, painted after a scan of the fruit in the museum of the town"
    path = write_page(tmp_path / "pears.html", contents, preview=Preview(caption))
    page = open_page(path, **CALM, is_drawn=False)
    page.evaluate("brushgs.ready")
    page.evaluate("brushgs.stops.stops.forEach((stop) => { stop.title = 'a view that has a long title'; })")
    page.locator("#stopAfter").click()
    for width, height in ((280, 653), (390, 844), (700, 400), (844, 390), (1280, 720)):
        page.set_viewport_size({"width": width, "height": height})
        page.evaluate("brushgs.panel.say('Camera saved: brushgs render … --camera-file view.json')")
        boxes = [page.locator(f"#{id_}").bounding_box() for id_ in ("stops", "caption", "notice", "bar")]
        for box in boxes:
            assert box["x"] >= 0, (width, box)
            assert box["x"] + box["width"] <= width, (width, box)
        for a, b in combinations(boxes, 2):
            assert are_apart(a, b), (width, a, b)
        assert width > 640 or boxes[1]["width"] > 0.85 * width, width


def test_stops_are_read_from_camera_files(tmp_path):
    camera = {"width": 64, "height": 48, "fx": 50, "fy": 50, "rotation": np.eye(3).tolist()}
    path = tmp_path / "cameras.json"
    numbers = range(MOST_STOPS + 1)
    views = [camera | {"position": [n, 0, 0], "img_name": f"dir/pear {n}.jpg"} for n in numbers]
    path.write_text(json.dumps(views[:2]))
    found = read_stops(path)
    assert [stop.title for stop in found] == ["pear 0", "pear 1"]
    assert found[1].camera.position.tolist() == [1, 0, 0]
    path.write_text(json.dumps(views))
    with pytest.raises(bg.SceneError, match="has 100 views, and a page leads through at most 99"):
        read_stops(path)
