"""The report of a run: stages with counts and seconds, shown as a table, as JSON and as progress bars.

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

# Version of the JSON; increases when a key changes its name or meaning. Since 2 a stage has `skipped` in
# place of `left_out`, of which some lines are `details` now, and the counts of the stage "count" have
# `target` and `sampled` in place of `aim` and `looks`.
SCHEMA = 2

# The short table: label of a line, and its stage, the first of these that ran.
SHORT = {
    "scene": ("build", "load"),
    "first view": ("first view",),
    "view": ("camera", "path"),
    "strokes": ("cluster",),
    "brush": ("brushes", "stroke"),
    "refine": ("refine",),
    "measure": ("measure",),
    "file": ("write", "page", "quads"),  # last: dropped first, since stdout has it
}
MOST_LINES = 8  # of the short table, including those of skipped work and the total
# First words of skipped stages that flags, the look or the camera switch off: not worth a line.
EXPECTED = {"clean", "slabs", "prune", "cluster", "solid", "direction", "repaint", "broken", "key", "track"}
EXPECTED |= {"recolor", "project"}


@dataclass
class Stage:
    """One step of a run.

    Attributes:
        name: of the step, as the table shows it.
        seconds: wall-clock time spent on it.
        did: its result, in words.
        counts: numbers and names for machines, by name.
        skipped: work that this scene does not need, and why.
        details: how it was done; the table shows them only when verbose.
    """

    name: str
    seconds: float = 0.0
    did: str = ""
    counts: dict[str, Any] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    details: list[str] = field(default_factory=list)


class Stopwatch:
    """Adds up the seconds of the blocks that it times."""

    def __init__(self) -> None:
        """Start at zero."""
        self.seconds = 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        """Time a block."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds += time.perf_counter() - start


