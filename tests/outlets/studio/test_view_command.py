"""`brushgs view` as a command: what it refuses, what it prints, and how it ends."""

import http.client
import re
import signal
import socket
import sys
import time
import webbrowser
from argparse import ArgumentParser
from pathlib import Path

import pytest

from brushgs.cli import main
from brushgs.cli.commands import render, view
from brushgs.outlets.studio.studio import Studio
from tests.kit import programs
from tests.kit.commands import refused, run
from tests.outlets.studio.conftest import FEW, SECONDS

ADDRESS = re.compile(r"^http://127\.0\.0\.1:([0-9]+)/\?token=([\w-]{43})$")


@pytest.mark.usefixtures("folder")
def test_what_cannot_be_served_is_refused(scene, capsys):
    Path("a.ply").write_bytes(b"no scene")
    Path("empty").mkdir()
    for words, sentence in (
        (["--port", "70000"], "port must be 0 to 65535, got 70000"),
        (["--certificate", "a.pem"], "key is missing: https needs --certificate and --private-key"),
        (["--private-key", "a.pem"], "certificate is missing: https needs --certificate and --private-key"),
        (["--host", ""], "host must be an address of this machine, got ''"),
        (["--relief", "3"], "relief must be 0 to 1, got 3"),
        (["--orbit", "20"], "unrecognized arguments: --orbit"),
        (["--certificate", "a.pem", "--private-key", "a.pem"], "a.pem: there is no such certificate"),
    ):
        assert sentence in refused(capsys, "view", scene, *FEW, "--no-browser", "--quiet", *words)
    assert "a.ply" in refused(capsys, "view", "a.ply", "--no-browser", "--quiet")
    assert "is an empty folder" in refused(capsys, "view", "--scenes", "empty", "--no-browser", "--quiet")


@pytest.fixture
def stopped_when_served(monkeypatch):
    """Serving ends as soon as it begins, as by Ctrl-C; what the browser was asked to open."""
    opened = []

    def serve_forever(self, poll_interval=0.5):
        raise KeyboardInterrupt

    monkeypatch.setattr("brushgs.outlets.studio.server.StudioServer.serve_forever", serve_forever)
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or False)
    return opened


def test_the_address_is_printed_and_opened(stopped_when_served, scene, tmp_path, capsys):
    assert main(["view", str(scene), *FEW, "-o", str(tmp_path)]) == 130
    out, err = capsys.readouterr()
    assert ADDRESS.match(out.strip())
    assert stopped_when_served == [out.strip()]
    assert "note: stop with Ctrl-C" in err
    assert "note: no browser could be opened; open the address" in err
    assert "adb" not in err
    assert err.endswith("brushgs: stopped\n")


def test_without_a_scene_the_first_of_a_folder_is_opened_or_an_example(
    stopped_when_served, scene, tmp_path, monkeypatch
):
    opened = []
    whole = Studio.__init__

    def noted(self, session, first, **more):
        whole(self, session, first, **more)
        opened.append([one["name"] for one in self.choices()["scenes"]])

    monkeypatch.setattr(Studio, "__init__", noted)
    folder = tmp_path / "scenes"
    folder.mkdir()
    for name in ("b10.ply", "b9.ply"):
        (folder / name).write_bytes(scene.read_bytes())
    words = [*FEW, "--no-browser", "--quiet", "-o", str(tmp_path)]
    assert main(["view", *words, "--scenes", str(folder)]) == 130
    assert main(["view", str(scene), *words, "--scenes", str(folder)]) == 130
    assert main(["view", *words]) == 130
    assert opened == [["b9.ply", "b10.ply"], ["pears.ply", "b9.ply", "b10.ply"], ["still_life.ply"]]


def test_headsets_and_others_are_told_how_to_get_here(stopped_when_served, scene, tmp_path, capsys):
    words = ["view", scene, *FEW, "-o", tmp_path]
    code, out, err = run(capsys, *words, "--serve", "--port", "0")
    assert code == 130
    port, token = ADDRESS.match(out.strip()).groups()
    assert f"run `adb reverse tcp:{port} tcp:{port}`, and open http://localhost:{port}/?token={token}" in err
    code, _, err = run(capsys, *words, "--host", "0.0.0.0", "--no-browser")
    assert code == 130
    assert "note: others who reach 0.0.0.0 and know the address with its token can use this page" in err
    assert "adb reverse" in err
    assert stopped_when_served == []


def test_the_options_that_the_page_names_are_those_of_render(scene):
    """Each flag of `view` is one of the viewer, or means the same to `render`."""
    ours, theirs = ArgumentParser(), ArgumentParser()
    view.add_flags(ours)
    render.add_flags(theirs)
    known = {flag for action in theirs._actions for flag in action.option_strings}
    for action in ours._actions:
        if action.dest not in view.OF_THE_VIEWER:
            assert set(action.option_strings) <= known


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")
def test_a_signal_ends_it_cleanly(scene, tmp_path):
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    words = "view", scene, *FEW, "--no-browser", "-o", tmp_path
    with programs.start("-m", "brushgs", *words, cwd=tmp_path, env={"TMPDIR": str(temporary)}) as process:
        try:
            port, token = ADDRESS.match(process.stdout.readline().strip()).groups()
            connection = http.client.HTTPConnection("127.0.0.1", int(port), timeout=SECONDS)
            connection.request("GET", f"/?token={token}")
            answer = connection.getresponse()
            assert (answer.status, b"class Studio" in answer.read()) == (200, True)
            with socket.create_connection(("127.0.0.1", int(port))):  # and one that says nothing
                process.send_signal(signal.SIGTERM)
                start = time.monotonic()
                _, err = process.communicate(timeout=SECONDS)
                assert time.monotonic() - start < SECONDS / 2
                connection.close()
        finally:
            process.kill()
    assert process.returncode == 143
    assert err.endswith("brushgs: stopped\n")
    assert "Traceback" not in err
    assert list(temporary.iterdir()) == []
    assert [path.name for path in tmp_path.iterdir()] == ["temporary"]
