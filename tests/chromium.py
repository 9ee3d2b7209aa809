"""Chromium for the tests of the page: Debian's, on a software renderer, driven by Playwright."""

import shutil
from contextlib import contextmanager

import pytest

CHROMIUM = shutil.which("chromium")
FLAGS = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
OWN = ("file:", "data:", "blob:")  # all that a page may ask for
# Tabs that tests have left, by how they were opened: a file in one takes a third of the time of a new tab.
LEFT: dict[str, list] = {}


class Watch:
    """What a page complained of, and what it asked for beyond itself."""

    def __init__(self, page, allowed=OWN, expected=None):
        self.page, self.allowed, self.expected = page, allowed, expected
        self.complaints = []
        for event, hear in self._heard:
            page.on(event, hear)

    @property
    def _heard(self):
        return ("console", self._on_console), ("pageerror", self._on_error), ("request", self._on_request)

    def end(self):
        """Hear no more of what happens in the tab."""
        for event, hear in self._heard:
            self.page.remove_listener(event, hear)

    def _on_error(self, error):
        self.complaints.append(f"error: {error}")

    def _on_console(self, message):
        if self.expected is not None and self.expected in message.text:
            return
        if "GPU stall due to ReadPixels" not in message.text:
            self.complaints.append(f"{message.type}: {message.text}")

    def _on_request(self, request):
        if not request.url.startswith(self.allowed):
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
    watches, taken = [], []

    def opened(
        path, *, width=320, height=240, allowed=OWN, expected=None, init_script=None, is_new=False, **context
    ):
        """`is_new`: for a test that changes more of its tab than another file in it replaces: the clock.

        So does an `init_script`, which would also run on in the empty tab that is left.
        """
        size = {"width": width, "height": height}
        is_new = is_new or init_script is not None
        left = LEFT.setdefault(repr((size, sorted(context.items()))), [])
        if left and not is_new:
            page = left.pop()
            page.bring_to_front()  # or it draws no frames
            page.set_viewport_size(size)
        else:
            page = browser.new_context(viewport=size, **context).new_page()
            if init_script is not None:
                page.add_init_script(init_script)
        watches.append(Watch(page, allowed, expected))
        taken.append((page, None if is_new else left))
        page.goto(path if isinstance(path, str) else path.as_uri())
        return page

    yield opened
    for page, left in taken:
        if left is None or page.is_closed():
            page.context.close()
        else:
            _leave(page, left)
    for watch in watches:
        watch.end()
    assert [complaint for watch in watches for complaint in watch.complaints] == []


def _leave(page, left):
    """Make a tab as good as new."""
    page.goto("about:blank")
    page.mouse.move(0, 0)
    page.context.clear_cookies()
    left.append(page)


@contextmanager
def blank_tab(browser):
    """An empty tab; at the end, whatever was complained of in it fails the test."""
    page = browser.new_page()
    watch = Watch(page)
    yield page
    page.close()
    assert watch.complaints == []
