"""Items worked on by an existing Dask cluster: Dask decides where, moves the data and minds the machines.

What is added here: the work is unpickled once per process, a bounded number of items is under way, and what
Dask gives up after its own retries is begun anew, some times.
"""

import pickle
from collections.abc import Callable
from concurrent.futures import CancelledError
from types import TracebackType
from typing import Any

import brushgs
from brushgs.painting.parallel.connection import check_brushgs, check_versions, wait_for_workers
from brushgs.painting.parallel.messages import TRIES, Failed, Parcel, answer, pickled, result_of
from brushgs.threads import at_most

LOOK = 5.0  # seconds between looks at whether there are workers, while a result is waited for


class Cluster:
    """A place for work on a Dask cluster, which is left as it was found."""

    def __init__(self, client: Any, work: Callable[[Any], object]) -> None:
        self._client = client
        self._parcel = Parcel(pickled("work", work))
        self._sent = self._send()
        self._under_way: dict[int, Any] = {}

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._client.status == "running":
            self._client.cancel([*self._under_way.values(), self._sent], force=True)

    @property
    def limit(self) -> int:
        """Two items per thread of the workers there are now."""
        num_threads: int = sum(self._client.nthreads().values())
        return max(1, 2 * num_threads)

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Begin with an item, as it is now."""
        message = pickled(f"item {index}", item)  # Dask itself would look into it, for its own keys and tasks
        self._begin(index, message)
        return lambda: result_of(pickle.loads(self._answer(index, message)))

    def _begin(self, index: int, message: bytes) -> None:
        self._under_way[index] = self._client.submit(
            work_on, self._sent, message, brushgs.__version__, pure=False
        )

    def _answer(self, index: int, message: bytes) -> bytes:
        from distributed import KilledWorker

        losses = 0
        while True:
            try:
                return self._wait(index)
            except KilledWorker as error:  # Dask has tried before it says so
                losses += error.allowed_failures + 1
            except CancelledError:  # lost with the last process that had the work
                losses += 1
                if self._sent.status != "finished":
                    self._sent = self._send()
            except Exception:
                check_versions(self._client)  # a worker may have come later
                raise
            if losses >= TRIES:
                raise ChildProcessError(
                    f"spread: item {index} was lost {losses} times with the workers that had it; "
                    "if memory ran out, give them more; their logs tell"
                )
            self._begin(index, message)

    def _wait(self, index: int) -> bytes:
        """The answer, however long it takes, as long as there is somebody to work on it."""
        while True:
            try:
                reply: bytes = self._under_way[index].result(timeout=LOOK)
            except TimeoutError:
                wait_for_workers(self._client)
            else:
                del self._under_way[index]
                return reply

    def _send(self) -> Any:
        """The work, brought to every worker there is; those that come later get it from one of these."""
        wait_for_workers(self._client)
        return self._client.scatter(self._parcel, broadcast=True, hash=False)


def work_on(parcel: Parcel, message: bytes, version: str) -> bytes:
    """What a worker does with an item: see `messages.answer`. One thread each: Dask counts a task as one."""
    try:
        check_brushgs("worker", brushgs.__version__, version)  # it may have come after the others were asked
    except ValueError as error:
        return pickle.dumps(Failed(error, ""))
    with at_most(1):
        return answer(parcel, message, hears_warnings=False)
