"""Results of a batch: a table for people, JSON for machines."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Literal

from brushgs.cli.batch.jobs import Job
from brushgs.cli.batch.run import Outcome
from brushgs.pipeline.report import Report

SCHEMA = 1  # of the JSON

State = Literal["done", "failed", "skipped"]


@dataclass(frozen=True)
class Line:
    """Result of one job.

    Attributes:
        number: of the job, from 1.
        command: name of the command.
        output: output path.
        state: "skipped" if it was finished earlier.
        seconds: run time; 0 if it did not run.
        peak_memory_bytes: as reported, of its process including earlier jobs; None if not reported.
        error: one sentence, or "".
        notes: of the command.
    """

    number: int
    command: str
    output: str
    state: State
    seconds: float = 0.0
    peak_memory_bytes: int | None = None
    error: str = ""
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, job: Job, outcome: Outcome | None) -> "Line":
        """The line of a job; `outcome` None means skipped."""
        if outcome is None:
            return cls(job.number, job.command, str(job.path), "skipped")
        return cls(
            job.number,
            job.command,
            str(job.path),
            "failed" if outcome.error else "done",
            round(outcome.seconds, 3),
            outcome.report.get("peak_memory_bytes"),
            outcome.error,
            tuple(map(str, outcome.report.get("notes", ()))),
        )


@dataclass
class BatchReport(Report):
    """The report of a batch: one line per finished job, in the order of the file."""

    lines: list[Line] = field(default_factory=list)

    def count(self, state: State) -> int:
        """Number of jobs in a state."""
        return sum(line.state == state for line in self.lines)

    def add(self, line: Line) -> None:
        """Add the result of a job, and show it."""
        self.lines.append(line)
        self.lines.sort(key=lambda line: line.number)
        self.advance(f"{self.count('failed')} failed" if self.count("failed") else "")
        if line.error:
            self.tell(f"job {line.number} failed: {line.error}")

    def as_json(self) -> str:
        """The batch for machines: one JSON object."""
        states: Sequence[State] = ("done", "failed", "skipped")
        counts: dict[str, int] = {state: self.count(state) for state in states}
        value = {
            "schema": SCHEMA,
            "seconds": round(self.seconds, 3),
            **counts,
            "notes": self.notes,
            "jobs": [asdict(line) for line in self.lines],
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
        for name in ("job", "seconds"):
            table.add_column(name, justify="right")
        for name in ("state", "command", "output"):
            table.add_column(name, overflow="fold")
        for line in self.lines:
            shown = f"{line.output}\n{line.error}" if line.error else line.output
            table.add_row(str(line.number), f"{line.seconds:.1f}", line.state, line.command, shown)
        table.add_section()
        counts = f"{self.count('done')} done, {self.count('failed')} failed, {self.count('skipped')} skipped"
        table.add_row("all", f"{self.seconds:.1f}", "", "", counts)
        console.print(table, markup=False)
