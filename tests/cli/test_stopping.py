"""SIGTERM and SIGHUP clean up as Ctrl-C does, and their exit codes are those that a shell gives them."""

import os
import signal
import sys
import time

import pytest

from brushgs.cli.stopping import Stop, hearing_stops
from brushgs.formats.pictures.images import read_image
from tests.kit import programs
from tests.kit.commands import names
from tests.kit.for_each import for_each

# Strokes that are soon made: signals come while they are painted.
SOON = ["--look", "plain", "--see", "off", "--stroke", "ellipse", "--strokes", "100"]
CODES = {signal.SIGINT: 130, signal.SIGTERM: 143}
if hasattr(signal, "SIGHUP"):
    CODES[signal.SIGHUP] = 129

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no signals to send")


@pytest.fixture
def place(tmp_path):
    """A folder with empty ones for output and for temporary files."""
    for name in ("out", "temporary"):
        (tmp_path / name).mkdir()
    return tmp_path


@pytest.fixture
def start(scene, place):
    """Starts a painting; a long one with these words."""

    def start(*words):
        command, env = ("-m", "brushgs", "render", scene, *SOON, *words), {"TMPDIR": str(place / "temporary")}
        return programs.start(*command, cwd=place / "out", env=env, start_new_session=True)

    return start


LONG = "--orbit", "3000", "--size", "160x120"


def wait_until(condition, process):
    until = time.monotonic() + 60
    while not condition():
        assert process.poll() is None, process.stderr.read()
        if time.monotonic() > until:
            process.kill()  # or the end of the test would wait for it
            raise TimeoutError
        time.sleep(0.005)


@pytest.mark.parametrize(
    ("number", "words"), [(signal.SIGINT, ("-o", "a.mp4")), (signal.SIGHUP, ("-o", "a.gif", "--jobs", "2"))]
)
def test_every_video_is_whole_or_not_there(start, place, number, words):
    with start(*LONG, *words) as process:
        wait_until(lambda: names(place / "out"), process)
        process.send_signal(number)
        out, err = process.communicate()
    assert (process.returncode, out) == (CODES[number], "")
    assert err == "brushgs: stopped: no video was written; numbered frames, -o a/, can be resumed\n"
    assert names(place / "out") == names(place / "temporary") == []


def test_a_still_is_whole_or_not_there(start, place):
    """The signal comes while the picture is written: encoders are not interrupted, but nothing is left."""
    with start("--size", "1500x1000", "-o", "a.exr") as process:
        wait_until(lambda: names(place / "out"), process)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate()
    assert (process.returncode, err) in [(143, "brushgs: stopped\n"), (0, "")]
    left = names(place / "out")
    assert left in ([], ["a.exr"])
    assert names(place / "temporary") == []
    if left:
        assert read_image(place / "out" / "a.exr").shape[:2] == (1000, 1500)


def test_a_signal_to_all_processes_leaves_none_of_their_files(start, place):
    """As `timeout` sends it: to the whole group, and twice to the first process."""
    with start(*LONG, "-o", "f/%05d.exr", "--jobs", "3") as process:
        wait_until((place / "out/f/00005.exr").exists, process)
        process.send_signal(signal.SIGTERM)
        os.killpg(process.pid, signal.SIGTERM)
        out, err = process.communicate()  # ends when no process holds the pipe any more
    assert (process.returncode, out) == (143, "")
    assert "of 3000 frames are done; add --resume to paint the rest\n" in err
    assert err.count("\n") == 1
    left = names(place / "out/f")
    assert left == [".%05d.exr.json", *(f"{index:05}.exr" for index in range(len(left) - 1))]
    assert names(place / "temporary") == []


def test_a_killed_command_leaves_no_process_and_these_no_files(start, place):
    with start(*LONG, "-o", "f/%05d.exr", "--jobs", "2") as process:
        wait_until((place / "out/f/00005.exr").exists, process)
        process.kill()
        process.communicate()
    until = time.monotonic() + 60
    while names(place / "temporary"):
        assert time.monotonic() < until
        time.sleep(0.01)


def test_the_second_of_two_signals_does_not_interrupt_the_cleaning_up(monkeypatch):
    monkeypatch.setattr("brushgs.cli.stopping.SECONDS_OF_ONE_STOP", 1e9)
    stop = Stop()
    with pytest.raises(KeyboardInterrupt):
        stop.hear(signal.SIGTERM, None)
    stop.hear(signal.SIGTERM, None)
    assert stop.exit_code == 143
    monkeypatch.setattr("brushgs.cli.stopping.SECONDS_OF_ONE_STOP", 0.0)
    with pytest.raises(KeyboardInterrupt):
        stop.hear(signal.SIGTERM, None)


@for_each("number", CODES)
def test_a_stop_amid_generated_code_gives_the_exit_code_too(number):
    """As while a dataclass is made: Python would end by SIGINT, 4 of 37 commands stopped at any time did."""
    code = f"""
import sys
from brushgs.cli.stopping import hearing_stops
with hearing_stops() as stop:
    try:
        exec("import signal; signal.raise_signal({int(number)})\\nwhile True: pass")
    except KeyboardInterrupt:
        exit_code = stop.exit_code
sys.exit(exit_code)
"""
    assert programs.ran("-c", code)[0] == CODES[number]


def test_handlers_of_others_stay():
    """`nohup` ignores SIGHUP; a program that calls `main` may handle SIGTERM."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN), signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with hearing_stops():
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) != signal.SIG_DFL
            assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before[0])
        signal.signal(signal.SIGTERM, before[1])
