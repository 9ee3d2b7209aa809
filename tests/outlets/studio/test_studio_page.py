"""The studio in a real browser: a change replaces the strokes without a reload, and pictures are files."""

import re
from collections import Counter

import pytest

from brushgs.brushes.texture import strokes_folder
from brushgs.formats.pictures.images import read_image
from brushgs.outlets.page.html import page_script
from tests.outlets.page.page_file import violations
from tests.outlets.studio.conftest import DRAWN, until
from tests.scenes import save_upright, still_life_of

BRUSHES = "window.brushgs.contents.header.brushes.map((brush) => brush.name).join()"
PART = "window.brushgs.look.highlight"
REFUSED = pytest.mark.parametrize("viewed", [{"expected": "400 (Bad Request)"}], indirect=True)


def strokes_of(page):
    return page.evaluate("window.brushgs.contents.header.coats.reduce((sum, coat) => sum + coat.count, 0)")


def slide(page, name, value):
    """Move a slider as a hand does: the value of its place, and the event."""
    page.evaluate(
        """([name, value]) => {
            const slider = document.querySelector(`#studio input[name=${name}]`);
            slider.value = value;
            slider.dispatchEvent(new Event("input", { bubbles: true }));
        }""",
        [name, value],
    )
    until(page, "window.brushgs.studio.isSettled")


@DRAWN
def test_a_painter_turns_changes_and_renders(viewed, tmp_path):
    page, _ = viewed
    page.evaluate("window.isSamePage = true")
    assert page.url.endswith("/")  # the token is no more to be seen
    before = strokes_of(page)
    page.focus("#painting")
    page.keyboard.press("ArrowRight")
    view = page.evaluate("Array.from(window.brushgs.controls.target)")
    slide(page, "strokes", 3.7)  # its place is a logarithm: 40
    assert strokes_of(page) < before
    slide(page, "relief", 0.9)
    texts = page.locator("#studio label:has(input[type=range]) output").all_text_contents()
    assert {str(strokes_of(page)), "90 %"} <= set(texts)
    assert "light and shade" in page.locator("label:has([name=relief])").get_attribute("title")
    assert page.evaluate("window.brushgs.contents.header.command.options").count("--relief") == 1
    page.select_option("#studio select[name=stroke]", "dab")
    until(page, f"{BRUSHES} === 'dab'")
    assert page.evaluate("Array.from(window.brushgs.controls.target)") == view
    assert page.evaluate("window.isSamePage") is True
    page.fill("#studio input[name=width]", "64")
    page.fill("#studio input[name=height]", "48")
    page.click("#render")
    until(page, "document.querySelector('#output').open")
    assert "Saved as pears-oil-1.png in" in page.inner_text("#output p")
    until(page, "document.querySelector('#output img').naturalWidth === 64")
    assert read_image(tmp_path / "pears-oil-1.png").shape[:2] == (48, 64)
    page.reload()
    until(page, "window.brushgs.studio?.isSettled")
    assert page.locator("#studio .outputs li").count() == 1
    assert not page.evaluate("document.querySelector('#output').open")  # it is of an earlier visit


def test_the_token_leaves_the_address_though_no_picture_can_be_shown(shared, browser):
    """Before the page is whole: the view of a link stays, a reload works, a copied address does not."""
    without_webgl = "HTMLCanvasElement.prototype.getContext = () => null;"
    tab, other = browser.new_context(), browser.new_context()
    try:
        page = tab.new_page()
        page.add_init_script(without_webgl)
        page.goto(f"{shared.address()}#view=30,12,1.2,0,0,0")
        assert page.url == f"http://127.0.0.1:{shared.port}/#view=30,12,1.2,0,0,0"
        assert page.reload().status == 200
        assert other.new_page().goto(page.url).status == 403
    finally:
        tab.close()
        other.close()


