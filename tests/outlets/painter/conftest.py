"""The painter page in one tab. Compiling it takes a minute of processor time, so it is asked for."""

import os

import pytest

from brushgs.outlets.painter import build
from tests.firefox import firefox  # noqa: F401

BUILD = "BRUSHGS_BUILD_PAINTER"  # set by .ci/run where what the page is made of has changed


@pytest.fixture(scope="session")
def painter_file(tmp_path_factory):
    """The page on disk; skips where it was not compiled and need not be."""
    from brushgs.outlets.painter.page import write_painter

    if not build.kept_module().is_file() and not os.environ.get(BUILD):
        pytest.skip(f"the page is not compiled; {BUILD}=1 compiles it")
    path = tmp_path_factory.mktemp("painter") / "painter.html"
    write_painter(path)
    return path


@pytest.fixture(scope="module")
def painter(open_shared_page, painter_file):
    """A tab with the page, ready for a scene; it draws only where a test asks for a picture."""
    page = open_shared_page(painter_file)
    wait_until(page, "!!window.brushgs.dropping")
    page.evaluate("window.brushgs.isPaused = true")
    return page


def wait_until(page, condition, seconds=120):
    """Ask in turns: the policy of the page forbids conditions that are compiled in it."""
    for _ in range(int(seconds / 0.05)):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"not within {seconds} s: {condition}")
