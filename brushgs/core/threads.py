"""How many threads the compiled core runs in, decided in one place."""

import operator
import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
MOST_THREADS = 1024  # that are started; far more than pay, and as many as any system gives
MOST_AT_ONCE = 4  # of `side_by_side`: more would wait for each other's Python

_most: ContextVar[int | None] = ContextVar("_most", default=None)


@contextmanager
def at_most(num_threads: int) -> Iterator[None]:
    """Within this context `num_threads=None` means so many: for processes that share a machine."""
    token = _most.set(num_threads)
    try:
        yield
    finally:
        _most.reset(token)


def num_threads_or_default(num_threads: int | None) -> int:
    """The number of threads to run in; for None, as many as there are CPUs this process may use.

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
        if hasattr(os, "sched_getaffinity"):  # Linux: a container or `taskset` may leave fewer than there are
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
    """`work` of each item, in order, several items at once, which share the threads of the core.

    For many small pictures: what Python and NumPy do around the core then overlaps as well.
    """
    return list(in_turn(work, items, num_threads))


def in_turn(
    work: Callable[[Item], Result],
    items: Iterable[Item],
    num_threads: int | None = None,
    *,
    at_once: int = MOST_AT_ONCE,
) -> Iterator[Result]:
    """`side_by_side`, its results one by one; at most `at_once` items at a time, and as many results wait."""
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
        ahead = num_workers + 1  # one more than workers: none waits for what is done with a result
        waiting = deque(pool.submit(shared, item) for item in items[:ahead])
        for item in items[ahead:]:
            result = waiting.popleft().result()
            waiting.append(pool.submit(shared, item))
            yield result
        yield from (future.result() for future in waiting)
