"""Closed and broken streams: a command ends quietly, or does its work without them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.kit.for_each import for_each
from tests.kit.programs import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no shell for this")


@pytest.fixture
def run(scene, tmp_path):
    """Exit code, stdout and stderr of `brushgs WORDS REDIRECTION`, in a folder with nothing but the scene."""
    (tmp_path / "a.ply").symlink_to(scene)

    def run(words, redirection):
        words = f"{{ '{sys.executable}' -m brushgs {words}; echo $? > code; }} {redirection}"
        how = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(ROOT)}, "capture_output": True}
        found = subprocess.run(["sh", "-c", words], **how, text=True, check=False)
        return int((tmp_path / "code").read_text()), found.stdout, found.stderr

    return run


RENDER = "render a.ply --look plain --see off --stroke ellipse --strokes 50 --size 32x24 -o a.png"
GONE = "| { true; }"


@for_each(("redirection", "out"), [("<&- >&- 2>&-", ""), (f"2>&1 {GONE}", ""), ("2>/dev/full", "a.png\n")])
def test_a_picture_is_painted_whatever_becomes_of_the_words_about_it(run, tmp_path, redirection, out):
    code, found, err = run(RENDER, redirection)
    assert (code, found) == (0, out)
    assert "fault" not in err
    assert "error" not in err
    assert "Traceback" not in err
    assert (tmp_path / "a.png").read_bytes()[:4] == b"\x89PNG"


@for_each(
    ("words", "redirection", "code"),
    [("info a.ply", GONE, 0), ("--help", ">&- 2>&-", 0), ("render none.ply", "2>/dev/full", 2)],
)
def test_what_nobody_reads_ends_quietly_with_its_exit_code(run, words, redirection, code):
    assert run(words, redirection) == (code, "", "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disc_behind_stdout_gets_a_sentence(run):
    code, _, err = run(RENDER, "> /dev/full")
    assert code == 2
    assert err.endswith("brushgs: standard output: No space left on device; write it elsewhere\n")
    assert "Exception ignored" not in err
