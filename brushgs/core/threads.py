"""The number of threads of the compiled core, decided in one place."""

import operator
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
MOST_THREADS = 1024  # far more than useful
MOST_AT_ONCE = 4  # of `side_by_side`: more would wait for the GIL

_most: ContextVar[int | None] = ContextVar("_most", default=None)


@contextmanager
def at_most(num_threads: int) -> Iterator[None]:
    """Within this context `num_threads=None` means this many, for processes that share a machine."""
    token = _most.set(num_threads)
    try:
        yield
    finally:
        _most.reset(token)


def num_threads_or_default(num_threads: int | None) -> int:
    """The number of threads; None means all CPUs available to this process.

    Results never depend on it.

    Args:
        num_threads: 1 to `MOST_THREADS`, or None.

    Raises:
        TypeError: if `num_threads` is not an integer.
        ValueError: if `num_threads` is out of range.
    """
    if num_threads is None:
        if (most := _most.get()) is not None:
            return most
        if hasattr(os, "sched_getaffinity"):  # Linux: a container or `taskset` may allow fewer
            return len(os.sched_getaffinity(0))
        return os.cpu_count() or 1
    try:
        num_threads = operator.index(num_threads)
    except TypeError:
        kind = type(num_threads).__name__
        raise TypeError(f"num_threads must be an integer, got {kind}; omit it for every CPU") from None
    if not 1 <= num_threads <= MOST_THREADS:
        rule = f"must be in 1 to {MOST_THREADS}"
        raise ValueError(f"num_threads {rule}, got {num_threads}; omit it for every CPU")
    return num_threads


def side_by_side(
    work: Callable[[Item], Result], items: Iterable[Item], num_threads: int | None = None
) -> list[Result]:
    """Results of `work` for each item in order, several items in parallel, sharing the threads of the core.

    For many small pictures: the work of Python and NumPy around the core overlaps too.
    """
    return list(in_turn(work, items, num_threads))


def in_turn(
    work: Callable[[Item], Result],
    items: Iterable[Item],
    num_threads: int | None = None,
    *,
    at_once: int = MOST_AT_ONCE,
) -> Iterator[Result]:
    """`side_by_side` as an iterator; at most `at_once` items run, and as many results wait."""
    items, most = list(items), num_threads_or_default(num_threads)
    num_workers = min(most, at_once, len(items))

    def shared(item: Item) -> Result:
        with at_most(max(most // max(num_workers, 1), 1)):
            return work(item)

    if num_workers < 2:
        yield from map(shared, items)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(num_workers) as pool:
        ahead = num_workers + 1  # one more than workers, so that none waits for the consumer
        waiting = deque(pool.submit(shared, item) for item in items[:ahead])
        for item in items[ahead:]:
            result = waiting.popleft().result()
            waiting.append(pool.submit(shared, item))
            yield result
        yield from (future.result() for future in waiting)
