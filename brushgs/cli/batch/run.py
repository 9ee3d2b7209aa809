"""Jobs run in processes of their own, those of one scene in one, which makes what they have in common once.

One that ends its process does not touch the others: these go on in another. A process of
`brushgs.pipeline.parallel` is killed when the work stops, which suits work whose results come back as bytes.
Jobs write files: they are asked to stop, as by SIGTERM, and take unfinished files away.
"""

import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryFile
from typing import IO, Any, NamedTuple

from brushgs.cli.batch.jobs import Job, parser_of
from brushgs.cli.option_words import named_actions
from brushgs.core.threads import num_threads_or_default
from brushgs.errors import SceneError
from brushgs.options.sequence import SequenceConfig

SECONDS_TO_STOP = 20.0  # that a process has to take its unfinished files away
# The folder of a job is never searched for modules: a numpy.py in it would be run.
BOOT = (
    "import sys; n = int(sys.argv[1]); sys.path[:] = sys.argv[2:2 + n]; "
    "from brushgs.cli.batch.worker import main; main()"
)


class Task(NamedTuple):
    """What is needed to run a job, here or on a worker of a cluster."""

    words: tuple[str, ...]
    folder: str


class Outcome(NamedTuple):
    """How a job ended.

    Attributes:
        seconds: that it took.
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

    def run(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """Run tasks one after another, and give each as it ends.

        Raises:
            CancelledError: if all was stopped before.
        """
        left = list(tasks)
        while left:
            for outcome in self._in_one_process(left):
                left.pop(0)
                yield outcome

    def _in_one_process(self, tasks: Sequence[Task]) -> Iterator[Outcome]:
        """As many as one process runs, at least one."""
        start, num_done = time.perf_counter(), 0
        with TemporaryFile("w+", errors="replace") as said:
            with self._lock:
                if self._is_stopped:
                    raise CancelledError
                try:
                    process = _start(tasks, said)
                except OSError as error:
                    yield Outcome(0.0, f"{error.filename or tasks[0].folder}: {error.strerror}", {})
                    return
                self._running.add(process)
            assert process.stdout is not None, "it is a pipe"
            try:
                for line in process.stdout:
                    seconds, code, out, err = json.loads(line)
                    num_done += 1
                    yield Outcome(seconds, _error_of(code, err), _report_of(out))
                code = process.wait()
            finally:
                process.stdout.close()
                with self._lock:
                    self._running.discard(process)
            if num_done < len(tasks):  # one has ended it
                said.seek(0)
                why = _error_of(code, said.read()) or "its process has ended before it was done"
                yield Outcome(time.perf_counter() - start, why, {})

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
        from brushgs.pipeline.parallel import parallel_map
        from brushgs.pipeline.parallel.connection import Waiting

        waiting = Waiting(config.workers_timeout, tell)
        outcomes = parallel_map(run_task, tasks, scheduler=config.scheduler, waiting=waiting)
        yield from zip(jobs, outcomes, strict=True)
        return
    processes, ended = Processes(), SimpleQueue[tuple[Job, Outcome] | BaseException]()

    def run(group: Sequence[tuple[Job, Task]]) -> None:
        try:
            for (job, _), outcome in zip(group, processes.run([task for _, task in group]), strict=True):
                ended.put((job, outcome))
        except CancelledError:
            return
        except BaseException as error:
            ended.put(error)

    with ThreadPoolExecutor(config.jobs, "brushgs-batch") as threads:
        try:
            for group in _groups(list(zip(jobs, tasks, strict=True)), config.jobs):
                threads.submit(run, group)
            for _ in jobs:
                found = ended.get()
                if isinstance(found, BaseException):
                    raise found
                yield found
        finally:
            threads.shutdown(wait=False, cancel_futures=True)
            processes.stop()


def _groups(pairs: Sequence[tuple[Job, Task]], num_processes: int) -> list[Sequence[tuple[Job, Task]]]:
    """Jobs of the same scene together, in order; in parts where there are more processes than scenes."""
    of_scene: dict[tuple[str, ...], list[tuple[Job, Task]]] = {}
    for job, task in pairs:
        args = parser_of(job.command).parse_args(list(job.words))
        scenes = getattr(args, "scene", None) or [job.number]  # a job without a scene is alone
        name = tuple(map(str, scenes if isinstance(scenes, list) else [scenes]))
        of_scene.setdefault(name, []).append((job, task))
    num_parts = max(1, num_processes // max(len(of_scene), 1))
    found = (group[part::num_parts] for group in of_scene.values() for part in range(num_parts))
    return [group for group in found if group]


def run_task(task: Task) -> Outcome:
    """Run one task, as a worker of a cluster does."""
    return next(iter(Processes().run([task])))


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


def _start(tasks: Sequence[Task], said: IO[str]) -> "subprocess.Popen[str]":
    path = [str(Path(entry or ".").absolute()) for entry in sys.path]
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", BOOT, str(len(path)), *path],
        cwd=tasks[0].folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=said,
        text=True,
        errors="replace",
        start_new_session=True,  # Ctrl-C is heard here, which then stops them once
    )
    assert process.stdin is not None, "it is a pipe"
    with process.stdin, suppress(BrokenPipeError):
        process.stdin.write(json.dumps(tasks))
    return process


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
