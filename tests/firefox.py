"""Firefox for tests of the page: Debian's, on a software renderer, driven by its own protocol (Marionette).

Without a screen Firefox has no WebGL, so that it runs on a virtual one, of Xvfb.
"""

import json
import os
import shutil
import socket
import subprocess
import time
from contextlib import ExitStack, contextmanager

import pytest

FIREFOX, SCREEN = shutil.which("firefox-esr"), shutil.which("Xvfb")
SECONDS = 60.0  # that an answer may take; a limit, not a measure
PREFERENCES = {
    "webgl.force-enabled": True,
    "ui.prefersReducedMotion": 1,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
}


class Firefox:
    """A window of Firefox.

    Args:
        port: at which its process listens, or will.
    """

    def __init__(self, port):
        self._socket, self._asked = _connected(port), 0
        self._socket.settimeout(SECONDS)
        self._file = self._socket.makefile("rb")
        self._read()  # who it is
        self._ask("WebDriver:NewSession")

    def open(self, path):
        """Open a file."""
        self._ask("WebDriver:Navigate", url=path.as_uri())

    def evaluate(self, script):
        """The result of a script, which hands it to `done`."""
        code = f"const done = arguments[0]; {script}"
        answer = self._ask("WebDriver:ExecuteAsyncScript", script=code, args=[], sandbox=None)
        return answer["value"]

    def close(self):
        """Let go of it."""
        self._socket.close()

    def _ask(self, command, **fields):
        self._asked += 1
        text = json.dumps([0, self._asked, command, fields]).encode()
        self._socket.sendall(b"%d:%s" % (len(text), text))
        _, _, error, answer = self._read()
        assert error is None, error
        return answer

    def _read(self):
        length = b""
        while (digit := self._file.read(1)) != b":":
            assert digit, "Firefox has ended"
            length += digit
        return json.loads(self._file.read(int(length)))


@pytest.fixture(scope="module")
def firefox(tmp_path_factory):
    """A window of Firefox; skips where it or its screen is missing."""
    if FIREFOX is None or SCREEN is None:
        pytest.skip(f"{'firefox-esr' if FIREFOX is None else 'Xvfb'} is not installed")
    profile, port = tmp_path_factory.mktemp("profile"), _free_port()
    preferences = {**PREFERENCES, "marionette.port": port}
    lines = (f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in preferences.items())
    (profile / "user.js").write_text("\n".join(lines))
    with ExitStack() as stack:
        screen = stack.enter_context(_screen())
        words = [FIREFOX, "--marionette", "--no-remote", "--profile", profile, "--width", "320"]
        words += ["--height", "300"]
        environment = os.environ | {"DISPLAY": screen, "HOME": str(profile), "LIBGL_ALWAYS_SOFTWARE": "1"}
        process = subprocess.Popen(words, env=environment, **_silent())
        stack.enter_context(process)
        stack.callback(process.kill)
        window = Firefox(port)
        stack.callback(window.close)
        yield window


@contextmanager
def _screen():
    """A virtual screen within a block, whose name it gives."""
    read, write = os.pipe()
    words = [SCREEN, "-displayfd", str(write), "-screen", "0", "1024x768x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, pass_fds=[write], **_silent()) as process:
        try:
            os.close(write)
            with os.fdopen(read) as told:
                yield f":{told.readline().strip()}"
        finally:
            process.kill()


def _silent():
    return dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)


def _free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


def _connected(port):
    end = time.monotonic() + SECONDS
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=SECONDS)
        except OSError:
            assert time.monotonic() < end, "Firefox does not answer"
            time.sleep(0.1)
