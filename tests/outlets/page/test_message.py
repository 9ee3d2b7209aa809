"""What a page says when something is wrong, and that a lost context comes back."""

import re

import numpy as np
import pytest

from tests.kit.for_each import for_each
from tests.outlets.page.page_file import pixels, scene, screen, seen, settle, shown, wait_until, write_page

CALM = {"reduced_motion": "reduce"}
NO_WEBGL = """
const original = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : original.call(this, kind, ...rest);
};
"""


EXTENSION = "chrome-extension://abcdef/content.js"
OF_EXTENSIONS = [
    f"new ErrorEvent('error', {{ message: 'x is not defined', filename: '{EXTENSION}' }})",
    "new PromiseRejectionEvent('unhandledrejection', { promise: new Promise(() => {}), reason: "
    f"Object.assign(new TypeError('x'), {{ stack: 'TypeError: x at run ({EXTENSION}:1:2)' }}) }})",
]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write_page(tmp_path_factory.mktemp("page") / "pears.html", shown())


def message_of(page):
    """What is said over the picture; "" for nothing."""
    message = page.locator("#message")
    return message.inner_text().strip() if message.is_visible() else ""


def test_without_webgl_the_still_picture_stays_with_a_sentence(open_page, path):
    page = open_page(path, init_script=NO_WEBGL)
    page.evaluate("brushgs.ready")
    said = "This browser cannot paint: it has no WebGL 2. This is a still picture of the painting."
    assert message_of(page) == said
    assert page.locator("#still").is_visible()
    assert not page.locator("#painting").is_visible()
    assert not page.locator("#bar").is_visible()
    assert page.locator("#message").get_attribute("role") == "status"


CUTS = {
    "in the style": lambda text: text.index("<style>") + 700,
    "in the still picture": lambda text: text.index('id="still"') + 60,
    "in the script": lambda text: text.index("<script>") + 30_000,
    "in the contents": lambda text: text.index('id="contents"') + 40_000,
    "within a digit of base64": lambda text: text.index('id="contents"') + 40_001,
    "in the last letters": lambda text: text.rindex("</script>") - 7,
}


@for_each("cut", CUTS)
def test_a_page_cut_short_says_so(open_page, path, tmp_path, cut):
    text = path.read_text(encoding="utf-8")
    short = tmp_path / "short.html"
    short.write_text(text[: CUTS[cut](text)], encoding="utf-8")
    expected = "Applying inline style violates" if "style" in cut else None
    page = open_page(short, **CALM, expected=expected)
    page.evaluate("window.brushgs?.ready")
    page.evaluate("document.getAnimations().forEach((one) => one.finish())")  # after three seconds
    wait_until(page, "getComputedStyle(document.getElementById('message')).visibility === 'visible'")
    assert re.match(r"This page is incomplete\b.* [Gg]et the whole file again", message_of(page))
    assert not page.locator("#bar").is_visible()


def test_an_error_becomes_a_sentence(open_page, path):
    broken = "WebGL2RenderingContext.prototype.createShader = () => { throw new TypeError('no shader'); };"
    page = open_page(path, init_script=broken, expected="no shader")
    page.evaluate("brushgs.ready")
    said = "Something went wrong in this page (TypeError: no shader). Open it in another browser."
    assert message_of(page) == said
    assert page.locator("#still").is_visible()
    assert not page.locator("#painting").is_visible()


def test_errors_of_extensions_are_not_told_and_a_lost_context_comes_back_with_the_same_view(open_page, path):
    page = open_page(path, **CALM)
    page.evaluate("brushgs.ready")
    for event in OF_EXTENSIONS:
        page.evaluate(f"window.dispatchEvent({event})")
    assert message_of(page) == ""
    assert not page.locator("#still").is_visible()
    page.keyboard.press("ArrowLeft")
    settle(page)
    header = page.evaluate("brushgs.contents.header")
    before, colors = seen(page, header), screen(page)
    page.evaluate("window.lost = brushgs.gl.getExtension('WEBGL_lose_context'); lost.loseContext()")
    wait_until(page, "brushgs.painter === null")
    assert message_of(page) == "The graphics processor was interrupted; the painting comes back by itself."
    page.keyboard.press("ArrowRight")  # hands are not idle meanwhile
    page.keyboard.press("ArrowLeft")
    drawn = page.evaluate("brushgs.framesDrawn")
    page.evaluate("lost.restoreContext()")
    wait_until(page, "drawn => brushgs.framesDrawn > drawn", drawn)
    assert message_of(page) == ""
    settle(page)
    points = scene()[1].points[::9]
    np.testing.assert_allclose(pixels(seen(page, header), points), pixels(before, points), atol=1e-9)
    np.testing.assert_array_equal(screen(page), colors)
