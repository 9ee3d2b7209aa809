"""What a run did: stages with counts and seconds, told as a table, as JSON, and by progress bars.

rich is imported only when something is drawn.
"""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

SCHEMA = 1  # of the JSON; grows when a field changes its meaning


@dataclass
class Stage:
    """One step of a run.

    Attributes:
        name: what it is called in the table.
        seconds: wall-clock time; what a step adds here while it runs is added to it.
        did: what it did, in words.
        counts: numbers and names for machines, by name.
        skipped: what was not done because this scene does not need it, with the reason.
    """

    name: str
    seconds: float = 0.0
    did: str = ""
    counts: dict[str, Any] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)


@dataclass
class Report:
    """All stages of a run, in order.

    Attributes:
        stages: see `Stage`.
        notes: warnings about files that were usable after something was left out.
        output: the file that was written, if one was.
        shows_progress: whether bars are drawn on stderr while stages run.
        verbose: whether the table shows the details of stages.
    """

    stages: list[Stage] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    output: str | None = None
    shows_progress: bool = False
    verbose: bool = False
    _started: float = field(default_factory=time.perf_counter)
    _progress: "Progress | None" = None
    _bar: "TaskID | None" = None
    _counted: str = "frames"

    @contextmanager
    def stage(self, name: str, *, frames: int | None = None, of: str = "frames") -> Iterator[Stage]:
        """Time a step, and show that it runs. The step fills in what it did.

        Args:
            name: what it is called in the table.
            frames: how many frames it makes, if it is one that calls `advance` after each.
            of: what it makes in place of frames.
        """
        stage = Stage(name)
        self._counted = of
        self._start_bar(name, frames)
        start = time.perf_counter()
        try:
            yield stage
        finally:
            stage.seconds += time.perf_counter() - start
            self._stop_bar()
        self.stages.append(stage)

    def advance(self, note: str = "") -> None:
        """Show that one more frame, or what else the running step makes, is done; a note says how it goes."""
        if self._progress is None or self._bar is None:
            return
        task = self._progress.tasks[-1]
        done, total = round(task.completed) + 1, round(task.total or 0)
        told = ", ".join(filter(None, [pace(done, total, task.elapsed or 0.0, self._counted), note]))
        self._progress.update(self._bar, completed=done, told=told)

    @property
    def seconds(self) -> float:
        """Wall-clock time since the report was opened."""
        return time.perf_counter() - self._started

    def close(self) -> None:
        """Take the progress bars off the terminal."""
        if self._progress is not None:
            self._progress.stop()
            self._progress = None

    def as_json(self) -> str:
        """The run for machines: one JSON object; `counts` of a stage are flat, names never change meaning."""
        value = {
            "schema": SCHEMA,
            "output": self.output,
            "seconds": round(self.seconds, 4),
            "peak_memory_bytes": peak_memory(),
            "notes": self.notes,
            "stages": [{**asdict(stage), "seconds": round(stage.seconds, 4)} for stage in self.stages],
        }
        return json.dumps(value, indent=2)

    def print_table(self) -> None:
        """Draw the table on stderr."""
        from rich.box import SIMPLE_HEAD
        from rich.console import Console
        from rich.table import Table

        console = Console(stderr=True, highlight=False)
        if not console.is_terminal:
            console.width = 120
        table = Table(box=SIMPLE_HEAD, pad_edge=False)
        for name in ("stage", "what it did", "seconds", "left out, because not needed here"):
            table.add_column(name, justify="right" if name == "seconds" else "left")
        for stage in self.stages:
            table.add_row(stage.name, stage.did, f"{stage.seconds:.3f}", "\n".join(stage.skipped))
        memory = peak_memory()
        peak = f"peak memory {memory / 1e6:,.0f} MB" if memory else ""
        table.add_section()
        table.add_row("total", peak, f"{self.seconds:.3f}", "")
        console.print(table, markup=False)

    def _start_bar(self, name: str, frames: int | None) -> None:
        if not self.shows_progress:
            return
        if self._progress is None:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = TextColumn("{task.description:10}"), BarColumn(30), TimeElapsedColumn()
            told = TextColumn("{task.fields[told]}")
            self._progress = Progress(*columns, told, console=Console(stderr=True), transient=True)
            self._progress.start()
        self._bar = self._progress.add_task(name, total=frames, told="")

    def _stop_bar(self) -> None:
        if self._progress is not None and self._bar is not None:
            self._progress.update(self._bar, total=1, completed=1)
        self._bar = None


def pace(done: int, total: int, seconds: float, of: str = "frames") -> str:
    """Frames done, frames a second and time left, such as "34/120 frames, 8.2 a second, 0:11 left"."""
    text = f"{done}/{total} {of}"
    if not done or not seconds > 0:
        return text
    minutes, rest = divmod(round((total - done) * seconds / done), 60)
    hours, minutes = divmod(minutes, 60)
    left = f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
    return f"{text}, {done / seconds:.3g} a second, {left} left"


def peak_memory() -> int | None:
    """The most memory this process has held so far, in bytes; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)
