"""Strokes that move become a folder of scene files, one a moment, which is read back as a clip.

Rows correspond: row i of every file is the same stroke. A folder changes only when all files are complete.
"""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from brushgs.errors import SceneError
from brushgs.formats.files import filling, is_dir, is_plain
from brushgs.formats.registry import SCENE_SUFFIXES
from brushgs.formats.scenes.ply_header import STROKES
from brushgs.formats.scenes.write import write_scene
from brushgs.values.gaussians import Gaussians

NAME = "moment_%05d" + SCENE_SUFFIXES[0]  # the word says to readers that these are moments
_OURS = re.compile(r"moment_[0-9]{5,}" + re.escape(SCENE_SUFFIXES[0]))
_BEGIN = 4096  # bytes of a file in which its header says that it holds strokes


def check_moments_folder(folder: Path) -> None:
    """Refuse a folder whose files would be lost among moments, or that is none.

    Earlier moments of strokes, and hidden files, may be there: the former are replaced.

    Raises SceneError if it is a file, cannot be read, or holds anything else.
    """
    if not is_dir(folder):
        if folder.exists():
            raise SceneError(folder, "is a file, not a folder; choose another name")
        return
    try:
        others = [path.name for path in sorted(folder.iterdir()) if not _may_go(path)]
    except OSError as error:
        raise SceneError(folder, f"cannot be read ({error.strerror}); check its permissions") from None
    others = [name for name in others if not name.startswith(".")]
    if others:
        more = f" and {len(others) - 1:,} more" if len(others) > 1 else ""
        fact = f"holds {others[0]}{more}, which brushgs did not write as moments"
        raise SceneError(folder, f"{fact}; choose a new folder")


def write_moments(moments: Iterable[Gaussians], folder: Path, **about: Any) -> int:
    """Write strokes at the moments of a clip, completely or not at all; earlier moments go.

    Args:
        moments: the strokes at each moment, in order; made as they are written.
        folder: made if it is missing; see `check_moments_folder`.
        about: what `write_scene` is told of them. Raises as that does.

    Returns:
        Bytes of all files.
    """
    with filling(folder, _may_go) as temporary:
        for index, strokes in enumerate(moments):
            write_scene(strokes, temporary / (NAME % index), is_strokes=True, **about)
        return sum(path.stat().st_size for path in temporary.iterdir())


def _may_go(path: Path) -> bool:
    """Whether a file is a moment of strokes."""
    if not _OURS.fullmatch(path.name) or not is_plain(path):
        return False
    try:
        with path.open("rb") as file:
            return f"\ncomment {STROKES}\n".encode() in file.read(_BEGIN)
    except OSError:
        return False
