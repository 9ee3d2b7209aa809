"""Items worked on in processes of this machine: a thread here for each process there, a socket between them.

Not `concurrent.futures.ProcessPoolExecutor`, because its processes share one pipe and its lock: one that is
killed while it sends a frame leaves half a message there, and the pool waits for the rest for ever (2 of 6
tries with results of 30 MB). Nor could it say which item a dead process was at. Here every process has a
socket of its own, whose end tells that it died, and the other processes go on.
"""

import pickle
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import suppress
from types import TracebackType
from typing import Any

from brushgs.painting.parallel import wire
from brushgs.painting.parallel.messages import TRIES, Done, Failed, pickled, result_of
from brushgs.painting.parallel.worker import BOOT
from brushgs.threads import num_threads_or_default


class Processes:
    """A place for work on this machine: up to `jobs` processes, started when there is an item for them."""

    def __init__(self, work: Callable[[Any], object], jobs: int) -> None:
        self.limit = 2 * jobs
        self._work = pickled("work", work)
        self._num_threads = max(1, num_threads_or_default(None) // jobs)
        self._lock = threading.Lock()
        self._all: set[_Process] = set()
        self._idle: list[_Process] = []
        self._is_over = False
        # Ctrl-C goes to every process of a terminal. Blocked in the threads here it is blocked in what they
        # start, from the first instruction on; this process alone hears it, in its main thread.
        self._threads = ThreadPoolExecutor(
            jobs, "brushgs-spread", signal.pthread_sigmask, (signal.SIG_BLOCK, {signal.SIGINT})
        )

    def __enter__(self) -> "Processes":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._is_over = True
            for process in self._all:
                process.kill()
        self._threads.shutdown(wait=True, cancel_futures=True)
        for process in self._all:
            process.end()

    def submit(self, index: int, item: object) -> Callable[[], Any]:
        """Begin with an item, as it is now: what the caller does to it later does not matter."""
        future = self._threads.submit(self._do, index, pickled(f"item {index}", item))
        return lambda: result_of(future.result())

    def _do(self, index: int, message: bytes) -> Done | Failed:
        for _ in range(TRIES):
            process = self._take()
            try:
                answer = process.ask(message)
            except (EOFError, OSError):
                ending = self._drop(process)
                continue
            self._idle.append(process)
            return pickle.loads(answer)  # type: ignore[no-any-return]
        raise ChildProcessError(
            f"spread: item {index} ended its process {TRIES} times, at last by {ending}; "
            "if memory ran out, fewer jobs need less of it"
        )

    def _take(self) -> "_Process":
        """A process without work, or a new one."""
        with self._lock:
            if self._is_over:
                raise CancelledError
            if self._idle:
                return self._idle.pop()
            process = _Process(self._num_threads)
            self._all.add(process)
        process.learn(self._work)
        return process

    def _drop(self, process: "_Process") -> str:
        with self._lock:
            self._all.discard(process)
        return process.end()


class _Process:
    """One process and this end of the socket to it."""

    def __init__(self, num_threads: int) -> None:
        ours, theirs = socket.socketpair()
        with theirs:
            words = [str(theirs.fileno()), str(num_threads), *sys.path]
            try:
                self._process = subprocess.Popen(
                    [sys.executable, "-c", BOOT, *words], stdin=subprocess.DEVNULL, pass_fds=[theirs.fileno()]
                )
            except BaseException:  # no memory for one more
                ours.close()
                raise
        self._stream = ours

    def learn(self, work: bytes) -> None:
        """Hand over the work."""
        with suppress(OSError):  # it died at once, as the first item will find out
            wire.send(self._stream, work)

    def ask(self, message: bytes) -> bytearray:
        """The answer to an item. Raises EOFError or OSError if the process dies before it is complete."""
        wire.send(self._stream, message)
        return wire.receive(self._stream)

    def kill(self) -> None:
        """End it without a word; who waits for its answer learns so."""
        self._process.kill()

    def end(self) -> str:
        """Have it gone for good, and say how it ended."""
        self._stream.close()  # if it lives, this is what it ends by
        self._process.kill()
        code = self._process.wait()
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"
