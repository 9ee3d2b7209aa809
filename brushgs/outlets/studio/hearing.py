"""Warnings about scenes, by the thread that they were given in: each piece of work has its own."""

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from brushgs.errors import SceneWarning


class Heard:
    """The warnings that threads gave."""

    def __init__(self) -> None:
        self._of_thread: dict[int, list[str]] = {}

    def take(self) -> list[str]:
        """What this thread was warned of since it asked last."""
        return self._of_thread.pop(threading.get_ident(), [])

    def _hear(self, message: Warning | str, *_: Any, **__: Any) -> None:
        self._of_thread.setdefault(threading.get_ident(), []).append(str(message))


@contextmanager
def hearing_warnings() -> Iterator[Heard]:
    """Within the block SceneWarnings of all threads are heard and none is printed.

    Filters belong to the process, so this is done once, where the threads are started.
    """
    heard = Heard()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", SceneWarning)
        warnings.showwarning = heard._hear
        yield heard
