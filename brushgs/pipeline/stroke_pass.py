"""Passes on strokes, which keep all or most strokes; some are for parts of a scene."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from brushgs.pipeline.report import Report, Stage, Stopwatch
from brushgs.pipeline.runner import KEPT, Memory, NoMemory
from brushgs.values.arrays import Rows
from brushgs.values.gaussians import Gaussians

ALREADY_STROKES = "they are strokes already"


@dataclass(eq=False)
class StrokePass:
    """A pass that changes strokes.

    Attributes:
        name: of its stage.
        what: its effect, in words.
        run: from strokes to strokes.
        skip: why it does not run, in words; None if it runs.
        counts: for its stage.
        inputs: what `run` depends on besides the strokes.
        memory: of results.
        labels: of the parts of a scene that it is limited to, 0 for no part; None for all.
        watch: adds up its seconds.
        num_before: number of strokes in the last call.
        num_after: number of returned strokes.
    """

    name: str
    what: str
    run: Callable[[Gaussians], Gaussians]
    skip: str | None = None
    counts: dict[str, Any] = field(default_factory=dict)
    inputs: tuple[object, ...] = ()
    memory: Memory = field(default_factory=NoMemory)
    labels: Collection[int] | None = None
    watch: Stopwatch = field(default_factory=Stopwatch)
    num_before: int = 0
    num_after: int = 0

    def __call__(self, strokes: Gaussians) -> Gaussians:
        """The strokes after the pass; the same object if it is skipped."""
        rows = None if self.labels is None else rows_of(strokes, self.labels)
        self.num_before = self.num_after = len(strokes) if rows is None else len(rows)
        if self.skip is not None or (rows is not None and len(rows) == 0):
            return strokes

        def changed() -> Gaussians:
            return self.run(strokes) if rows is None else put(strokes, rows, self.run(strokes.take(rows)))

        with self.watch.running():
            after = self.memory.of(self.name, (strokes, *self.inputs), changed)
        self.num_after += len(after) - len(strokes)
        return after

    def within(self, labels: Collection[int], part: str | None = None) -> "StrokePass":
        """The same pass for some parts of a scene; `part` is their name."""
        name = self.name if part is None else f"{self.name} ({part})"
        return replace(self, name=name, labels=frozenset(labels), watch=Stopwatch())

    def report(self, report: Report) -> None:
        """Add its stage, after it ran."""
        with report.stage(self.name, earlier=self.watch) as stage:
            self._describe(stage)

    def _describe(self, stage: Stage) -> None:
        if self.skip is not None:
            stage.did = "nothing"
            stage.skipped.append(f"{self.name}: {self.skip}")
        else:
            stage.did = f"{self.num_after:,} strokes {self.what}"
            if dropped := self.num_before - self.num_after:
                stage.did += f", {dropped:,} dropped"
        if self.name in self.memory.found:
            stage.details.append(KEPT)
        stage.counts = {"before": self.num_before, "after": self.num_after} | self.counts


@dataclass(frozen=True, eq=False)
class Finish:
    """The passes on finished strokes.

    Attributes:
        passes: in this order.
    """

    passes: Sequence[StrokePass] = ()

    def __call__(self, strokes: Gaussians, report: Report | None = None) -> Gaussians:
        """The strokes after the passes; a report gets their stages."""
        for one in self.passes:
            strokes = one(strokes)
            if report is not None:
                one.report(report)
        return strokes

    def then(self, name: str, run: Callable[[Gaussians], Gaussians]) -> "Finish":
        """The same with one more function."""
        return Finish([*self.passes, StrokePass(name, name, run)])


def put(strokes: Gaussians, rows: Rows, part: Gaussians) -> Gaussians:
    """The strokes, with some rows replaced by a part [len(rows)]."""
    columns: dict[str, Any] = {}
    for name in (*strokes.columns(), "brushes"):
        ours, theirs = getattr(strokes, name), getattr(part, name)
        if theirs is None:
            continue
        changed = np.zeros(len(strokes), theirs.dtype) if ours is None else ours.copy()
        changed[rows] = theirs
        columns[name] = changed
    return replace(strokes, **columns)


def rows_of(strokes: Gaussians, labels: Collection[int]) -> Rows:
    """The rows of the strokes in some parts of a scene."""
    if strokes.regions is None:
        return np.arange(len(strokes) if 0 in labels else 0)
    return np.flatnonzero(np.isin(strokes.regions, np.array(sorted(labels), np.uint8)))


def nearest_regions(strokes: Gaussians, others: Gaussians) -> Gaussians:
    """Other strokes, each with the label of the nearest stroke."""
    if strokes.regions is None or len(others) == 0:
        return others
    return replace(others, regions=strokes.regions[nearest_rows(strokes, others)])


def nearest_rows(strokes: Gaussians, others: Gaussians) -> Rows:
    """[n] the row of the nearest stroke of each other stroke; 0 if there is none."""
    if len(strokes) == 0:
        return np.zeros(len(others), np.intp)
    from brushgs.passes.reduce.lloyd import assign

    points = np.ascontiguousarray(others.means, np.float32)
    return assign(points, strokes.means.astype(np.float64))[1].astype(np.intp)
