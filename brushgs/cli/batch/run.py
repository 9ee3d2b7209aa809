"""Jobs run in processes of their own, those of one scene in one, which makes what they have in common once.

One that ends its process does not touch the others: these go on in another. Jobs write files, so they are
asked to stop, and take unfinished files away.
"""

import io
import json
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Future, as_completed
from contextlib import chdir, redirect_stderr, redirect_stdout, suppress
from typing import Any, NamedTuple

from brushgs.cli.batch.jobs import Job, parser_of
from brushgs.cli.option_words import named_actions
from brushgs.core.messages import Done, Failed, result_of
from brushgs.core.processes import KilledError, ProcessPool, Ways
from brushgs.core.threads import num_threads_or_default
from brushgs.formats.files import noting_written
from brushgs.options.sequence import SequenceConfig
from brushgs.pipeline.runner import Memory, holding

SECONDS_TO_STOP = 20.0  # that a process has to take its unfinished files away


class Task(NamedTuple):
    """What is needed to run a job, here or on a worker of a cluster.

    Attributes:
        words: the command.
        folder: where it runs.
        is_followed: whether the process runs another one of the same scene next.
    """

    words: tuple[str, ...]
    folder: str
    is_followed: bool = False


class Outcome(NamedTuple):
    """How a job ended.

    Attributes:
        seconds: that it took.
        error: one sentence; "" if there was none.
        report: that of the command, as it prints it with --json; empty if it has none.
        written: the files that it wrote, and has not removed since.
    """

    seconds: float
    error: str
    report: dict[str, Any]
    written: tuple[str, ...] = ()


class TaskRunner:
    """Runs tasks one after another, and keeps what those of one scene have in common."""

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
    """Run jobs, each as soon as there is room for it, and give each as it ends; on a cluster in order.

    Args:
        jobs: that were checked.
        config: how many run at a time, or on which cluster.
        tell: called with a sentence where a cluster has no workers.

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
    """Run one task, as a worker of a cluster does: in a process of its own, which may end."""
    with _pool(1) as pool:
        return _outcome(pool.start([(0, task)])[0].result)


def _pool(jobs: int) -> ProcessPool:
    return ProcessPool(TaskRunner(), jobs, Ways(1, SECONDS_TO_STOP, output="kept"))


def _outcome(reply: Callable[[], Done | Failed]) -> Outcome:
    """The outcome of a task, also where it has ended its process, or this could not be started."""
    try:
        outcome: Outcome = result_of(reply())  # type: ignore[assignment]
    except KilledError as error:
        why = _error_of(error.code, error.said) or "its process has ended before it was done"
        return Outcome(error.seconds, why, {})
    except OSError as error:
        return Outcome(0.0, f"{error.filename}: {error.strerror}" if error.filename else str(error), {})
    return outcome


def _groups(jobs: Sequence[Job], num_processes: int) -> list[Sequence[Job]]:
    """Jobs of the same scene together, in order; in parts where there are more processes than scenes."""
    of_scene: dict[tuple[str, ...], list[Job]] = {}
    for job in jobs:
        args = parser_of(job.command).parse_args(list(job.words))
        scenes = getattr(args, "scene", None) or [job.number]  # a job without a scene is alone
        name = tuple(map(str, scenes if isinstance(scenes, list) else [scenes]))
        of_scene.setdefault(name, []).append(job)
    num_parts = max(1, num_processes // max(len(of_scene), 1))
    found = (group[part::num_parts] for group in of_scene.values() for part in range(num_parts))
    return [group for group in found if group]


def _task_of(job: Job, config: SequenceConfig, *, is_followed: bool = False) -> Task:
    known, words = named_actions(parser_of(job.command)), [job.command, *job.words]
    if "json" in known:
        words.append("--json")
    shares = config.jobs > 1 or config.scheduler is not None  # Dask counts a task as one thread
    if shares and "threads" in known and not any(word.startswith("--threads=") for word in words):
        share = 1 if config.scheduler is not None else max(1, num_threads_or_default(None) // config.jobs)
        words.append(f"--threads={share}")
    return Task(tuple(words), str(job.folder.resolve()), is_followed)


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
