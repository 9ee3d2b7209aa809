"""Chromium for the tests of the page: Debian's, on a software renderer, driven by Playwright."""

import shutil
from contextlib import contextmanager

import pytest

# Without the windows of a whole browser a page takes a third less of the processor.
CHROMIUM = shutil.which("chromium-headless-shell") or shutil.which("chromium")
FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
OWN = ("file:", "data:", "blob:")  # all that a page may ask for
# Shaders are compiled when something is first drawn, which takes most of the time of a small page. A page
# that draws nothing does all else as ever.
NO_DRAWING = """for (const kind of ["Arrays", "Elements", "ArraysInstanced", "ElementsInstanced"])
  WebGL2RenderingContext.prototype[`draw${kind}`] = () => {};"""


class Watch:
    """What a page complained of, and what it asked for beyond itself."""

    def __init__(self, page, allowed=OWN, expected=None):
        self.complaints = []
        self.expected = expected
        page.on("console", self._on_console)
        page.on("pageerror", lambda error: self.complaints.append(f"error: {error}"))
        page.on("request", lambda request: self._on_request(request, allowed))

    def _on_console(self, message):
        if self.expected is not None and self.expected in message.text:
            return
        if "GPU stall due to ReadPixels" not in message.text:
            self.complaints.append(f"{message.type}: {message.text}")

    def _on_request(self, request, allowed):
        if not request.url.startswith(allowed):
            self.complaints.append(f"request: {request.url}")


@pytest.fixture(scope="session")
def browser():
    """Chromium; skips where it or Playwright is missing."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser):
    """Opens a file in a tab of its own; at the end, whatever a page complained of fails the test."""
    yield from _opener(browser)


@pytest.fixture(scope="module")
def open_shared_page(browser):
    """`open_page` for a tab that the tests of a module share: complaints fail the last of them."""
    yield from _opener(browser)


def _opener(browser):
    contexts, watches = [], []

    def opened(
        path, *, width=320, height=240, allowed=OWN, expected=None, init_script=None, is_drawn=True, **context
    ):
        tab = browser.new_context(viewport={"width": width, "height": height}, **context)
        contexts.append(tab)
        page = tab.new_page()
        watches.append(Watch(page, allowed, expected))
        for script in (init_script, None if is_drawn else NO_DRAWING):
            if script is not None:
                page.add_init_script(script)
        page.goto(path if isinstance(path, str) else path.as_uri())
        return page

    yield opened
    for tab in contexts:
        tab.close()
    assert [complaint for watch in watches for complaint in watch.complaints] == []


@contextmanager
def blank_tab(browser):
    """An empty tab; at the end, whatever was complained of in it fails the test."""
    page = browser.new_page()
    watch = Watch(page)
    yield page
    page.close()
    assert watch.complaints == []
