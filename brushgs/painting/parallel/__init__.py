"""One piece of work for many items, in several processes or on a cluster: results in the order of the items.

Where an item is worked on changes when its result is ready and nothing else: an item must carry all that is
its own, as a `Shot` of a sequence does.
"""

import operator
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, Protocol, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Place(Protocol):
    """Where items are worked on."""

    @property
    def limit(self) -> int:
        """How many items may be under way, results not yet fetched among them."""

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Begin with an item; what comes back waits for its result and returns it."""


def spread(
    work: Callable[[T], R], items: Iterable[T], *, jobs: int = 1, scheduler: str | None = None
) -> Iterator[R]:
    """Do the same work for every item, in several processes.

    Nothing starts before the first result is asked for. At most two items per process are under way, results
    that wait for their turn among them, so memory stays bounded and `items` may be endless. To end early,
    close the iterator (or let it go, or press Ctrl-C): processes started here are ended at once, and a
    cluster is left as it was. A process that dies, out of memory for one, is replaced, and its item is done
    anew. Drawing (`num_threads=None`) shares the processors out among the processes; on a cluster it takes
    one thread, since workers count a task as one. Warnings of the work are given here, in the turn of
    their item; those on a cluster go to the log of the worker.

    Args:
        work: a function or callable object. With `jobs` above 1 or a scheduler it travels to each process
            once, pickled, so it must belong to a module that other processes can import: not to the script
            that is run itself. The script needs no `if __name__ == "__main__"` and is not run again.
        items: what `work` is called with, one at a time; pickled where they travel.
        jobs: processes on this machine, at least 1; 1 works in this one.
        scheduler: address of an existing Dask scheduler, "tcp://host:8786", whose workers do the work; they
            need the same version of brushgs. `jobs` is then theirs to decide.

    Returns:
        An iterator of the results, in the order of `items`.

    Raises:
        TypeError: if `work` or an item cannot be pickled.
        ValueError: if `jobs` is below 1, or given beside `scheduler`, or `work` belongs to the script itself,
            or Dask is not installed, or the cluster runs other versions.
        ConnectionError: if the scheduler cannot be reached or is lost, or has no workers.
        ChildProcessError: if an item ends its process again and again.
        Exception: whatever `work` raises, when it is the turn of that item; a note says where it did.
    """
    jobs = operator.index(jobs)
    if jobs < 1:
        raise ValueError(f"spread: jobs must be at least 1, got {jobs}")
    if scheduler is not None:
        if jobs > 1:
            raise ValueError(
                f"spread: jobs must be left out beside a scheduler, got {jobs}; its workers decide"
            )
        from brushgs.painting.parallel.connection import check_address

        check_address(scheduler)
        return _on_cluster(work, items, scheduler)
    if jobs == 1:
        return (work(item) for item in items)
    return _in_processes(work, items, jobs)


def _in_processes(work: Callable[[T], R], items: Iterable[T], jobs: int) -> Iterator[R]:
    from brushgs.painting.parallel.processes import Processes

    with Processes(work, jobs) as place:
        yield from _in_order(place, items)


def _on_cluster(work: Callable[[T], R], items: Iterable[T], scheduler: str) -> Iterator[R]:
    from brushgs.painting.parallel.connection import connected
    from brushgs.painting.parallel.dask_cluster import Cluster

    items = iter(items)
    for first in items:  # without any there is no need of a cluster
        with connected(scheduler) as client, Cluster(client, work) as place:
            yield from _in_order(place, chain([first], items))


def _in_order(place: Place, items: Iterable[Any]) -> Iterator[Any]:
    waiting: deque[Callable[[], Any]] = deque()
    for index, item in enumerate(items):
        waiting.append(place.submit(index, item))
        while len(waiting) >= place.limit:
            yield waiting.popleft()()
    while waiting:
        yield waiting.popleft()()
