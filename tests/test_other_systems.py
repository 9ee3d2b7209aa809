"""What Linux has and other systems lack is taken away: the package imports, and paints the same pictures.

Where such a part is missing the program goes without: no bound on memory, no masks of signals, and workers
over pipes.
"""

from pathlib import Path

import pytest

from brushgs.cli import main
from tests.kit.programs import ran

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
    code, _, err = ran("-c", WITHOUT, *words, "-o", elsewhere / target, cwd=elsewhere)
    assert code == 0, err
    files = (sorted(folder.glob(f"*{Path(target).suffix}")) for folder in (here, elsewhere))
    pictures = [[path.read_bytes() for path in paths] for paths in files]
    assert len(pictures[0]) == (3 if more else 1)
    assert pictures[0] == pictures[1]


def test_a_name_that_the_terminal_cannot_write_is_no_error(scene, tmp_path):
    words = ["render", scene, "--look", "plain", "--strokes", "50", "--size", "32x18", "--json"]
    words += ["-o", tmp_path / "画.png"]
    variables = {"PYTHONIOENCODING": "ascii:strict", "LC_ALL": "C.UTF-8"}
    code, _, err = ran("-m", "brushgs", *words, cwd=tmp_path, env=variables)
    assert code == 0, err
    assert (tmp_path / "画.png").exists()
