"""Jobs run, each in a process of its own: what one does, or breaks, does not touch the others.

A process of `brushgs.painting.parallel` is killed when the work stops, which suits work whose results come
back as bytes. Jobs write files: they are asked to stop, as by SIGTERM, and take unfinished files away.
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from brushgs.cli.batch.jobs import Job, parser_of
from brushgs.cli.option_words import named_actions
from brushgs.errors import SceneError
from brushgs.options.sequence import SequenceConfig
from brushgs.threads import num_threads_or_default

SECONDS_TO_STOP = 20.0  # that a process has to take its unfinished files away
# The folder of a job is never searched for modules: a numpy.py in it would be run.
BOOT = (
    "import sys; n = int(sys.argv[1]); sys.path[:] = sys.argv[2:2 + n]; "
    "from brushgs.cli import main; sys.exit(main(sys.argv[2 + n:]))"
)


class Task(NamedTuple):
    """What is needed to run a job, here or on a worker of a cluster."""

    words: tuple[str, ...]
    folder: str


class Outcome(NamedTuple):
    """How a job ended.

    Attributes:
        seconds: of the process, start and all.
        error: one sentence; "" if there was none.
        report: that of the command, as it prints it with --json; empty if it has none.
    """

    seconds: float
    error: str
    report: dict[str, Any]


class Processes:
    """The processes that run at the moment, of all threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[str]] = set()
        self._is_stopped = False

    def run(self, task: Task) -> Outcome:
        """Run a task to its end.

        Raises:
            CancelledError: if all was stopped before.
        """
        start = time.perf_counter()
        with self._lock:
            if self._is_stopped:
                raise CancelledError
            try:
                process = _start(task)
            except OSError as error:
                return Outcome(0.0, f"{error.filename or task.folder}: {error.strerror}", {})
            self._running.add(process)
        try:
            out, err = process.communicate()
        finally:
            with self._lock:
                self._running.discard(process)
        seconds = time.perf_counter() - start
        return Outcome(seconds, _error_of(process.returncode, err), _report_of(out))

    def stop(self) -> None:
        """Stop all, and wait until they are gone."""
        with self._lock:
            self._is_stopped = True
            running = list(self._running)
        for process in running:
            process.terminate()
        for process in running:
            try:
                process.wait(SECONDS_TO_STOP)
            except subprocess.TimeoutExpired:
                process.kill()


def run_jobs(
    jobs: Sequence[Job], config: SequenceConfig, tell: Callable[[str], None]
) -> Generator[tuple[Job, Outcome], None, None]:
    """Run jobs, each as soon as there is room for it, and give each as it ends; on a cluster in order.

    Args:
        jobs: that were checked.
        config: how many run at a time, or on which cluster.
        tell: called with a sentence where a cluster has no workers.

    Raises:
        ConnectionError: if a cluster cannot be reached, or is lost.
        ValueError: see `parallel_map`.
    """
    for job in jobs:
        _make_folder(job)
    tasks = [_task_of(job, config) for job in jobs]
    if config.scheduler is not None:
        from brushgs.painting.parallel import parallel_map
        from brushgs.painting.parallel.connection import Waiting

        waiting = Waiting(config.workers_timeout, tell)
        outcomes = parallel_map(run_task, tasks, scheduler=config.scheduler, waiting=waiting)
        yield from zip(jobs, outcomes, strict=True)
        return
    processes = Processes()
    with ThreadPoolExecutor(config.jobs, "brushgs-batch") as threads:
        futures = {threads.submit(processes.run, task): job for job, task in zip(jobs, tasks, strict=True)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
            processes.stop()


def run_task(task: Task) -> Outcome:
    """Run one task, as a worker of a cluster does."""
    return Processes().run(task)


def _task_of(job: Job, config: SequenceConfig) -> Task:
    known, words = named_actions(parser_of(job.command)), [job.command, *job.words]
    if "json" in known:
        words.append("--json")
    shares = config.jobs > 1 or config.scheduler is not None  # Dask counts a task as one thread
    if shares and "threads" in known and not any(word.startswith("--threads=") for word in words):
        share = 1 if config.scheduler is not None else max(1, num_threads_or_default(None) // config.jobs)
        words.append(f"--threads={share}")
    return Task(tuple(words), str(job.folder.resolve()))


def _make_folder(job: Job) -> None:
    folder = job.path.parent
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SceneError(folder, f"cannot be made ({error.strerror}); choose another output") from None


def _start(task: Task) -> "subprocess.Popen[str]":
    path = [str(Path(entry or ".").absolute()) for entry in sys.path]
    return subprocess.Popen(
        [sys.executable, "-P", "-c", BOOT, str(len(path)), *path, *task.words],
        cwd=task.folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,  # Ctrl-C is heard here, which then stops them once
    )


def _error_of(code: int, err: str) -> str:
    """Why a process failed, in a sentence; "" if it did not."""
    if code == 0:
        return ""
    lines = [line for line in err.splitlines() if line.strip()]
    said = [line.removeprefix("brushgs: ") for line in lines if line.startswith("brushgs: ")]
    said = [line for line in said if not line.startswith("note: ")]
    if code < 0:
        return f"was killed by signal {-code}; if it ran out of memory, use fewer --jobs"
    return said[-1] if said else lines[-1] if lines else f"exit code {code}"


def _report_of(out: str) -> dict[str, Any]:
    with suppress(ValueError):
        report = json.loads(out)
        if isinstance(report, dict):
            return report
    return {}