def test_a_video_through_marked_views(viewed, tmp_path):
    page, _ = viewed
    page.click("#mark")
    page.focus("#painting")
    page.keyboard.press("ArrowRight")
    page.click("#mark")
    page.focus("#painting")
    page.keyboard.press("ArrowUp")
    page.click("#mark")
    page.click("#studio .marks [aria-label='Remove View 2']")
    assert page.locator("#studio .marks li").count() == 2
    for name, value in (("width", "32"), ("height", "24"), ("seconds", "0.1")):
        page.fill(f"#studio input[name={name}]", value)
    page.click("#film")
    until(page, "document.querySelector('#output').open")
    assert (tmp_path / "pears-oil-1.mp4").stat().st_size > 0
    kind = "fetch(document.querySelector('#output video').src).then((r) => r.blob()).then((b) => b.type)"
    assert page.evaluate(kind) == "video/mp4"


def test_a_dropped_picture_paints_and_is_shown_where_it_may_be_dropped(viewed, tmp_path):
    page, _ = viewed
    picture = tmp_path / "mine.png"
    picture.write_bytes((strokes_folder() / "swirl.png").read_bytes())
    page.set_input_files("#studio input[accept='image/*'] >> nth=0", picture)
    until(page, f"{BRUSHES} === 'mine'")
    until(page, "window.brushgs.studio.isSettled")
    options = page.evaluate("window.brushgs.contents.header.command.options")
    assert options[-2:] == ["--stroke", "mine.png"]
    page.set_input_files("#studio input[accept='image/*'] >> nth=1", picture)
    until(page, "window.brushgs.contents.header.command.options.includes('--palette')")
    page.click("#reset")
    until(page, f"{BRUSHES} === 'impasto'")
    send = """([name, isZone]) => {
        const data = new DataTransfer();
        data.items.add(new File([Uint8Array.from(window.bytes)], "dropped.png", { type: "image/png" }));
        const target = isZone ? document.querySelector("#drops .zone") : document.body;
        target.dispatchEvent(new DragEvent(name, { bubbles: true, cancelable: true, dataTransfer: data }));
    }"""
    page.evaluate("(bytes) => { window.bytes = bytes; }", list(picture.read_bytes()))
    for event in (["dragenter", False], ["dragleave", False], ["dragenter", False], ["drop", True]):
        page.evaluate(send, event)
        assert page.is_visible("#drops") == (event[0] == "dragenter")
    until(page, f"{BRUSHES} === 'dropped'")


def test_every_field_has_a_name_for_screen_readers_and_keys_reach_it(viewed):
    page, _ = viewed
    page.evaluate("document.getElementById('progress').textContent = 'impasto, dry_brush, '.repeat(9)")
    assert violations(page) == []  # such as a text that only a mouse can scroll
    nameless = page.evaluate(
        """() => Array.from(document.querySelectorAll("#studio input, #studio select, #studio button"))
            .filter((field) => field.type !== "file")
            .filter((field) => !(field.labels?.[0] ?? field).textContent.trim() && !field.ariaLabel)
            .map((field) => field.outerHTML)"""
    )
    assert nameless == []
    page.focus("#studioToggle")
    page.keyboard.press("Enter")
    assert page.evaluate("document.getElementById('studio').hidden")
    assert page.get_attribute("#studioToggle", "aria-expanded") == "false"
    page.keyboard.press("Enter")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.name") == "scene"


def test_no_two_scripts_define_the_same_name():
    """They are joined into one function, in which the last function of a name replaces those before."""
    script = page_script(live=True)
    names = re.findall(r"^(?:async )?(?:function\*?|class|const|let) +(\w+)", script, re.MULTILINE)
    assert [name for name, count in Counter(names).items() if count > 1] == []
    assert "StudioServer" in names
    assert "class StudioServer" not in page_script()  # a page of a file has no studio


