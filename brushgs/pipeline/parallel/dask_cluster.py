"""Workers of an existing Dask cluster: Dask decides where an item is processed and moves the data.

Added here: the work is unpickled once per process, a bounded number of items is in flight, and an item that
Dask gives up after its own retries is submitted again a few times.
"""

import pickle
from collections.abc import Callable
from concurrent.futures import CancelledError
from types import TracebackType
from typing import Any

import brushgs
from brushgs.core.messages import MAX_ATTEMPTS, Failed, PickledWork, pickled, reply_bytes, result_of, run_item
from brushgs.core.threads import at_most
from brushgs.pipeline.parallel.connection import Waiting, check_brushgs, check_versions, wait_for_workers

CHECK_INTERVAL = 5.0  # seconds between checks, while a result is awaited, that there are workers at all


class DaskPool:
    """The workers of a Dask cluster, which is left as it was found."""

    def __init__(self, client: Any, work: Callable[[Any], object], waiting: Waiting | None = None) -> None:
        self._client, self._waiting = client, waiting or Waiting()
        self._work = PickledWork(pickled("work", work))
        self._sent = self._send_work()
        self._futures: dict[int, Any] = {}

    def __enter__(self) -> "DaskPool":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._client.status == "running":
            self._client.cancel([*self._futures.values(), self._sent], force=True)

    @property
    def limit(self) -> int:
        """Two items per thread of the workers connected now."""
        num_threads: int = sum(self._client.nthreads().values())
        return max(1, 2 * num_threads)

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Start an item as it is now."""
        message = pickled(f"item {index}", item)  # Dask would search an unpickled one for its keys and tasks
        self._start(index, message)
        return lambda: result_of(pickle.loads(self._reply(index, message)))

    def _start(self, index: int, message: bytes) -> None:
        self._futures[index] = self._client.submit(
            run_on_worker, self._sent, message, brushgs.__version__, pure=False
        )

    def _reply(self, index: int, message: bytes) -> bytes:
        from distributed import KilledWorker

        losses = 0
        while True:
            try:
                return self._wait(index)
            except KilledWorker as error:  # after the retries of Dask itself
                losses += error.allowed_failures + 1
            except CancelledError:  # lost with the last process that held the work
                losses += 1
                if self._sent.status != "finished":
                    self._sent = self._send_work()
            except Exception:
                check_versions(self._client)  # a worker may have connected later
                raise
            if losses >= MAX_ATTEMPTS:
                raise ChildProcessError(
                    f"parallel_map: item {index} was lost {losses} times together with its worker; "
                    "see the logs of the workers; if they ran out of memory, give them more"
                )
            self._start(index, message)

    def _wait(self, index: int) -> bytes:
        """The reply, however long it takes, as long as there are workers."""
        while True:
            try:
                reply: bytes = self._futures[index].result(timeout=CHECK_INTERVAL)
            except TimeoutError:
                wait_for_workers(self._client, self._waiting)
            else:
                del self._futures[index]
                return reply

    def _send_work(self) -> Any:
        """Send the work to all present workers; those that connect later get it from one of them."""
        while True:
            wait_for_workers(self._client, self._waiting)
            try:
                return self._client.scatter(self._work, broadcast=True, hash=False)
            except TimeoutError:  # the last one was lost in between: wait for another, up to the timeout
                continue


def run_on_worker(work: PickledWork, message: bytes, version: str) -> bytes:
    """Process an item on a worker, see `messages.run_item`, in one thread: Dask counts a task as one."""
    try:
        check_brushgs("worker", brushgs.__version__, version)  # it may have connected after the first check
    except ValueError as error:
        return reply_bytes(Failed(error, ""))
    with at_most(1):
        return run_item(work, message, records_warnings=False)
