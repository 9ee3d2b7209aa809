"""The same work for many items, in several processes or on a Dask cluster; results in order.

Results must not depend on where an item is processed: an item carries everything specific to it, as a
`FrameView` of a sequence does.
"""

import operator
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from brushgs.pipeline.parallel.connection import Waiting

T = TypeVar("T")
R = TypeVar("R")


class WorkerPool(Protocol):
    """Workers that process items."""

    @property
    def limit(self) -> int:
        """The most items in flight: submitted, and their result not yet fetched."""

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Start an item; the returned function waits for its result and returns it."""


def parallel_map(
    work: Callable[[T], R],
    items: Iterable[T],
    *,
    jobs: int = 1,
    scheduler: str | None = None,
    waiting: "Waiting | None" = None,
) -> Iterator[R]:
    """Call `work` with every item, in several processes.

    Nothing starts before the first result is requested. At most two items per process are in flight, results
    that wait for their turn included, so memory stays bounded and `items` may be endless. To stop early,
    close the iterator (or delete it, or press Ctrl-C): local processes are killed at once, and a cluster is
    left as it was. If a process dies, for example out of memory, it is replaced and its item processed again.

    With `num_threads=None` the local processes share the CPUs of the machine; a worker of a cluster uses one
    thread, because Dask counts a task as one. Warnings of `work` are issued here, in the turn of their item;
    those on a cluster go to the log of the worker.

    Args:
        work: a function or callable object. With `jobs` above 1 or a scheduler it is pickled and sent to each
            process once, so it must belong to a module that other processes can import: not to the script
            that is running. The script needs no `if __name__ == "__main__"` and is not run again.
        items: the arguments of `work`, one at a time; pickled if they are sent to another process.
        jobs: number of processes on this machine, at least 1; 1 means this process.
        scheduler: address of a running Dask scheduler, "tcp://host:8786", whose workers do the work; they
            need the same version of brushgs. They also decide the number of processes: omit `jobs`.
        waiting: how long to wait where the scheduler has no worker; None for a minute in silence.

    Returns:
        An iterator over the results, in the order of `items`.

    Raises:
        TypeError: if `work` or an item cannot be pickled.
        ValueError: if `jobs` is below 1, or given together with `scheduler`, or `work` belongs to the running
            script, or Dask is not installed, or the cluster has other versions.
        ConnectionError: if the scheduler cannot be reached, is lost, or has no workers.
        ChildProcessError: if the same item kills its process repeatedly.
        Exception: whatever `work` raises, in the turn of that item; a note holds the traceback.
    """
    jobs = operator.index(jobs)
    if jobs < 1:
        raise ValueError(f"parallel_map: jobs must be at least 1, got {jobs}")
    if scheduler is not None:
        if jobs > 1:
            raise ValueError(
                f"parallel_map: jobs must not be given together with a scheduler, got {jobs}; omit it"
            )
        from brushgs.pipeline.parallel.connection import check_address

        check_address(scheduler)
        return _map_on_cluster(work, items, scheduler, waiting)
    if jobs == 1:
        return (work(item) for item in items)
    return _map_in_processes(work, items, jobs)


def _map_in_processes(work: Callable[[T], R], items: Iterable[T], jobs: int) -> Iterator[R]:
    from brushgs.core.processes import ProcessPool

    with ProcessPool(work, jobs) as pool:
        yield from _map_in_order(pool, items)


def _map_on_cluster(
    work: Callable[[T], R], items: Iterable[T], scheduler: str, waiting: "Waiting | None"
) -> Iterator[R]:
    from brushgs.pipeline.parallel.connection import connect
    from brushgs.pipeline.parallel.dask_cluster import DaskPool

    items = iter(items)
    for first in items:  # without any item no cluster is needed
        with connect(scheduler, waiting) as client, DaskPool(client, work, waiting) as pool:
            yield from _map_in_order(pool, chain([first], items))


def _map_in_order(pool: WorkerPool, items: Iterable[Any]) -> Iterator[Any]:
    in_flight: deque[Callable[[], Any]] = deque()
    for index, item in enumerate(items):
        in_flight.append(pool.submit(index, item))
        while len(in_flight) >= pool.limit:
            yield in_flight.popleft()()
    while in_flight:
        yield in_flight.popleft()()
