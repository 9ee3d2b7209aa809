"""Notes on the built-in strokes, read from the table in `strokes/README.md`, which is installed beside the
images.
"""

from typing import NamedTuple

from brushgs.brushes.texture import builtin_names, strokes_folder

_COLUMNS = ["name", "size", "runs", "what it is", "cover", "good for"]


class StrokeNotes(NamedTuple):
    """Table entry of one stroke."""

    name: str
    what: str
    good_for: str


def stroke_notes() -> list[StrokeNotes]:
    """Notes on every built-in stroke, in the order of `builtin_names`; texts may be empty."""
    path = strokes_folder() / "README.md"
    lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    start = rows.index(_COLUMNS) + 2 if _COLUMNS in rows else len(rows)
    notes = {row[0].strip("`"): (row[3], row[5]) for row in rows[start:] if len(row) == len(_COLUMNS)}
    return [StrokeNotes(name, *notes.get(name, ("", ""))) for name in builtin_names()]
