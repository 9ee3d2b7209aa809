"""What processes send each other: pickled work and items one way; results, warnings and errors the other."""

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

# Processes that one item may lose before it is an error. The first may have been killed because another
# process used up the memory; the third was not.
MAX_ATTEMPTS = 3


class Done(NamedTuple):
    """What `work` returned, and the warnings it issued as (message, category, file, line)."""

    result: object
    warnings: list[tuple[Warning | str, type[Warning], str, int]]


class Failed(NamedTuple):
    """What `work` raised, and its traceback as text: a traceback object cannot be pickled."""

    error: BaseException
    traceback: str


class _ReplyPickler(pickle.Pickler):
    """Writes exceptions in their own form, also where a library has registered another one (tblib)."""

    def reducer_override(self, obj: Any) -> Any:
        return (
            obj.__reduce_ex__(pickle.HIGHEST_PROTOCOL) if isinstance(obj, BaseException) else NotImplemented
        )


class _Pickler(pickle.Pickler):
    """Refuses what is defined in the running script, which other processes cannot import."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, (type, FunctionType)) and obj.__module__ == "__main__":
            raise ValueError(
                f"parallel_map: {obj.__qualname__} must be defined in a module that other processes can "
                "import, got it in the running script; move it to a file of its own and import it"
            )
        return NotImplemented


def pickled(what: str, value: object) -> bytes:
    """The value as bytes.

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
    """A reply as bytes, which `opened` reads."""
    buffer = io.BytesIO()
    _ReplyPickler(buffer, pickle.HIGHEST_PROTOCOL).dump(reply)
    return buffer.getvalue()


class PickledWork:
    """Work as bytes, unpickled at the first call and kept from then on."""

    def __init__(self, message: bytes | bytearray) -> None:
        self._message: bytes | bytearray | None = message
        self._work: Callable[[Any], object] | None = None
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """For pickle: it moves from one worker to another as bytes again."""
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
        records_warnings: whether warnings go into the reply. Recording is per process, not per thread: turn
            it off where several threads work, or they record each other's warnings.

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
    """Opens a reply of plain values, builtin exceptions and errors of the classes given: nothing runs."""

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
    """A reply; where `errors` are given, of a process that may do anything: see `_ReplyUnpickler`.

    Raises:
        pickle.UnpicklingError: if such a reply holds anything else.
    """
    found = pickle.loads(reply) if errors is None else _ReplyUnpickler(reply, errors).load()
    if not isinstance(found, Done | Failed):
        raise pickle.UnpicklingError("a reply must be Done or Failed")
    return found


def result_of(reply: Done | Failed) -> object:
    """Issue the warnings of `work` and return its result, or raise what it raised."""
    if isinstance(reply, Failed):
        reply.error.add_note(f"in another process:\n{reply.traceback}")
        raise reply.error
    for message, category, file, line in reply.warnings:
        warnings.warn_explicit(message, category, file, line)
    return reply.result
