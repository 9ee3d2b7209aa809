"""The bar of a page: what it offers, to whom, and that it fades."""

import base64
import json
import re

import numpy as np
import pytest

import brushgs as bg
from tests.outlets.page.page_file import (
    pixels,
    scene,
    seen,
    settle,
    shown,
    violations,
    wait_until,
    write_page,
)

CALM = {"reduced_motion": "reduce"}
DESKTOP = {"width": 1100, "height": 500}
COPY = {"permissions": ["clipboard-read", "clipboard-write"]}
BUTTONS = {
    "turn": "Turn by itself",
    "home": "Reset to the first view",
    "link": "Share this view",
    "savePicture": "Save picture",
    "full": "Full screen",
    "keys": "Help: keys and gestures",
}
IS_SHOWN = "!document.getElementById('bar').classList.contains('is-faded')"
TITLE = "pears & <b>apples</b>"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    contents = shown(title=TITLE)
    brush = contents.header["brushes"][0]
    contents.header["brushes"].append(brush | {"name": "<i>dab</i>"})
    return write_page(tmp_path_factory.mktemp("page") / "pears.html", contents)


@pytest.fixture(scope="module")
def opened(open_shared_page, path):
    page = open_shared_page(path, **CALM, **DESKTOP, **COPY)
    page.evaluate("brushgs.ready")
    return page


@pytest.fixture
def page(opened):
    """A calm page of a desktop, as it was opened."""
    opened.bring_to_front()
    opened.evaluate(
        """() => {
          document.activeElement.blur();
          brushgs.controls.home();
          brushgs.setLook({ share: 1, brush: null, ground: true });
        }"""
    )
    settle(opened)
    point_at_bar(opened)
    return opened


def point_at_bar(page):
    """Rest the pointer on the bar, so that it stays."""
    page.mouse.move(0, 0)
    wait_until(page, IS_SHOWN)
    box = page.locator("#bar").bounding_box()
    page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
    wait_until(page, "brushgs.panel._isPointedAt")


def test_all_that_can_be_used_has_a_name_and_is_large_enough_to_touch(page):
    for id_, name in BUTTONS.items():
        button = page.get_by_role("button", name=name, exact=True)
        assert button.get_attribute("id") == id_
        box = button.bounding_box()
        assert min(box["width"], box["height"]) >= 40
        assert page.locator(f"#{id_}").inner_text().strip().lower() in name.lower() + " commands"
    for role, name in (("slider", "Strokes"), ("combobox", "Brush"), ("combobox", "Ground")):
        box = page.get_by_role(role, name=name).bounding_box()
        assert box["height"] >= 40
    picture = page.get_by_role("application", name=f"{TITLE}: a painting of 1,131 strokes", exact=True)
    assert picture.get_attribute("id") == "painting"
    snapshot = page.locator("body").aria_snapshot()
    assert 'region "Controls"' in snapshot or "region: Controls" in snapshot
    assert not re.search(r"- (button|slider|combobox|textbox)(:|$)", snapshot), "something has no name"


@pytest.mark.parametrize("dialog", [None, "link", "keys"])
def test_axe_finds_nothing(page, dialog):
    if dialog:
        page.locator(f"#{dialog}").click()
    found = violations(page)
    if dialog:
        page.keyboard.press("Escape")
    assert found == []


def test_what_a_control_did_is_told_to_screen_readers(page):
    told = page.locator("#announced")
    page.locator("#ground").select_option("Black")
    assert told.inner_text() == "Ground: Black"
    page.locator("#ground").select_option("As painted")
    page.locator("#turn").click()
    assert told.inner_text() == "Turning"
    page.locator("#turn").click()
    assert told.inner_text() == "At rest"
    page.locator("#home").click()
    assert told.inner_text() == "First view"
    assert page.get_by_role("heading", level=1).inner_text() == TITLE


def test_a_hostile_name_is_text(page):
    assert page.title() == TITLE
    assert page.locator("#brush option").all_inner_texts() == ["As painted", "impasto", "<i>dab</i>"]


def test_tab_leads_through_all_of_it(page):
    page.locator("#painting").focus()
    order = []
    for _ in range(9):
        page.keyboard.press("Tab")
        order.append(page.evaluate("document.activeElement.id"))
    assert order == ["share", "brush", "ground", *BUTTONS]
    outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid", "the focus is not to be seen"


