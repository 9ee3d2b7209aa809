"""What the files of one scene state together."""

import warnings
from collections import Counter
from collections.abc import Sequence

from brushgs.errors import SceneWarning
from brushgs.formats.scenes.scene_file import SceneFile
from brushgs.options.table import listed
from brushgs.values.gaussians import SH_TERMS
from brushgs.values.notes import LoadNotes, Training

_LONGEST_NAME = 40  # of a column, characters


def join_notes(files: Sequence[SceneFile], *, rows_dropped: int, sh_degree_used: int) -> LoadNotes:
    """What the files of one scene state together.

    Where they disagree, a SceneWarning says so, and what is done.
    """
    formats = list(dict.fromkeys(file.format for file in files))
    is_one = len(files) == 1
    return LoadNotes(
        format=formats[0] if is_one else f"{len(files)} files: {'; '.join(formats)}",
        rows_read=sum(file.num_rows for file in files),
        rows_dropped=rows_dropped,
        sh_degree_stored=SH_TERMS[max(file.num_terms for file in files)],
        sh_degree_used=sh_degree_used,
        up=_common_up(files),
        is_strokes=_are_strokes(files),
        training=_common_training(files),
        unknown=tuple(dict.fromkeys(_printable(name) for file in files for name in file.unknown)),
        files=() if is_one else tuple(f"{f.path.name}: {f.num_rows:,} rows, {f.format}" for f in files),
        scene=files[0].scene if is_one else None,
        first_view=files[0].first_view if is_one else None,
        brushes=files[0].brushes if is_one else (),
        moment=files[0].moment if is_one else None,
    )


def _common_up(files: Sequence[SceneFile]) -> str | None:
    """The axis that all those files name which name one."""
    named = {file.up: file.path.name for file in files if file.up is not None}
    if len(named) > 1:
        axes = listed([f"{up} ({name})" for up, name in named.items()], "and")
        _warn(files, f"the files name different axes as up, {axes}, and none is taken; state --up")
        return None
    return next(iter(named), None)


def _are_strokes(files: Sequence[SceneFile]) -> bool:
    """Whether all files are strokes."""
    strokes = [file.path.name for file in files if file.is_strokes]
    if strokes and len(strokes) < len(files):
        what = f"{strokes[0]} holds strokes of brushgs and other files do not"
        _warn(files, f"{what}; all are painted as one scene that is no strokes yet")
    return len(strokes) == len(files)


def _common_training(files: Sequence[SceneFile]) -> Training:
    """That of most Gaussians, the first of equals."""
    rows: Counter[Training] = Counter()
    for file in files:
        rows[file.training] += file.num_rows
    most = max(rows, key=lambda training: rows[training])
    if len(rows) > 1 and "antialiased" in rows:
        words = listed([f"{training} ({count:,} Gaussians)" for training, count in rows.items()], "and")
        _warn(files, f"the files were trained differently, {words}; all are drawn as {most}")
    return most


def _printable(name: str) -> str:
    """A name from a file, which is not trusted to be text nor to be short."""
    return "".join(c if c.isprintable() else "?" for c in name[:_LONGEST_NAME])


def _warn(files: Sequence[SceneFile], message: str) -> None:
    warnings.warn(SceneWarning(f"{files[0].path} and {len(files) - 1} more: {message}"), stacklevel=4)
