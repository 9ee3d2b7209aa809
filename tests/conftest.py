"""What the tests need of the process they run in."""

import gc
import os
import signal

if "PYTEST_XDIST_WORKER" in os.environ:  # before NumPy is there: processes share the processor already
    for library in ("OPENBLAS", "OMP"):
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from hypothesis import settings

import tests.kit.kept

# In one place for all folders: a session has one browser.
from tests.chromium import browser, open_page, open_shared_page  # noqa: F401
from tests.kit.commands import folder, scene  # noqa: F401

# Commands of one session of tests share what they keep.
tests.kit.kept.share()

# A shell that runs the tests in the background has them ignore Ctrl-C, nohup has them ignore the end of the
# terminal, and so do all programs that they start. Tests that send these signals want them heard.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):  # not on Windows
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# The first case of a test may import what it uses, and machines are shared: no test depends on its time.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")

# Seven thousand tests are half a million objects that stay. The collector of garbage would go through them
# again and again: while they are made, and in each test that makes many objects of its own.
gc.disable()


def pytest_collection_finish():
    """From here on garbage is collected as ever, among what tests make."""
    tests.kit.kept.guard()  # pytest itself has replaced what it replaces
    gc.collect()
    gc.freeze()
    gc.enable()


def pytest_unconfigure():
    """Removes what the session kept."""
    tests.kit.kept.remove()
