"""What travels between processes: pickled work and items one way, results, warnings and errors the other."""

import io
import pickle
import threading
import traceback
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from types import FunctionType
from typing import Any, NamedTuple

TRIES = 3  # processes that one item may end: the first may have died of another's hunger, the third did not


class Done(NamedTuple):
    """What `work` returned, and the warnings (message, category, file, line) it gave."""

    result: object
    warnings: list[tuple[Warning | str, type[Warning], str, int]]


class Failed(NamedTuple):
    """What `work` raised, and where, as text: a traceback does not travel."""

    error: BaseException
    where: str


class _Pickler(pickle.Pickler):
    """Refuses what belongs to the script that is run, which other processes do not know."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, (type, FunctionType)) and obj.__module__ == "__main__":
            raise ValueError(
                f"spread: {obj.__qualname__} must be in a module of its own to reach other processes, "
                "got it in the script that is run; move it to a file and import it from there"
            )
        return NotImplemented


def pickled(what: str, value: object) -> bytes:
    """The value as bytes.

    Raises:
        TypeError: if it cannot be pickled; `what` names it.
        ValueError: if something in it belongs to the script that is run.
    """
    buffer = io.BytesIO()
    try:
        _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(value)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise TypeError(f"spread: {what} must be picklable to reach other processes: {error}") from error
    return buffer.getvalue()


class Parcel:
    """Work as bytes that unpacks itself where it is first called, and from then on is kept unpacked."""

    def __init__(self, message: bytes | bytearray) -> None:
        self._message: bytes | bytearray | None = message
        self._work: Callable[[Any], object] | None = None
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """For pickle: from one worker to another it travels as bytes again."""
        with self._lock:
            if self._message is not None:
                return Parcel, (self._message,)
            return Parcel, (pickle.dumps(self._work, pickle.HIGHEST_PROTOCOL),)

    def __call__(self, item: object) -> object:
        """Do the work."""
        with self._lock:  # of several threads one unpacks
            if self._work is None:
                assert self._message is not None
                self._work, self._message = pickle.loads(self._message), None
        return self._work(item)


def answer(
    work: Callable[[Any], object], message: bytes | bytearray, *, hears_warnings: bool = True
) -> bytes:
    """Call `work` with a pickled item.

    Args:
        work: what to do.
        message: the item.
        hears_warnings: whether warnings go into the answer. That takes the process for itself: in one where
            several threads work, they would hear each other's.

    Returns:
        `Done` or `Failed`, pickled. Nothing is raised.
    """
    try:
        with warnings.catch_warnings(record=True) if hears_warnings else nullcontext() as caught:
            if caught is not None:
                warnings.simplefilter("always")  # which of them matter is decided where they arrive
            result = work(pickle.loads(message))
        told = [(w.message, w.category, w.filename, w.lineno) for w in caught or ()]
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


def result_of(reply: Done | Failed) -> object:
    """What `work` returned, after its warnings have been given here; or what it raised is raised here."""
    if isinstance(reply, Failed):
        reply.error.add_note(f"in another process:\n{reply.where}")
        raise reply.error
    for message, category, file, line in reply.warnings:
        warnings.warn_explicit(message, category, file, line)
    return reply.result
