"""Messages between processes: pickled work and items one way; results, warnings and errors the other."""

import builtins
import io
import pickle
import threading
import traceback
import warnings
from collections.abc import Callable
from contextlib import nullcontext
from types import FunctionType
from typing import Any, NamedTuple

# Attempts per item: its process may have been killed because another one used up the memory, but not three
# times.
MAX_ATTEMPTS = 3


class Done(NamedTuple):
    """Result of `work`, and its warnings as (message, category, file, line)."""

    result: object
    warnings: list[tuple[Warning | str, type[Warning], str, int]]


class Failed(NamedTuple):
    """Error of `work`, and its traceback as text (traceback objects cannot be pickled)."""

    error: BaseException
    traceback: str


class _ReplyPickler(pickle.Pickler):
    """Pickles exceptions by their own `__reduce_ex__`, even if a library (tblib) has registered another."""

    def reducer_override(self, obj: Any) -> Any:
        return (
            obj.__reduce_ex__(pickle.HIGHEST_PROTOCOL) if isinstance(obj, BaseException) else NotImplemented
        )


class _Pickler(pickle.Pickler):
    """Refuses objects defined in the running script, which other processes cannot import."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, (type, FunctionType)) and obj.__module__ == "__main__":
            raise ValueError(
                f"parallel_map: {obj.__qualname__} must be defined in a module that other processes can "
                "import, got it in the running script; move it to a file of its own and import it"
            )
        return NotImplemented


def pickled(what: str, value: object) -> bytes:
    """Pickle a value.

    Raises:
        TypeError: if it cannot be pickled; `what` names it in the message.
        ValueError: if a part of it is defined in the running script.
    """
    buffer = io.BytesIO()
    try:
        _Pickler(buffer, pickle.HIGHEST_PROTOCOL).dump(value)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise TypeError(
            f"parallel_map: {what} must be picklable to reach other processes: {error}"
        ) from error
    return buffer.getvalue()


def reply_bytes(reply: Done | Failed) -> bytes:
    """Pickle a reply; `opened` reads it."""
    buffer = io.BytesIO()
    _ReplyPickler(buffer, pickle.HIGHEST_PROTOCOL).dump(reply)
    return buffer.getvalue()


class PickledWork:
    """Pickled work, unpickled at the first call and then kept."""

    def __init__(self, message: bytes | bytearray) -> None:
        self._message: bytes | bytearray | None = message
        self._work: Callable[[Any], object] | None = None
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as bytes, to move from one worker to another."""
        with self._lock:
            if self._message is not None:
                return PickledWork, (self._message,)
            return PickledWork, (pickle.dumps(self._work, pickle.HIGHEST_PROTOCOL),)

    def __call__(self, item: object) -> object:
        """Do the work."""
        with self._lock:  # only one of several threads unpickles
            if self._work is None:
                assert self._message is not None
                self._work, self._message = pickle.loads(self._message), None
        return self._work(item)


def run_item(
    work: Callable[[Any], object], message: bytes | bytearray, *, records_warnings: bool = True
) -> bytes:
    """Call `work` with a pickled item.

    Args:
        work: the work.
        message: the item, pickled.
        records_warnings: put warnings into the reply. Recording is per process: turn it off if several
            threads work.

    Returns:
        `Done` or `Failed`, pickled. Nothing is raised.
    """
    try:
        with warnings.catch_warnings(record=True) if records_warnings else nullcontext() as caught:
            if caught is not None:
                warnings.simplefilter("always")  # the receiving process filters them
            result = work(pickle.loads(message))
        recorded = [(w.message, w.category, w.filename, w.lineno) for w in caught or ()]
        return reply_bytes(Done(result, recorded))
    except BaseException as error:
        return _failure(error, traceback.format_exc())


def _failure(error: BaseException, trace: str) -> bytes:
    try:
        message = reply_bytes(Failed(error, trace))
        pickle.loads(message)  # some exceptions can be pickled but not unpickled
        return message
    except Exception:
        name = type(error).__qualname__
        return reply_bytes(Failed(RuntimeError(f"{name}: {error}"), trace))


class _ReplyUnpickler(pickle.Unpickler):
    """Opens a reply with only plain values, builtin exceptions and given error classes: no code runs."""

    def __init__(self, message: bytes | bytearray, errors: tuple[type, ...]) -> None:
        super().__init__(io.BytesIO(message))
        self._known = {(one.__module__, one.__qualname__): one for one in (Done, Failed, *errors)}

    def find_class(self, module: str, name: str) -> Any:
        known = self._known.get((module, name))
        builtin = getattr(builtins, name, None) if module == "builtins" else None
        if known is None and not (isinstance(builtin, type) and issubclass(builtin, BaseException)):
            raise pickle.UnpicklingError(f"a reply may not hold {module}.{name}")
        return known or builtin


def opened(reply: bytes | bytearray, errors: tuple[type, ...] | None) -> Done | Failed:
    """Unpickle a reply; with `errors` one of an untrusted process, see `_ReplyUnpickler`.

    Raises:
        pickle.UnpicklingError: if an untrusted reply holds anything else.
    """
    found = pickle.loads(reply) if errors is None else _ReplyUnpickler(reply, errors).load()
    if not isinstance(found, Done | Failed):
        raise pickle.UnpicklingError("a reply must be Done or Failed")
    return found


def result_of(reply: Done | Failed) -> object:
    """Issue the warnings of `work`, and return its result or raise its error."""
    if isinstance(reply, Failed):
        reply.error.add_note(f"in another process:\n{reply.traceback}")
        raise reply.error
    for message, category, file, line in reply.warnings:
        warnings.warn_explicit(message, category, file, line)
    return reply.result