@REFUSED
def test_a_dropped_scene_is_opened_and_a_bad_one_is_told(viewed, tmp_path):
    page, _ = viewed
    (tmp_path / "bad.ply").write_bytes(b"no scene")
    save_upright(still_life_of(1200), tmp_path / "pot.ply")
    page.set_input_files("#studio input[accept='']", tmp_path / "bad.ply")
    until(page, "document.getElementById('notice').textContent.startsWith('bad.ply: ')")
    assert page.get_by_role("progressbar", name="Sending").count() == 0
    sent, refused = page.evaluate(
        """async () => {
            const shares = [], file = new File([new Uint8Array(4e6)], "zeros.ply");
            const { message } = await brushgs.studio._server.addScene(file, (share) => {
                shares.push(share);
            }).catch((error) => error);
            return [shares, message];
        }"""
    )
    assert sent == sorted(sent)
    assert sent[-1] == 1
    assert refused.startswith("zeros.ply: ")
    page.evaluate("brushgs.studio.set({ relief: 7 })")
    until(page, "document.getElementById('notice').textContent.startsWith('relief must be 0 to 1')")
    slide(page, "strokes", 3.7)
    assert [*page.evaluate("brushgs.studio._settings")] == ["strokes"]  # what was refused is forgotten
    few = strokes_of(page)
    with page.expect_navigation():
        page.set_input_files("#studio input[accept='']", tmp_path / "pot.ply")
    until(page, "window.brushgs?.studio?.isSettled")
    assert page.evaluate("window.brushgs.contents.header.title") == page.title() == "pot"
    assert abs(strokes_of(page) - few) <= few / 2  # the settings stay
    assert page.locator("[name=scene] option").all_inner_texts() == ["pot.ply", "pears.ply"]
    assert page.locator("[name=scene] optgroup").get_attribute("label") == "Recent"
    with page.expect_navigation():
        page.select_option("[name=scene]", "pears.ply")
    until(page, "window.brushgs?.studio?.isSettled")
    assert page.title() == "pears"


def show_where(page, text):
    page.fill("#studio input[name=where]", text)
    page.press("#studio input[name=where]", "Enter")


def test_a_part_that_is_typed_is_highlighted_and_changes_no_stroke(viewed):
    page, _ = viewed
    page.evaluate("window.before = window.brushgs.contents")
    show_where(page, "half:1,0,0,0")
    until(page, f"{PART} !== null")
    words = re.fullmatch(r"([0-9]+) of ([0-9]+) strokes", page.inner_text("#whereWords"))
    assert 0 < int(words[1]) < int(words[2]) == strokes_of(page)
    members = page.evaluate(f"{PART}.columns.map((column) => column.filter((byte) => byte >= 128).length)")
    assert sum(members) == int(words[1])
    assert page.evaluate("window.before === window.brushgs.contents")
    name = page.get_attribute("#painting", "aria-label")
    assert name.endswith("strokes, half:1,0,0,0 highlighted")
    assert page.input_value("#region") == "typed"
    page.locator("#more").press("Enter")  # which shows the fields of the bar in a small window
    page.select_option("#region", "Nothing")
    assert page.evaluate(PART) is None
    page.select_option("#region", "As typed")
    assert page.evaluate(f"{PART}.name") == "half:1,0,0,0"

    slide(page, "strokes", 3.7)
    until(page, f"{PART} !== null && {PART}.columns[0].length === {strokes_of(page)}")
    page.press("#studio input[name=where]", "Escape")
    assert page.evaluate(PART) is None
    assert page.input_value("#studio input[name=where]") == ""


@REFUSED
def test_a_part_that_cannot_be_is_told_below_its_field(viewed):
    page, _ = viewed
    field = page.get_by_role("textbox", name="Show where")
    assert "subject" in page.inner_text("#" + field.get_attribute("aria-describedby"))
    for text, sentence in (
        ("subject and", "where must have"),
        ("mask:/etc/passwd", "where: mask: reads files, which a page must not name"),
        ("part:999", "part:999 is not there"),
        ("sphere:900,0,0,1", "No stroke lies there"),
    ):
        show_where(page, text)
        until(page, f"document.getElementById('whereWords').textContent.includes({sentence!r})")
        is_wrong = "No stroke" not in sentence
        assert field.get_attribute("aria-invalid") == str(is_wrong).lower()
        assert page.evaluate(PART) is None
    show_where(page, "subject or not subject")
    until(page, f"{PART} !== null")
    show_where(page, "sphere:")
    until(page, f"{PART} === null")
