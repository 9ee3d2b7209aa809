"""A small scene that is viewed, its studio, and its server."""

import threading
import time
from contextlib import contextmanager

import pytest

from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.options.viewer import ServerConfig
from brushgs.outlets.studio.hearing import hearing_warnings
from brushgs.outlets.studio.server import StudioServer
from brushgs.outlets.studio.settings import Settings
from brushgs.outlets.studio.studio import Studio
from brushgs.pipeline.report import Report

FEW = ["--strokes", "120", "--size", "96x72", "--backdrop", "off", "--see", "off"]
PLAIN = ["--stroke", "impasto", "--ground", "none", "--canvas", "none"]  # which is drawn soon
SECONDS = 60.0  # that a test waits for work; a limit, not a measure


@pytest.fixture
def session(scene, tmp_path):
    """A session that writes to the test's own folder."""
    return session_of(parse(["view", str(scene), *FEW, "-o", str(tmp_path)]))


@pytest.fixture(scope="module")
def shared(scene, tmp_path_factory):
    """A studio with a server, for tests that change nothing which others see."""
    folder = tmp_path_factory.mktemp("outputs")
    session = session_of(parse(["view", str(scene), *FEW, "-o", str(folder)]))
    with serving(session, tmp_path_factory.mktemp("uploads")) as server:
        yield server


@contextmanager
def studio_of(session, uploads, first=None):
    """An open studio."""
    with hearing_warnings() as heard:
        first = first or session.paint(Settings(), Report())
        studio = Studio(session, first, uploads=uploads, heard=heard)
        try:
            yield studio
        finally:
            assert studio.close(SECONDS)


@contextmanager
def serving(session, uploads, config=None):
    """A server of an open studio, in a thread."""
    with studio_of(session, uploads) as studio, StudioServer(studio, config or ServerConfig()) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join(SECONDS)


def until(page, expression):
    """Wait until an expression is true; the page's own policy lets Playwright not wait in it."""
    end = time.monotonic() + SECONDS
    while not page.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.02)


DRAWN = pytest.mark.parametrize("viewed", [{"is_drawn": True}], indirect=True)


@pytest.fixture
def viewed(request, scene, tmp_path, open_page):
    """A page of the studio of a plain painting, and the studio; a parameter is more for `open_page`.

    The page draws nothing unless the parameter says so.
    """
    session = session_of(parse(["view", str(scene), *FEW, *PLAIN, "-o", str(tmp_path)]))
    options = {"is_drawn": False} | getattr(request, "param", {})
    with paged(session, tmp_path, open_page, **options) as (page, studio):
        yield page, studio


@contextmanager
def paged(session, folder, open_page, **options):
    """A page of a session, and its studio; what is dropped goes below a folder."""
    (folder / "uploads").mkdir()
    # Room for all fields, and a quarter of its pixels to paint.
    window = {"width": 1000, "height": 500, "device_scale_factor": 0.5}
    options = window | {"reduced_motion": "reduce"} | options
    with serving(session, folder / "uploads") as server:
        own = (f"http://127.0.0.1:{server.port}/", "data:", "blob:")
        page = open_page(server.address(), allowed=own, **options)
        until(page, "window.brushgs.studio?.isSettled")
        yield page, server.studio
        page.goto("about:blank")  # before its server ends, which it would complain of
