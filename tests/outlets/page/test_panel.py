"""The bar of a page: what it offers, to whom, and that it fades."""

from itertools import combinations

import pytest

from tests.kit.for_each import for_each
from tests.outlets.page.page_file import are_apart, settle, shown, violations, wait_until, write_page

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
    page = open_shared_page(path, **CALM, **DESKTOP, **COPY, is_drawn=False)
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
    """Rest the pointer on the bar, so that it stays: it may fade while a slow page tells where it is."""
    for _ in range(50):
        page.mouse.move(0, 0)
        wait_until(page, IS_SHOWN)
        box = page.locator("#bar").bounding_box()
        page.mouse.move(box["x"] + 8, box["y"] + box["height"] / 2)
        page.wait_for_timeout(20)
        if page.evaluate("brushgs.panel._isPointedAt"):
            return
    raise AssertionError("the bar is never pointed at")


@for_each("dialog", [None, "link", "keys"])
def test_axe_finds_nothing(page, dialog):
    if dialog:
        page.locator(f"#{dialog}").click()
    found = violations(page)
    if dialog:
        page.keyboard.press("Escape")
    assert found == []


def test_what_a_control_did_is_told_to_screen_readers_and_a_hostile_name_is_text(page):
    told = page.locator("#announced")
    for name in ("Black", "As painted"):
        page.locator("#ground").select_option(name)
        assert told.inner_text() == f"Ground: {name}"
    for control, text in (("turn", "Turning"), ("turn", "At rest"), ("home", "First view")):
        page.locator(f"#{control}").click()
        assert told.inner_text() == text
    assert page.title() == page.get_by_role("heading", level=1).inner_text() == TITLE
    assert page.locator("#brush option").all_inner_texts() == ["As painted", "impasto", "<i>dab</i>"]


def test_tab_leads_through_all_of_it_and_keys_there_do_not_move_the_picture(page):
    before = page.evaluate("[...brushgs.controls.target]")
    page.locator("#painting").focus()
    order = []
    for _ in range(9):
        page.keyboard.press("Tab")
        order.append(page.evaluate("document.activeElement.id"))
    assert order == ["share", "brush", "ground", *BUTTONS]
    outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid", "the focus is not to be seen"
    page.locator("#share").focus()
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Home")
    page.locator("#link").focus()
    page.keyboard.press("Space")
    page.keyboard.press("Escape")  # it has opened what can be shared
    assert page.evaluate("[...brushgs.controls.target]") == before
    assert not page.evaluate("brushgs.controls.isTurning")
    page.locator("#share").fill("100")


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
    page.locator("#ground").select_option("Color …")
    page.locator("#color").fill("#ff8000")
    assert page.evaluate("brushgs.look.ground") == pytest.approx([1, 128 / 255, 0])
    wait_until(page, "count => brushgs.framesDrawn > count", count)
    page.locator("#ground").select_option("As painted")


FILL_BAR = """() => {
  for (const id of ["player", "region"]) {
    const element = document.getElementById(id);
    (element.closest("label") ?? element).hidden = false;
  }
  document.getElementById("bar").classList.add("plays");
  brushgs.panel.offerHeadset(["immersive-vr", "immersive-ar"], null);
}"""
EMPTY_BAR = """() => {
  for (const id of ["immersive-vr", "immersive-ar"]) document.getElementById(id).remove();
  brushgs.player.replace();
  brushgs.panel.replace(brushgs.contents);
}"""
PLAYER = ("play", "moment", "momentText", "speed")


def boxes_in_window(page, ids, width, height):
    """Hold controls apart and in the window, the bar to 15 % of it."""
    boxes = [page.locator(f"#{id_}").bounding_box() for id_ in ids]
    bar = page.locator("#bar").bounding_box()
    assert bar["width"] * bar["height"] <= 0.15 * width * height
    for box in boxes:
        assert box["x"] >= bar["x"]
        assert box["x"] + box["width"] <= bar["x"] + bar["width"] <= width
        assert box["y"] + box["height"] <= bar["y"] + bar["height"] <= height
        assert box["width"] >= 24
    assert all(are_apart(a, b) for a, b in combinations(boxes, 2))


@for_each("is_full", [False, True])
@for_each(("width", "height"), [(280, 653), (320, 568), (390, 844), (844, 390), (768, 1024), (1280, 720)])
def test_the_bar_fits_and_its_parts_do_not_overlap(page, width, height, is_full):
    """Also that of a moving painting with regions, on a phone that serves as a headset."""
    point_at_bar(page)
    page.set_viewport_size({"width": width, "height": height})
    buttons, fields = [*BUTTONS], ["share", "brush", "ground"]
    if is_full:
        page.evaluate(FILL_BAR)
        buttons += ["immersive-vr", "immersive-ar", *PLAYER]
        fields += ["region"]
    more = page.locator("#more")
    try:
        if more.is_visible():
            boxes_in_window(page, [*buttons, "more"], width, height)
            more.click()
            boxes_in_window(page, [*fields, "more"], width, height)
            more.click()
            assert not page.locator("#share").is_visible()
        else:
            boxes_in_window(page, [*buttons, *fields], width, height)
    finally:
        page.evaluate(EMPTY_BAR if is_full else "0")
        page.set_viewport_size(DESKTOP)


def test_fields_that_are_open_can_be_closed_in_a_window_that_became_wide(page):
    page.set_viewport_size({"width": 820, "height": 1180})
    page.locator("#more").click()
    page.set_viewport_size({"width": 1180, "height": 820})
    assert page.locator("#share").is_visible()
    page.locator("#more").click()
    assert page.locator("#keys").is_visible()
    assert not page.locator("#more").is_visible()
    page.set_viewport_size(DESKTOP)
