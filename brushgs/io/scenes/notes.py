"""What reading a scene found beside the Gaussians themselves, in one file or in several."""

import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from brushgs.errors import SceneWarning
from brushgs.io.formats import in_words
from brushgs.io.scenes.scene_file import SceneFile, Training
from brushgs.scene import SH_TERMS, FirstView

_LONGEST_NAME = 40  # of a column, characters


@dataclass(frozen=True)
class LoadNotes:
    """What the files of a scene held, and what was dropped from them without changing the picture.

    Attributes:
        format: layout and encoding in words, for example "PLY, binary little-endian"; with several files
            their number, and each format once.
        rows_read: Gaussians in the files.
        rows_dropped: those dropped because they cannot be drawn (a SceneWarning said why).
        sh_degree_stored: degree of the spherical harmonics in the files, 0 to 3, the highest of them.
        sh_degree_used: degree that was loaded; lower than stored where the bands above are all zero.
        up: axis that the files name as up, "+x" to "-z"; None if they name none, or different ones.
        is_strokes: whether every file states that its Gaussians are strokes that brushgs made.
        training: how the scene was trained, as far as the files state it.
        unknown: columns or extensions of the files that were not read, by name, safe to print.
        files: each of several files in words; empty for one.
        scene: name of the scene that strokes were made of; None if the file names none, and for several.
        first_view: how that scene is seen; None if the file does not say, and for several.
        brushes: names or paths of the brushes that the strokes have rows of; none if the file names none, and
            for several.
        moment: of a moving scene the moment that was read, seconds from its start; None for a scene at rest.
        moments_per_second: of a moving scene in a file a moment, as read; None for any other.
        is_timed: whether the files of a moving scene give its length in seconds; else these are nominal.
        rows_each: how many rows one of the Gaussians was made of on average: 1, or more where a scene larger
            than memory was merged while it was read.
        camera_folders: where cameras of the scene may lie; none where they are not sought.
    """

    format: str
    rows_read: int
    rows_dropped: int
    sh_degree_stored: int
    sh_degree_used: int
    up: str | None
    is_strokes: bool = False
    training: Training = "default"
    unknown: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    scene: str | None = None
    first_view: FirstView | None = None
    brushes: tuple[str, ...] = ()
    moment: float | None = None
    moments_per_second: float | None = None
    is_timed: bool = False
    rows_each: float = 1.0
    camera_folders: tuple[Path, ...] = ()


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
        axes = in_words([f"{up} ({name})" for up, name in named.items()], "and")
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
        words = in_words([f"{training} ({count:,} Gaussians)" for training, count in rows.items()], "and")
        _warn(files, f"the files were trained differently, {words}; all are drawn as {most}")
    return most


def _printable(name: str) -> str:
    """A name from a file, which is not trusted to be text nor to be short."""
    return "".join(c if c.isprintable() else "?" for c in name[:_LONGEST_NAME])


def _warn(files: Sequence[SceneFile], message: str) -> None:
    warnings.warn(SceneWarning(f"{files[0].path} and {len(files) - 1} more: {message}"), stacklevel=4)
