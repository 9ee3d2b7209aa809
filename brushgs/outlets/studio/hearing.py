"""Scene warnings by thread, so that each task gets its own."""

import threading
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from brushgs.errors import SceneWarning


class Heard:
    """Warnings by thread."""

    def __init__(self) -> None:
        self._of_thread: dict[int, list[str]] = {}

    def take(self) -> list[str]:
        """The warnings of this thread since the last call."""
        return self._of_thread.pop(threading.get_ident(), [])

    def _hear(self, message: Warning | str, *_: Any, **__: Any) -> None:
        self._of_thread.setdefault(threading.get_ident(), []).append(str(message))


@contextmanager
def hearing_warnings() -> Iterator[Heard]:
    """Within the block SceneWarnings of all threads are collected, not printed.

    Warning filters are per process, so use it once, where the threads are started.
    """
    heard = Heard()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", SceneWarning)
        warnings.showwarning = heard._hear
        yield heard
