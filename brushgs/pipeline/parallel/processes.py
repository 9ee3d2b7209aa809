"""Worker processes of this machine: one thread here for each process, and a stream between the two.

The standard library's `ProcessPoolExecutor` was tried and rejected: its processes share one pipe, and one
that is killed while it sends a frame leaves half a message there, for which the pool blocks forever (2 of 6
tries with results of 30 MB). With a socket per process only that socket ends, the item that was lost is
known, and the other processes continue.

joblib's loky was tried too: through its own queues it blocked forever in 2 of 10 tries (items of 0.2 MB,
results of 3 MB), and with all data in files, only indices in the queues, it survived 40 of 40. But then it
starts in 0.50 s instead of 0.06 s, kills every process when one dies, prints tracebacks of its workers in 11
of 20 Ctrl-C and "leaked semlock objects" on SIGTERM, and leaves the files behind on SIGKILL.
"""

import pickle
import signal
import sys
import tempfile
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import suppress
from types import TracebackType
from typing import Any

from brushgs.core.threads import num_threads_or_default
from brushgs.pipeline.parallel import wire
from brushgs.pipeline.parallel.messages import MAX_ATTEMPTS, Done, Failed, pickled, result_of
from brushgs.pipeline.parallel.streams import block_stops, start_worker
from brushgs.pipeline.parallel.worker import BOOT


class ProcessPool:
    """Up to `jobs` processes of this machine, each started when there is an item for it."""

    def __init__(self, work: Callable[[Any], object], jobs: int) -> None:
        self.limit = 2 * jobs
        self._work = pickled("work", work)
        self._num_threads = max(1, num_threads_or_default(None) // jobs)
        self._lock = threading.Lock()
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._is_closed = False
        self._threads = ThreadPoolExecutor(jobs, "brushgs-parallel", block_stops)
        # Killed processes cannot remove what they were writing: it lies where this one removes it.
        self._folder = tempfile.TemporaryDirectory(prefix="brushgs-")

    def __enter__(self) -> "ProcessPool":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._is_closed = True
            processes = list(self._all)  # a thread may still remove its own
        for process in processes:
            process.kill()
        self._threads.shutdown(wait=True, cancel_futures=True)
        for process in processes:
            process.stop()
        self._folder.cleanup()

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Start an item as it is now: the caller may change it afterwards."""
        future = self._threads.submit(self._run, index, pickled(f"item {index}", item))
        return lambda: result_of(future.result())

    def _run(self, index: int, message: bytes) -> Done | Failed:
        for _ in range(MAX_ATTEMPTS):
            process = self._take()
            try:
                reply = process.request(message)
            except (EOFError, OSError):
                ending = self._drop(process)
                continue
            self._idle.append(process)
            return pickle.loads(reply)  # type: ignore[no-any-return]
        raise ChildProcessError(
            f"parallel_map: item {index} killed its process {MAX_ATTEMPTS} times, the last one by {ending}; "
            "if it ran out of memory, use fewer jobs"
        )

    def _take(self) -> "_Process":
        """An idle process, or a new one."""
        with self._lock:
            if self._is_closed:
                raise CancelledError
            if self._idle:
                return self._idle.pop()
            process = _Process(self._num_threads, self._folder.name)
            self._all.add(process)
        process.send_work(self._work)
        return process

    def _drop(self, process: "_Process") -> str:
        with self._lock:
            self._all.discard(process)
        return process.stop()


class _Process:
    """One process, and this end of the stream to it."""

    def __init__(self, num_threads: int, folder: str) -> None:
        self._process, self._stream = start_worker(BOOT, [str(num_threads), folder, *sys.path])

    def send_work(self, work: bytes) -> None:
        """Send the pickled work, once."""
        with suppress(OSError):  # it has died already: the first request will raise
            wire.send(self._stream, work)

    def request(self, message: bytes) -> bytearray:
        """The reply to an item. Raises EOFError or OSError if the process dies before it is complete."""
        wire.send(self._stream, message)
        return wire.receive(self._stream)

    def kill(self) -> None:
        """Kill it without waiting; a thread that waits for its reply gets an EOFError."""
        self._process.kill()

    def stop(self) -> str:
        """Kill it, wait until it is gone, and return how it ended: "SIGKILL" or "exit code 1"."""
        self._stream.close()  # a living process exits on this
        self._process.kill()
        code = self._process.wait()
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
