"""Worker threads that do one task at a time, and stop abandoned ones.

Threads, not processes: the core releases the GIL, and strokes need not be sent. Abandoned work stops at the
next stage or frame.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from brushgs.pipeline.report import Report


class AbandonedError(Exception):
    """The result of this work is no longer needed."""


class Task:
    """A task that waits, runs or is done."""

    def __init__(self, run: "Callable[[Task], None]") -> None:
        self.run = run
        self._is_abandoned = threading.Event()

    def abandon(self) -> None:
        """Mark the task as no longer needed."""
        self._is_abandoned.set()

    @property
    def is_abandoned(self) -> bool:
        """Whether the task is no longer needed."""
        return self._is_abandoned.is_set()

    def check(self) -> None:
        """Raise AbandonedError if the task is no longer needed."""
        if self.is_abandoned:
            raise AbandonedError


class Lane:
    """A thread that runs one task after the other.

    Args:
        name: of the thread.
        latest_wins: whether a new task replaces waiting and running ones.
    """

    def __init__(self, name: str, *, latest_wins: bool = False) -> None:
        self._latest_wins = latest_wins
        self._changed = threading.Condition()
        self._waiting: deque[Task] = deque()
        self._running: Task | None = None
        self._is_closed = False
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    def submit(self, run: Callable[[Task], None]) -> Task:
        """Run a function in the lane's thread; it may raise only AbandonedError."""
        task = Task(run)
        with self._changed:
            if self._is_closed:
                task.abandon()
                return task
            if self._latest_wins:
                self._abandon_all()
            self._waiting.append(task)
            self._changed.notify_all()
        return task

    def wait(self, task: Task | None = None, seconds: float | None = None) -> bool:
        """Wait until nothing is left to do; returns False if that takes longer than `seconds`.

        Args:
            task: waiting task of another lane: AbandonedError is raised soon after it is abandoned.
            seconds: None for any time.
        """
        with self._changed:
            if task is None:
                return self._changed.wait_for(self._is_idle, seconds)
            while not self._changed.wait_for(self._is_idle, 0.1):
                task.check()
            return True

    def close(self, seconds: float) -> bool:
        """Abandon all tasks, and wait for the one that runs; returns False if that takes longer."""
        with self._changed:
            self._is_closed = True
            self._abandon_all()
            self._changed.notify_all()
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _is_idle(self) -> bool:
        return self._running is None and not self._waiting

    def _abandon_all(self) -> None:
        for task in self._waiting:
            task.abandon()
        self._waiting.clear()
        if self._running is not None:
            self._running.abandon()

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._is_closed)
                if self._is_closed:
                    return
                task = self._running = self._waiting.popleft()
            try:
                task.check()
                task.run(task)
            except AbandonedError:
                pass
            finally:
                with self._changed:
                    self._running = None
                    self._changed.notify_all()


@dataclass(frozen=True)
class Progress:
    """Progress of a task.

    Attributes:
        stage: of the report.
        done: frames that are made.
        total: frames to make; None for a stage without.
    """

    stage: str
    done: int = 0
    total: int | None = None


@dataclass
class WatchedReport(Report):
    """A report that tells each stage and frame when it begins.

    Attributes:
        watch: called with the progress; may raise to stop the work.
    """

    watch: Callable[[Progress], None] = field(default=lambda progress: None, kw_only=True)
    _seen: Progress = field(default=Progress(""), kw_only=True)

    def begin(self, name: str, total: int | None) -> None:
        """See `Report.begin`."""
        self._tell(Progress(name, 0, total))
        super().begin(name, total)

    def advance(self, note: str = "") -> None:
        """See `Report.advance`."""
        super().advance(note)
        self._tell(Progress(self._seen.stage, self._seen.done + 1, self._seen.total))

    def _tell(self, progress: Progress) -> None:
        self._seen = progress
        self.watch(progress)
