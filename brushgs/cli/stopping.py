"""SIGTERM and SIGHUP stop a command like Ctrl-C, by KeyboardInterrupt, so that it cleans up."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from brushgs.core.signals import STOP_SIGNALS

# `timeout` signals the process and its group, and a closed terminal may add another signal: the second must
# not interrupt the cleanup.
SECONDS_OF_ONE_STOP = 1.0


class Stop:
    """The signal that stopped the command; Ctrl-C if no other did."""

    def __init__(self) -> None:
        self._number: int = signal.SIGINT
        self._time = float("-inf")

    @property
    def exit_code(self) -> int:
        """As a shell reports it: 130 for Ctrl-C, 143 for SIGTERM, 129 for SIGHUP."""
        return 128 + self._number

    def hear(self, number: int, _: FrameType | None) -> None:
        """Handle a signal."""
        now = time.monotonic()
        if now - self._time < SECONDS_OF_ONE_STOP:
            return
        self._number, self._time = number, now
        raise KeyboardInterrupt


@contextmanager
def hearing_stops() -> Iterator[Stop]:
    """Within the block these signals raise KeyboardInterrupt, unless they were handled or ignored before.

    `nohup` ignores SIGHUP, and a program that calls `main` may have its own handlers.
    """
    stop = Stop()
    ours = []
    if threading.current_thread() is threading.main_thread():  # other threads cannot set handlers
        ours = [number for number in STOP_SIGNALS if signal.getsignal(number) == signal.SIG_DFL]
    for number in ours:
        signal.signal(number, stop.hear)
    try:
        yield stop
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)
        _forget_interrupt()


def _forget_interrupt() -> None:
    """Make Python exit with the given code.

    If a KeyboardInterrupt passes through `exec` of text (as dataclasses and named tuples use), Python ends by
    SIGINT even if it was caught. Another `exec` resets that.
    """
    exec("")
