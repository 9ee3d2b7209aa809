"""PLY files with columns for time beside those of a still scene."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import open_plain
from brushgs.formats.scenes import ply
from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.encoding import STANDARD
from brushgs.formats.scenes.ply_header import parse_header
from brushgs.formats.scenes.ply_rows import open_rows
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.values.arrays import F32

_BLOCK_BYTES = 1 << 21


@dataclass(frozen=True)
class TimedPly:
    """All rows of a PLY file, not yet checked.

    Attributes:
        file: what its header states.
        columns: of the still layout, as stored.
        more: the other columns that were asked for, [N] each, by name.
        comments: of its header, first word -> the others.
    """

    file: SceneFile
    columns: Columns
    more: dict[str, F32]
    comments: dict[str, str]

    def stack(self, *names: str) -> F32:
        """[N, number of names] some of the other columns."""
        return np.stack([self.more[name] for name in names], axis=1)


def read_timed(path: Path, what: str, names: Sequence[str]) -> TimedPly:
    """Read a PLY file that has columns for time.

    Args:
        path: the file.
        what: name of its format, for messages and notes.
        names: of the columns beside the still ones; those that it does not have are refused.

    Raises:
        SceneError: if the file is damaged or lacks a column.
    """
    file = ply.open_scene(path)
    with open_plain(path, "PLY file", buffering=0) as opened:
        header = parse_header(opened, path)
    vertex = header.find("vertex")
    assert vertex is not None, "open_scene refuses files without"
    for name in names:
        if name not in vertex.names:
            rule = f"no property {name!r} among {len(vertex.names)} read, which a {what} has"
            raise SceneError(path, f"{rule}; export it with all of its columns")
    columns, _ = file.read_columns(encoding=STANDARD, is_raw=True)
    more = np.empty((len(names), vertex.count), np.float32)
    block_rows = max(_BLOCK_BYTES // vertex.dtype.itemsize, 1)
    with open_rows(path, header, vertex, block_rows) as rows:
        for start in range(0, vertex.count, block_rows):
            stop = min(start + block_rows, vertex.count)
            block = rows.read(start, stop)
            for index, name in enumerate(names):
                more[index, start:stop] = block[name]
    layout = file.format.removeprefix("PLY, ")
    source = SceneFile(
        path=path,
        format=f"{what}, {layout}",
        num_rows=file.num_rows,
        num_terms=file.num_terms,
        read_columns=file.read_columns,
        up=file.up,
        training=file.training,
        unknown=tuple(name for name in file.unknown if name not in names),
    )
    comments = dict(line.partition(" ")[::2] for line in header.comments)
    return TimedPly(source, columns, dict(zip(names, more, strict=True)), comments)