@dataclass
class Report:
    """All stages of a run, in order.

    Attributes:
        stages: see `Stage`.
        notes: warnings about files that could be used only in part, and notes given during the run.
        output: the written file, if any.
        shows_progress: whether bars are drawn on stderr while stages run.
        tells: whether urgent notes are printed on stderr during the run.
        verbose: whether the table shows all stages, with their details.
    """

    stages: list[Stage] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    output: str | None = None
    shows_progress: bool = False
    tells: bool = False
    verbose: bool = False
    _started: float = field(default_factory=time.perf_counter)
    _progress: "Progress | None" = None
    _bar: "TaskID | None" = None
    _unit: str = "frames"

    @contextmanager
    def stage(
        self,
        name: str,
        *,
        total: int | None = None,
        unit: str = "frames",
        earlier: Stopwatch | None = None,
        apart: Stopwatch | None = None,
    ) -> Iterator[Stage]:
        """Time a step, and show that it runs. The step fills in what it did.

        Args:
            name: of the step, as the table shows it.
            total: number of frames, if the step calls `advance` after each.
            unit: word for what is counted, if not frames.
            earlier: time already spent on this step while another one ran; counts here.
            apart: time spent on another step while this one runs; does not count here.
        """
        stage = Stage(name)
        self._unit = unit
        self.begin(name, total)
        start = time.perf_counter()
        try:
            yield stage
        finally:
            stage.seconds = time.perf_counter() - start
            stage.seconds += earlier.seconds if earlier else 0.0
            stage.seconds -= apart.seconds if apart else 0.0
            self._stop_bar()
        self.stages.append(stage)

    def expect(self, total: int, unit: str) -> None:
        """Set the number of units of the running step, if it is known only after the start."""
        self._unit = unit
        if self._progress is not None and self._bar is not None:
            self._progress.update(self._bar, total=total)

    def advance(self, note: str = "") -> None:
        """Count one more frame or unit of the running step; a note is added to the bar."""
        if self._progress is None or self._bar is None:
            return
        task = self._progress.tasks[-1]
        done, total = round(task.completed) + 1, round(task.total or 0)
        words = ", ".join(filter(None, [pace(done, total, task.elapsed or 0.0, self._unit), note]))
        self._progress.update(self._bar, completed=done, words=words)

    def tell(self, note: str) -> None:
        """Print a note during the run, such as a wait or a resumption."""
        self.notes.append(note)
        if self.tells:
            print(f"brushgs: note: {note}", file=sys.stderr, flush=True)  # rich prints it above its bars

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
        """The run as one JSON object; `counts` of a stage are flat."""
        value = {
            "schema": SCHEMA,
            "output": self.output,
            "seconds": round(self.seconds, 4),
            "peak_memory_bytes": peak_memory(),
            "notes": self.notes,
            "stages": [{**asdict(stage), "seconds": round(stage.seconds, 4)} for stage in self.stages],
        }
        return json.dumps(value, indent=2)

    def short_table(self) -> list[tuple[str, str]]:
        """At most `MOST_LINES` lines, (label, words).

        All stages if few ran, else those of `SHORT`; the longest stages if hardly any of these ran.
        """
        of_note = (stage for stage in self.stages if stage.name.split()[0] not in EXPECTED)
        skipped = "; ".join(why for stage in of_note for why in stage.skipped)
        ran, most = {stage.name: stage for stage in self.stages}, MOST_LINES - 1 - bool(skipped)
        found = [(word, [ran[name].did for name in names if name in ran]) for word, names in SHORT.items()]
        lines = [(word, did[0]) for word, did in found if did][:most]
        if len(self.stages) <= most or len(lines) < 3:
            longest = sorted(self.stages, key=lambda stage: stage.seconds)[-most:]
            lines = [(stage.name, stage.did) for stage in self.stages if stage in longest]
        memory = peak_memory()
        peak = f", peak memory {memory / 1e6:,.0f} MB" if memory else ""
        total = ("total", f"{self.seconds:.1f} seconds{peak}")
        return [*lines, *([("skipped", skipped)] if skipped else []), total]

    def print_table(self) -> None:
        """Print the short table on stderr, or, if verbose, draw that of all stages with their details."""
        if not self.verbose:
            lines = self.short_table()
            width = max(len(word) for word, _ in lines)
            print("\n".join(f"{word:{width}}  {did}" for word, did in lines), file=sys.stderr)
        else:
            self._print_all_stages()

    def _print_all_stages(self) -> None:
        from rich.box import SIMPLE_HEAD
        from rich.console import Console
        from rich.table import Table

        console = Console(stderr=True, highlight=False)
        if not console.is_terminal:
            console.width = 120
        columns = {
            "stage": [stage.name for stage in self.stages],
            "what it did": [stage.did for stage in self.stages],
            "seconds": [f"{stage.seconds:.3f}" for stage in self.stages],
            "skipped": ["\n".join(stage.skipped) for stage in self.stages],
            "details": ["\n".join(stage.details) for stage in self.stages],
        }
        shown = {name: cells for name, cells in columns.items() if any(cells) or name == "seconds"}
        table = Table(box=SIMPLE_HEAD, pad_edge=False)
        for name in shown:
            table.add_column(name, justify="right" if name == "seconds" else "left")
        for cells in zip(*shown.values(), strict=True):
            table.add_row(*cells)
        memory = peak_memory()
        peak = f"peak memory {memory / 1e6:,.0f} MB" if memory else ""
        table.add_section()
        total = {"stage": "total", "what it did": peak, "seconds": f"{self.seconds:.3f}"}
        table.add_row(*(total.get(name, "") for name in shown))
        console.print(table, markup=False)

    def begin(self, name: str, total: int | None) -> None:
        """Show that a step begins; `stage` calls it."""
        if not self.shows_progress:
            return
        if self._progress is None:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

            columns = TextColumn("{task.description:10}"), BarColumn(30), TimeElapsedColumn()
            words = TextColumn("{task.fields[words]}")
            self._progress = Progress(*columns, words, console=Console(stderr=True), transient=True)
            self._progress.start()
        self._bar = self._progress.add_task(name, total=total, words="")

    def _stop_bar(self) -> None:
        if self._progress is not None and self._bar is not None:
            self._progress.update(self._bar, total=1, completed=1)
        self._bar = None


def pace(done: int, total: int, seconds: float, unit: str = "frames") -> str:
    """Progress in words, such as "34/120 frames, 8.2 per second, 0:11 left"."""
    text = f"{done}/{total} {unit}"
    if not done or not seconds > 0:
        return text
    minutes, rest = divmod(round((total - done) * seconds / done), 60)
    hours, minutes = divmod(minutes, 60)
    left = f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
    return f"{text}, {done / seconds:.3g} per second, {left} left"


def peak_memory() -> int | None:
    """The most memory this process has held so far, in bytes; None where the system does not report it."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(peak if sys.platform == "darwin" else peak * 1024)
