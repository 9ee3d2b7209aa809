"""The work on a block of a scene, in this process or another: read it, and sum it up by cell."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from brushgs.formats.scenes.columns import Dropped, drop_zero_bands
from brushgs.formats.scenes.open_file import open_file
from brushgs.formats.scenes.rows import BLOCK_ROWS, RowSource, read_blocks
from brushgs.passes.reduce.block_merge import CellSums, cell_sums
from brushgs.passes.reduce.block_table import CellTable
from brushgs.passes.reduce.features import SceneFrame


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
