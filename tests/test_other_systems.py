"""What Linux has and other systems lack is taken away: the package imports, and paints the same pictures.

Where such a part is missing the program goes without: no bound on memory, no masks of signals, and workers
over pipes.
"""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import brushgs as bg
from brushgs.cli import main
from tests.scenes import still_life_of

ROOT = Path(__file__).resolve().parents[1]
# As on Windows; what the standard library itself calls on this system must stay.
WITHOUT = """
import os, signal, sys
sys.modules.update(dict.fromkeys(("resource", "fcntl", "pwd", "grp", "termios", "syslog")))
for module, names in {
    os: "sched_getaffinity sched_setaffinity killpg setsid getpgid getpgrp fork forkpty getuid geteuid "
        "chown mkfifo statvfs nice getloadavg sched_getscheduler sched_getparam sched_setscheduler",
    signal: "SIGHUP SIGALRM SIGUSR1 SIGPIPE pthread_sigmask pthread_kill setitimer alarm SIG_BLOCK",
}.items():
    for name in names.split():
        delattr(module, name)
import brushgs.core.streams as streams
streams.INHERITS_SOCKETS = False
from brushgs.cli import main
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "a.ply"
    bg.save(still_life_of(1000), path)
    return path


def run(folder, begin, *words, **variables):
    return subprocess.run(
        [sys.executable, *begin, *map(str, words)],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | variables,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )


@pytest.mark.parametrize(
    ("target", "more"),
    [("a.avif", []), ("%02d.png", ["--orbit", "3", "--jobs", "2"])],
    ids=["AVIF", "two processes"],
)
def test_a_render_is_the_same_without_what_only_linux_has(scene, tmp_path, target, more):
    words = ["render", scene, "--look", "plain", "--see", "off", "--strokes", "50", "--size", "48x27", *more]
    here, elsewhere = tmp_path / "here", tmp_path / "elsewhere"
    here.mkdir()
    elsewhere.mkdir()
    assert main([*map(str, words), "--quiet", "-o", str(here / target)]) == 0
    found = run(elsewhere, ["-c", WITHOUT], *words, "-o", elsewhere / target)
    assert found.returncode == 0, found.stderr
    pictures = [
        [path.read_bytes() for path in sorted(folder.glob(f"*{Path(target).suffix}"))]
        for folder in (here, elsewhere)
    ]
    assert len(pictures[0]) == (3 if more else 1)
    assert pictures[0] == pictures[1]


def test_a_name_that_the_terminal_cannot_write_is_no_error(scene, tmp_path):
    words = ["render", scene, "--look", "plain", "--strokes", "50", "--size", "32x18", "--json"]
    words += ["-o", tmp_path / "画.png"]
    found = run(tmp_path, ["-m", "brushgs"], *words, PYTHONIOENCODING="ascii:strict", LC_ALL="C.UTF-8")
    assert found.returncode == 0, found.stderr
    assert (tmp_path / "画.png").exists()
