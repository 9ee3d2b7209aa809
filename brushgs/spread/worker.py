"""What runs in a process that `Processes` has started: it waits for items and answers each with its result.

Started as `python -c BOOT descriptor num_threads *sys.path`: a fresh interpreter, so that neither threads nor
the state of the first process is copied (a fork of a process with threads may hang), and one that knows
nothing of the script that runs there (which `multiprocessing` would import, and so run, once more).
"""

import pickle
import socket
import traceback
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

from brushgs.spread import wire
from brushgs.threads import at_most

BOOT = (
    "import sys; descriptor, num_threads, *sys.path = sys.argv[1:]; "
    "from brushgs.spread.worker import serve; serve(int(descriptor), int(num_threads))"
)


class Done(NamedTuple):
    """What `work` returned, and the warnings (message, category, file, line) it gave."""

    result: object
    warnings: list[tuple[Warning | str, type[Warning], str, int]]


class Failed(NamedTuple):
    """What `work` raised, and where, as text: a traceback does not travel."""

    error: BaseException
    where: str


def serve(descriptor: int, num_threads: int) -> None:
    """Read pickled `work`, then items until the other end of the socket is closed; answer every item."""
    with socket.socket(fileno=descriptor) as stream, at_most(num_threads):
        try:
            work = _unpickle(wire.receive(stream))
            while True:
                wire.send(stream, _answer(work, wire.receive(stream)))
        except (EOFError, OSError):  # closed: whoever asked is gone, whether in peace or killed
            return


def _unpickle(message: bytearray) -> Callable[[Any], object]:
    try:
        return pickle.loads(message)  # type: ignore[no-any-return]
    except Exception as error:
        return _Refusal(error)


class _Refusal:
    """Stands for work that could not be unpickled: the answer to every item says why."""

    def __init__(self, error: Exception) -> None:
        self.error = error

    def __call__(self, item: object) -> object:
        raise self.error


def _answer(work: Callable[[Any], object], message: bytearray) -> bytes:
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")  # which of them matter, the first process decides
            result = work(pickle.loads(message))
        told = [(w.message, w.category, w.filename, w.lineno) for w in caught]
        return pickle.dumps(Done(result, told), pickle.HIGHEST_PROTOCOL)
    except BaseException as error:
        return _failure(error, traceback.format_exc())


def _failure(error: BaseException, where: str) -> bytes:
    try:
        message = pickle.dumps(Failed(error, where), pickle.HIGHEST_PROTOCOL)
        pickle.loads(message)  # many an exception can be pickled but not read back
        return message
    except Exception:
        name = type(error).__qualname__
        return pickle.dumps(Failed(RuntimeError(f"{name}: {error}"), where), pickle.HIGHEST_PROTOCOL)
