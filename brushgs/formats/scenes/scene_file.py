"""What every format gives: a scene file with its header read, whose rows can then be read."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from brushgs.formats.scenes.columns import Columns
from brushgs.formats.scenes.dropped import Dropped
from brushgs.formats.scenes.encoding import Encoding
from brushgs.formats.scenes.fill import RowSource
from brushgs.values.camera import FirstView
from brushgs.values.notes import Training


class ColumnReader(Protocol):
    """Reads all rows of one scene file."""

    def __call__(self, *, encoding: Encoding, is_raw: bool) -> tuple[Columns, Dropped]:
        """Read the rows, most simply through `fill`.

        Args:
            encoding: what the numbers mean; always the standard one if the format has a fixed encoding.
            is_raw: whether to return all rows and all terms as they would be in the standard layout
                (log-scales and logits), neither checked nor activated.

        Returns:
            The rows that can be drawn, activated, without bands of spherical harmonics that are zero
            throughout; and the dropped rows.

        Raises:
            SceneError: if the file is damaged.
        """


@dataclass(frozen=True)
class SceneFile:
    """A scene file whose header was read and is sound.

    Attributes:
        path: the file, or the folder of a scene in several files.
        format: layout and encoding in words, such as "PLY, binary little-endian".
        num_rows: Gaussians that it holds, >= 1.
        num_terms: spherical-harmonic terms stored of each: 1, 4, 9 or 16.
        read_columns: reads the rows.
        has_fixed_encoding: whether the format leaves no doubt what its numbers mean.
        up: axis that the file names as up, "+x" to "-z"; None if it names none.
        is_strokes: whether the file states that its Gaussians are strokes that brushgs made.
        training: how they were trained, as far as the file states it.
        unknown: columns or extensions of the file that are not read, by name.
        scene: name of the scene that strokes were made of; None if the file names none.
        first_view: how that scene is seen; None if the file does not say.
        brushes: names or paths of the brushes that strokes have rows of, as far as the file states them.
        moment: of a moving scene, whose moment this is: seconds from its start; None for a scene at rest.
        open_rows: gives rows in the standard encoding one block at a time, without what `read_columns` does
            to all of them: bands that are zero are decoded too, and strokes are in no order; raises a
            SceneError where that does. None for formats whose rows can only be decoded all at once.
    """

    path: Path
    format: str
    num_rows: int
    num_terms: int
    read_columns: ColumnReader
    has_fixed_encoding: bool = True
    up: str | None = None
    is_strokes: bool = False
    training: Training = "default"
    unknown: tuple[str, ...] = ()
    scene: str | None = None
    first_view: FirstView | None = None
    brushes: tuple[str, ...] = ()
    moment: float | None = None
    open_rows: Callable[[], RowSource] | None = None
