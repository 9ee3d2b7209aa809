"""Read a scene larger than memory into Gaussians that fit."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from brushgs.formats.scenes.columns import Dropped, drop_zero_bands
from brushgs.formats.scenes.open_file import join_notes, open_file, warn_of_encoding
from brushgs.formats.scenes.rows import (
    BLOCK_ROWS,
    SAMPLE_ROWS,
    RowSource,
    SceneFile,
    read_blocks,
    sample_rows,
)
from brushgs.options.sequence import SequenceConfig
from brushgs.passes.extent import robust_frame
from brushgs.passes.reduce.block_merge import CellSums, cell_sums, merged_of
from brushgs.passes.reduce.block_table import CellTable
from brushgs.passes.reduce.features import SceneFrame
from brushgs.pipeline.blocks.budget import MOST_MERGED, Budget
from brushgs.pipeline.parallel import parallel_map
from brushgs.pipeline.parallel.connection import Waiting
from brushgs.pipeline.report import Report
from brushgs.values.gaussians import SH_TERMS, Gaussians
from brushgs.values.notes import LoadNotes

# The work on a block of a scene, in this process or another: read it, and sum it up by cell.


class Block(NamedTuple):
    """Rows `start` to `stop` of one of the files."""

    file: int
    start: int
    stop: int


class BlockSums(NamedTuple):
    """The sums of a block, and its rows that cannot be drawn."""

    file: int
    sums: CellSums
    dropped: Dropped


class OpenFiles:
    """The files of a scene; only the file requested last is open."""

    def __init__(self, paths: Sequence[Path], lod: int | None) -> None:
        self._paths, self._lod = paths, lod
        self._rows: tuple[int, RowSource] | None = None

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_rows": None}  # another process opens them itself

    def rows(self, number: int) -> RowSource:
        """The rows of a file."""
        if self._rows is None or self._rows[0] != number:
            self._rows = None  # before another takes its memory
            self._rows = number, open_file(self._paths[number], self._lod).open_rows()
        return self._rows[1]


class SumBlock:
    """Work of `parallel_map`: the sums of one block.

    Attributes:
        files: of the scene.
        frame: see `cell_sums`.
        most: cells of a whole scene.
        block_rows: rows in memory at a time.
        antialiased: whether the scene was trained so.
    """

    def __init__(
        self, files: OpenFiles, frame: SceneFrame, most: int, block_rows: int, *, antialiased: bool
    ) -> None:
        self.files, self.frame, self.most, self.block_rows = files, frame, most, block_rows
        self.antialiased = antialiased

    def __call__(self, block: Block) -> BlockSums:
        """Read the rows of a block, a whole file if necessary, and sum them up."""
        table, dropped = CellTable(self.most), Dropped()
        rows = self.files.rows(block.file)
        for columns, some in read_blocks(rows, block.start, block.stop, self.block_rows):
            dropped.add(some)
            drop_zero_bands(columns)
            table.add(*cell_sums(columns.gaussians(antialiased=self.antialiased), self.frame))
        return BlockSums(block.file, CellSums(*table.take()), dropped)


def usual_block_rows(num_terms: int) -> int:
    """Rows of a block, for constant memory at any number of spherical-harmonic terms."""
    return BLOCK_ROWS * 5 // (4 + num_terms)


def load_in_blocks(
    files: Sequence[SceneFile],
    lod: int | None,
    budget: Budget,
    workers: SequenceConfig | None = None,
    *,
    block_rows: int | None = None,
    report: Report | None = None,
) -> tuple[Gaussians, LoadNotes]:
    """Read a scene in blocks, each once, and merge it.

    First some rows of each file are read: center and radius of the scene are those of a sample of 262,144
    rows.

    Args:
        files: as `read.open_files` gives them.
        lod: level of detail of the open files.
        budget: the memory budget, too small for the scene.
        workers: where blocks are read: a number of processes, or a Dask cluster whose workers see the same
            files. None, or one process, for as many processes of this machine as are worth it.
        block_rows: rows in memory at a time; None for some 100 MB of them. The Gaussians depend on it by
            rounding only.
        report: its running stage shows how many blocks are read, and it reports a wait for a cluster.

    Returns:
        The merged Gaussians, and notes on the files: `rows_each` says how many are one.

    Raises:
        SceneError: if a file is damaged, or none of its rows can be drawn.
    """
    num_terms = max(file.num_terms for file in files)
    block_rows = block_rows or usual_block_rows(num_terms)
    capacity = budget.capacity(num_terms)
    most = MOST_MERGED if capacity is None else min(capacity, MOST_MERGED)
    opened = OpenFiles([file.path.absolute() for file in files], lod)
    survey = _survey(files, opened, block_rows)
    notes = join_notes(files, rows_dropped=0, sh_degree_used=0)
    if survey.is_whole or workers is None:
        workers = SequenceConfig()
    jobs = workers.jobs
    if jobs == 1 and workers.scheduler is None and not survey.is_whole:
        jobs = min(budget.num_processes(), len(survey.blocks))
    report = report or Report()
    report.expect(len(survey.blocks), "blocks")
    waiting = Waiting(workers.workers_timeout, report.tell)
    antialiased = notes.training == "antialiased"
    work = SumBlock(opened, survey.frame, most, block_rows, antialiased=antialiased)
    table, dropped = CellTable(most), [Dropped() for _ in files]
    for result in parallel_map(work, survey.blocks, jobs=jobs, scheduler=workers.scheduler, waiting=waiting):
        dropped[result.file].add(result.dropped)
        table.add(*result.sums)
        report.advance()
    for file, some in zip(files, dropped, strict=True):
        some.report(file.path, file.num_rows)
    gaussians = merged_of(table, survey.frame, antialiased=antialiased)
    num_dropped = sum(some.num_rows for some in dropped)
    return gaussians, replace(
        notes,
        rows_dropped=num_dropped,
        sh_degree_used=SH_TERMS[gaussians.sh.shape[1]],
        rows_each=(notes.rows_read - num_dropped) / len(gaussians),
    )


class _Survey(NamedTuple):
    """Facts about a scene before it is read.

    Attributes:
        frame: center and radius, of a sample.
        blocks: of all files.
        is_whole: whether some file is in memory as a whole, so that no other process should read it too.
    """

    frame: SceneFrame
    blocks: list[Block]
    is_whole: bool


def _survey(files: Sequence[SceneFile], opened: OpenFiles, block_rows: int) -> _Survey:
    num_rows, means, blocks, is_whole = sum(file.num_rows for file in files), [], [], False
    for number, file in enumerate(files):
        rows = opened.rows(number)
        is_whole = is_whole or rows.is_whole
        sample = sample_rows(rows, SAMPLE_ROWS * file.num_rows // num_rows)
        if not file.has_fixed_encoding:
            warn_of_encoding(file.path, sample)
        means.append(sample.means)
        step = file.num_rows if rows.is_sequential else block_rows  # rows in order are one block
        starts = range(0, file.num_rows, step)
        blocks += [Block(number, start, min(start + step, file.num_rows)) for start in starts]
    return _Survey(robust_frame(np.concatenate(means)), blocks, is_whole)
