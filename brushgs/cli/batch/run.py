"""Run jobs in child processes; jobs of one scene share a process, which keeps common results.

If a job kills its process, the remaining jobs continue in a new one. Jobs write files, so they are asked to
stop and then remove unfinished files.
"""

import io
import json
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, as_completed
from contextlib import chdir, redirect_stderr, redirect_stdout, suppress
from typing import Any, NamedTuple

from brushgs.cli.batch.jobs import Job
from brushgs.cli.option_words import named_actions
from brushgs.cli.parser import command_parser
from brushgs.core.messages import Done, Failed, result_of
from brushgs.core.processes import KilledError, ProcessPool, Ways
from brushgs.core.threads import num_threads_or_default
from brushgs.formats.files import noting_written
from brushgs.options.sequence import SequenceConfig
from brushgs.pipeline.runner import Memory, holding

SECONDS_TO_STOP = 20.0  # for a process to remove its unfinished files


class Task(NamedTuple):
    """A job as sent to a local process or a cluster worker.

    Attributes:
        words: the command line.
        folder: working folder.
        is_followed: whether the process runs another job of the same scene next.
    """

    words: tuple[str, ...]
    folder: str
    is_followed: bool = False


class Outcome(NamedTuple):
    """Result of a task.

    Attributes:
        seconds: run time.
        error: one sentence, or "".
        report: the command's report, as printed with --json; empty if there is none.
        written: files that it wrote and did not remove.
    """

    seconds: float
    error: str
    report: dict[str, Any]
    written: tuple[str, ...] = ()


class TaskRunner:
    """Runs tasks one after another and keeps results that tasks of one scene share."""

    def __init__(self) -> None:
        """Nothing is kept yet."""
        self._memory: Memory | None = None

    def __call__(self, task: Task) -> Outcome:
        """Run one."""
        from brushgs.cli import main

        if task.is_followed and self._memory is None:
            self._memory = Memory()
        start, out, err = time.perf_counter(), io.StringIO(), io.StringIO()
        with (
            chdir(task.folder),
            noting_written() as written,
            holding(self._memory),
            redirect_stdout(out),
            redirect_stderr(err),
        ):
            try:
                code: Any = main(task.words)
            except SystemExit as end:  # of the parser
                code = end.code
        if not task.is_followed:
            self._memory = None
        files = tuple(str(path) for path in sorted(written) if path.exists())
        error = _error_of(int(code or 0), err.getvalue())
        return Outcome(time.perf_counter() - start, error, _report_of(out.getvalue()), files)


def run_jobs(
    jobs: Sequence[Job], config: SequenceConfig, tell: Callable[[str], None]
) -> Generator[tuple[Job, Outcome], None, None]:
    """Run jobs in parallel, and yield each result as its job ends; on a cluster in order.

    Args:
        jobs: checked jobs.
        config: number of parallel jobs, or the cluster.
        tell: called with a sentence while a cluster has no workers.

    Raises:
        ConnectionError: if a cluster cannot be reached, or is lost.
        ValueError: see `parallel_map`.
    """
    if config.scheduler is not None:
        from brushgs.pipeline.parallel import parallel_map
        from brushgs.pipeline.parallel.connection import Waiting

        waiting = Waiting(config.workers_timeout, tell)
        tasks = [_task_of(job, config) for job in jobs]
        outcomes = parallel_map(run_task, tasks, scheduler=config.scheduler, waiting=waiting)
        yield from zip(jobs, outcomes, strict=True)
        return
    with _pool(config.jobs) as pool:
        job_of: dict[Future[Done | Failed], Job] = {}
        for group in _groups(jobs, config.jobs):
            tasks = [_task_of(job, config, is_followed=job is not group[-1]) for job in group]
            job_of.update(zip(pool.start(list(enumerate(tasks))), group, strict=True))
        for future in as_completed(job_of):
            yield job_of[future], _outcome(future.result)


def run_task(task: Task) -> Outcome:
    """Run one task on a cluster worker, in its own process, which may crash."""
    with _pool(1) as pool:
        return _outcome(pool.start([(0, task)])[0].result)


def _pool(jobs: int) -> ProcessPool:
    return ProcessPool(TaskRunner(), jobs, Ways(1, SECONDS_TO_STOP, output="kept"))


def _outcome(reply: Callable[[], Done | Failed]) -> Outcome:
    """The outcome of a task, also if its process crashed or could not be started."""
    try:
        outcome: Outcome = result_of(reply())  # type: ignore[assignment]
    except KilledError as error:
        why = _error_of(error.code, error.said) or "its process has ended before it was done"
        return Outcome(error.seconds, why, {})
    except OSError as error:
        return Outcome(0.0, f"{error.filename}: {error.strerror}" if error.filename else str(error), {})
    return outcome


def _groups(jobs: Sequence[Job], num_processes: int) -> list[Sequence[Job]]:
    """Group jobs by scene, in order; groups are split if there are more processes than scenes."""
    of_scene: dict[tuple[str, ...], list[Job]] = {}
    for job in jobs:
        args = command_parser(job.command).parse_args(list(job.words))
        scenes = getattr(args, "scene", None) or [job.number]  # a job without a scene forms its own group
        name = tuple(map(str, scenes if isinstance(scenes, list) else [scenes]))
        of_scene.setdefault(name, []).append(job)
    num_parts = max(1, num_processes // max(len(of_scene), 1))
    found = (group[part::num_parts] for group in of_scene.values() for part in range(num_parts))
    return [group for group in found if group]


def _task_of(job: Job, config: SequenceConfig, *, is_followed: bool = False) -> Task:
    known, words = named_actions(command_parser(job.command)), [job.command, *job.words]
    if "json" in known:
        words.append("--json")
    shares = config.jobs > 1 or config.scheduler is not None  # Dask counts a task as one thread
    if shares and "threads" in known and not any(word.startswith("--threads=") for word in words):
        share = 1 if config.scheduler is not None else max(1, num_threads_or_default(None) // config.jobs)
        words.append(f"--threads={share}")
    return Task(tuple(words), str(job.folder.resolve()), is_followed)


def _error_of(code: int, err: str) -> str:
    """Why a process failed, as a sentence; "" if it did not."""
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
