"""What the tests need of the process they run in."""

import signal

# In one place for all folders: a session has one browser.
from tests.chromium import browser, open_page, open_shared_page  # noqa: F401

# A shell that runs the tests in the background has them ignore Ctrl-C, and all programs that they start with
# them. Tests that press it want it heard.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
