"""Worker processes of this machine: one thread here for each process, and a stream between the two.

Used for frames, jobs of a batch, and files read by libraries that may crash on them.

The standard library's `ProcessPoolExecutor` was tried and rejected: its processes share one pipe, and one
that is killed while it sends a frame leaves half a message there, for which the pool blocks forever (2 of 6
tries with results of 30 MB). With a socket per process only that socket ends, the item that was lost is
known, and the other processes continue.

joblib's loky was tried too: through its own queues it blocked forever in 2 of 10 tries (items of 0.2 MB,
results of 3 MB), and with all data in files, only indices in the queues, it survived 40 of 40. But then it
starts in 0.50 s instead of 0.06 s, kills every process when one dies, prints tracebacks of its workers in 11
of 20 Ctrl-C and "leaked semlock objects" on SIGTERM, and leaves the files behind on SIGKILL.
"""

import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from types import TracebackType
from typing import Any, Literal, NamedTuple

from brushgs.core.messages import MAX_ATTEMPTS, Done, Failed, opened, pickled, result_of
from brushgs.core.streams import block_stops, receive, send, start_worker
from brushgs.core.threads import num_threads_or_default
from brushgs.core.worker import BOOT


class KilledError(ChildProcessError):
    """An item has killed its process too often.

    Attributes:
        code: exit code of the process; negative for a signal.
        said: its output, if kept.
        seconds: run time.
    """

    def __init__(self, sentence: str, code: int, said: str, seconds: float) -> None:
        super().__init__(sentence)
        self.code, self.said, self.seconds = code, said, seconds


class Ways(NamedTuple):
    """Options for starting and ending processes.

    Attributes:
        attempts: processes that one item may kill before it is an error.
        seconds_to_stop: time for running work to clean up at the end, after a request like SIGTERM; 0 kills
            it.
        environment: variables that replace those of this process.
        output: treatment of printed output.
        errors: for untrusted processes (which read hostile files): the only error classes, beside builtin
            ones, that replies may hold; None trusts replies.
    """

    attempts: int = MAX_ATTEMPTS
    seconds_to_stop: float = 0.0
    environment: Mapping[str, str] | None = None
    output: Literal["shown", "kept", "dropped"] = "shown"
    errors: tuple[type[Exception], ...] | None = None


class ProcessPool:
    """Up to `jobs` processes of this machine, each started on demand."""

    def __init__(self, work: Callable[[Any], object], jobs: int, ways: Ways | None = None) -> None:
        self.limit = 2 * jobs
        self._work, self._ways = pickled("work", work), ways or Ways()
        self._num_threads = max(1, num_threads_or_default(None) // jobs)
        self._lock = threading.Lock()
        self._all: set[_Process] = set()
        self._is_closed = False
        self._of_thread = threading.local()
        self._threads = ThreadPoolExecutor(jobs, "brushgs-processes", block_stops)

    def __enter__(self) -> "ProcessPool":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._lock:
            self._is_closed = True
            processes = list(self._all)  # threads may still remove theirs
        for process in processes:
            process.end()
        until = time.monotonic() + self._ways.seconds_to_stop
        for process in processes:
            process.kill_at(until)
        self._threads.shutdown(wait=True, cancel_futures=True)
        for process in processes:
            process.stop()

    def submit(self, index: int, item: object) -> Callable[..., Any]:
        """Start an item; it is pickled at once, so the caller may change it afterwards.

        The returned function waits for the result and returns it, or raises TimeoutError after `timeout`
        seconds, if given.
        """
        (future,) = self.start([(index, item)])
        return lambda timeout=None: result_of(future.result(timeout))

    def start(self, items: Sequence[tuple[int, object]]) -> "list[Future[Done | Failed]]":
        """Start items one after another in one process, so that they can share kept results.

        If an item kills the process, the next runs in a new one.
        """
        row = [(index, pickled(f"item {index}", item), Future[Done | Failed]()) for index, item in items]
        self._threads.submit(self._run_row, row)
        return [future for _, _, future in row]

    def _run_row(self, row: "Sequence[tuple[int, bytes, Future[Done | Failed]]]") -> None:
        for index, message, future in row:
            try:
                future.set_result(self._run(index, message))
            except BaseException as error:
                future.set_exception(error)

    def _run(self, index: int, message: bytes) -> Done | Failed:
        start = time.monotonic()
        for _ in range(self._ways.attempts):
            process = self._own_process()
            try:
                return opened(process.request(message), self._ways.errors)
            except (EOFError, OSError):
                with self._lock:
                    self._all.discard(process)
                code, said = process.stop()
        ending = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        sentence = f"item {index} killed its process {self._ways.attempts} times, the last one by {ending}"
        sentence = f"parallel_map: {sentence}; if it ran out of memory, use fewer jobs"
        raise KilledError(sentence, code, said, time.monotonic() - start)

    def _own_process(self) -> "_Process":
        """The process of this thread, or a new one."""
        with self._lock:
            if self._is_closed:
                raise CancelledError
            process: _Process | None = getattr(self._of_thread, "process", None)
            if process in self._all:
                assert process is not None
                return process
            process = self._of_thread.process = _Process(self._num_threads, self._ways)
            self._all.add(process)
        process.send_work(self._work)
        return process


class _Process:
    """One process, with this end of its stream and its temporary folder."""

    def __init__(self, num_threads: int, ways: Ways) -> None:
        self._is_asked = ways.seconds_to_stop > 0
        path = [str(Path(entry).absolute()) for entry in sys.path]  # the process may change its folder
        with ExitStack() as stack:
            # A killed process cannot remove its temporary files: keep them in a folder that this process
            # removes.
            folder = stack.enter_context(TemporaryDirectory(prefix="brushgs-", ignore_cleanup_errors=True))
            self._said = stack.enter_context(TemporaryFile()) if ways.output == "kept" else None
            shown = subprocess.DEVNULL if ways.output == "dropped" else self._said
            words = [str(num_threads), folder, str(self._is_asked), *path]
            self._process, self._stream = start_worker(BOOT, words, ways.environment, shown, self._is_asked)
            self._left = stack.pop_all()

    def send_work(self, work: bytes) -> None:
        """Send the pickled work, once."""
        with suppress(OSError):  # already dead: the first request will raise
            send(self._stream, work)

    def request(self, message: bytes) -> bytearray:
        """The reply to an item. Raises EOFError or OSError if the process dies before it is complete."""
        send(self._stream, message)
        return receive(self._stream)

    def end(self) -> None:
        """Ask it to stop, or kill it, without waiting; threads waiting for a reply get an EOFError."""
        if not self._is_asked:
            self._process.kill()
        with suppress(OSError):
            self._stream.shutdown(socket.SHUT_WR)

    def kill_at(self, until: float) -> None:
        """Wait until it has ended, and kill it after `until`."""
        try:
            self._process.wait(max(until - time.monotonic(), 0))
        except subprocess.TimeoutExpired:
            self._process.kill()

    def stop(self) -> tuple[int, str]:
        """Kill it, wait, and return its exit code and its output, if kept."""
        self._stream.close()  # a living process exits on this
        self._process.kill()
        code = self._process.wait()
        with self._left:
            if self._said is None:
                return code, ""
            self._said.seek(0)
            return code, self._said.read().decode(errors="replace")
