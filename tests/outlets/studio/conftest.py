"""A small scene that is viewed, its studio, and its server."""

import threading
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
from tests.scenes import save_upright, still_life_of

FEW = ["--strokes", "120", "--size", "96x72", "--backdrop", "off", "--see", "off"]
SECONDS = 60.0  # that a test waits for work; a limit, not a measure


@pytest.fixture(scope="session")
def scene(tmp_path_factory):
    """A scene file."""
    path = tmp_path_factory.mktemp("viewed") / "pears.ply"
    save_upright(still_life_of(1000), path)
    return path


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