def test_the_bar_changes_what_is_painted(page):
    count = page.evaluate("brushgs.framesDrawn")
    page.locator("#share").fill("40")
    assert page.evaluate("brushgs.look.share") == 0.4
    assert page.locator("#shareText").inner_text() == "40 %"
    assert page.locator("#share").get_attribute("aria-valuetext") == "40 percent"
    page.locator("#brush").select_option("<i>dab</i>")
    assert page.evaluate("brushgs.look.brush") == 1
    page.locator("#brush").select_option("As painted")
    assert page.evaluate("brushgs.look.brush") is None
    grounds = {"White": [1, 1, 1], "Black": [0, 0, 0], "Transparent": False, "As painted": True}
    for name, ground in grounds.items():
        page.locator("#ground").select_option(name)
        assert page.evaluate("brushgs.look.ground") == ground
        assert not page.locator("#color").is_visible()
        is_board = page.evaluate("getComputedStyle(brushgs.canvas).backgroundImage !== 'none'")
        assert is_board == (ground is False)
    page.locator("#ground").select_option("Colour …")
    page.locator("#color").fill("#ff8000")
    assert page.evaluate("brushgs.look.ground") == pytest.approx([1, 128 / 255, 0])
    wait_until(page, "count => brushgs.framesDrawn > count", count)
    page.locator("#ground").select_option("As painted")


def test_keys_in_the_bar_do_not_move_the_picture(page):
    before = page.evaluate("[...brushgs.controls.target]")
    page.locator("#share").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Home")
    page.locator("#link").focus()
    page.keyboard.press("Space")
    page.keyboard.press("Escape")  # it has opened what can be shared
    assert page.evaluate("[...brushgs.controls.target]") == before
    assert not page.evaluate("brushgs.controls.isTurning")
    page.locator("#share").fill("100")


@pytest.mark.parametrize(("width", "height"), [(320, 568), (390, 844), (844, 390), (1280, 720)])
def test_the_bar_fits_and_its_parts_do_not_overlap(page, width, height):
    page.set_viewport_size({"width": width, "height": height})
    bar, is_compact = page.locator("#bar"), width < 1020
    if is_compact:
        closed = bar.bounding_box()
        assert closed["width"] * closed["height"] <= 0.15 * width * height
        page.get_by_role("button", name="Paint: strokes, brush and ground").click()
    boxes = [page.locator(f"#{id_}").bounding_box() for id_ in ("share", "brush", "ground", *BUTTONS)]
    if is_compact:
        page.locator("#more").click()
        assert not page.locator("#share").is_visible()
    page.set_viewport_size(DESKTOP)
    for box in boxes:
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= width
        assert box["y"] + box["height"] <= height
        assert box["width"] >= 40
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            apart = (
                a["x"] + a["width"] <= b["x"] + 0.01
                or b["x"] + b["width"] <= a["x"] + 0.01
                or a["y"] + a["height"] <= b["y"] + 0.01
                or b["y"] + b["height"] <= a["y"] + 0.01
            )
            assert apart


def luminance(color):
    channel = np.array(color) / 255
    linear = np.where(channel <= 0.04045, channel / 12.92, ((channel + 0.055) / 1.055) ** 2.4)
    return linear @ (0.2126, 0.7152, 0.0722)


def test_the_saved_camera_is_that_of_the_page(page, tmp_path):
    page.keyboard.press("ArrowLeft")
    settle(page)
    with page.expect_download() as saving:
        page.locator("#link").click()
        page.locator("#saveCamera").click()
    assert saving.value.suggested_filename == "camera.json"
    saving.value.save_as(tmp_path / "camera.json")
    (camera,) = bg.load_cameras(tmp_path / "camera.json")
    header = page.evaluate("brushgs.contents.header")
    expected = seen(page, header, camera.width, camera.height)
    points = scene()[1].points[::9]
    np.testing.assert_allclose(pixels(camera, points), pixels(expected, points), atol=1e-6)
    assert camera.near == pytest.approx(expected.near, rel=1e-12)
    assert json.loads((tmp_path / "camera.json").read_text())["camera_model"] == "PINHOLE"


def test_the_saved_picture_is_what_is_shown(page, tmp_path):
    with page.expect_download() as saving:
        page.locator("#savePicture").click()
    assert saving.value.suggested_filename == "pears-b-apples-b.png"
    saving.value.save_as(tmp_path / "a.png")
    from PIL import Image

    saved = np.asarray(Image.open(tmp_path / "a.png"))
    sides = page.evaluate("[brushgs.canvas.height, brushgs.canvas.width]")
    assert list(saved.shape[:2]) == sides
    painted = page.evaluate(
        """() => {
          const { gl, canvas } = brushgs;
          brushgs._paint(1);
          const pixels = new Uint8Array(4 * canvas.width * canvas.height);
          gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          let text = "";
          for (let i = 0; i < pixels.length; i += 32768) {
            text += String.fromCharCode(...pixels.subarray(i, i + 32768));
          }
          return btoa(text);
        }"""
    )
    shown_now = np.frombuffer(base64.b64decode(painted), np.uint8).reshape(*sides, 4)[::-1]
    assert np.ptp(saved[..., :3]) > 100
    np.testing.assert_array_equal(saved[..., :3], shown_now[..., :3])
