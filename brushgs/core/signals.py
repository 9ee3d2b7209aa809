"""Stop signals: Ctrl-C, SIGTERM (`kill`, `timeout`) and SIGHUP (closed terminal).

Python raises KeyboardInterrupt for the first. The command line treats the others alike
(`brushgs.cli.stopping`); a script that imports brushgs is killed by them unless it handles them.
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
    """Defer stop signals until the block is done, for short work that must not stop midway.

    Python handles signals only in the main thread; in other threads there is nothing to defer.
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
