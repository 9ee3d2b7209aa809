"""Signals that ask a program to stop: Ctrl-C, SIGTERM (`kill`, `timeout`) and SIGHUP (the terminal is gone).

Python raises KeyboardInterrupt for the first. The program decides about the others: the command line treats
them alike (`brushgs.cli.stopping`), a script that imports brushgs dies of them unless it says otherwise.
"""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

# Windows has no SIGHUP.
STOP_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)


@contextmanager
def defer_stop() -> Iterator[None]:
    """Defer these signals until the block is done: for short work that must not stop midway.

    Python handles signals in its main thread only; in other threads there is nothing to defer.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: received.append(number)) for number in STOP_SIGNALS
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for number in received:
            signal.raise_signal(number)
