"""The link of a page: it shows what was shown, and nothing that a link says breaks a page."""

import numpy as np
import pytest

from tests.outlets.page.page_file import seen, settle, shown, wait_until, write_page

CALM = {"reduced_motion": "reduce"}
COPY = {"permissions": ["clipboard-read", "clipboard-write"]}
DESKTOP = {"width": 1100, "height": 500}  # which shows all fields of the bar


@pytest.fixture(scope="module")
def contents():
    return shown(title="pears & <b>")


@pytest.fixture(scope="module")
def path(tmp_path_factory, contents):
    return write_page(tmp_path_factory.mktemp("page") / "pears.html", contents)


@pytest.fixture(scope="module")
def page(open_shared_page, path):
    tab = open_shared_page(path, **CALM, **COPY, **DESKTOP)
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


def test_code_for_another_page_holds_no_markup_of_a_title(page):
    page.locator("#link").press("Enter")  # which wakes the bar, where it has faded
    code = page.locator("#embedText").input_value()
    page.keyboard.press("Escape")
    assert code.startswith('<iframe src="file://')
    assert 'title="pears &#38; &#60;b&#62;"' in code
    assert page.locator("#linksHint").count() == 1


@pytest.mark.parametrize(
    "link",
    [
        "view=",
        "view=1,2,3",
        "view=a,b,c,d,e,f",
        "view=0,0,0,0,0,0",
        "view=0,0,-1,0,0,0",
        "view=NaN,0,1,0,0,0",
        "view=1e999,0,1,0,0,0",
        "share=0&brush=99&ground=<b>",
        "share=1e9&brush=-1&ground=%00",
        "%E0%A4%A&=&&",
    ],
)
def test_a_link_that_says_nothing_changes_nothing(page, contents, link):
    page.evaluate("brushgs.controls.home()")
    follow(page, "view=0,0,1,0,0,0")
    before = page.evaluate("[[...brushgs.controls.target], brushgs.look.share, brushgs.panel.groundChoice]")
    follow(page, link)
    assert (
        page.evaluate("[[...brushgs.controls.target], brushgs.look.share, brushgs.panel.groundChoice]")
        == before
    )
