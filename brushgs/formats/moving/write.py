"""Write moving strokes as a folder of scene files, one per moment, which can be read back as a clip.

Rows correspond: row i of every file is the same stroke. The folder changes only when all files are complete.
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

NAME = "moment_%05d" + SCENE_SUFFIXES[0]  # "moment" tells readers that these are moments
_OURS = re.compile(r"moment_[0-9]{5,}" + re.escape(SCENE_SUFFIXES[0]))
_BEGIN = 4096  # bytes at the start of a file that are searched for the mark of strokes


def check_moments_folder(folder: Path) -> None:
    """Refuse a folder that holds other files than earlier moments of strokes (to be replaced) or hidden ones.

    Raises SceneError then, and if it is a file or cannot be read. A missing folder is accepted.
    """
    if not is_dir(folder):
        if folder.exists():
            raise SceneError(folder, "is a file, not a folder; choose another name")
        return
    try:
        others = [path.name for path in sorted(folder.iterdir()) if path.name[0] != "." and not _may_go(path)]
    except OSError as error:
        raise SceneError(folder, f"cannot be read ({error.strerror}); check its permissions") from None
    if others:
        more = f" and {len(others) - 1:,} more" if len(others) > 1 else ""
        fact = f"holds {others[0]}{more}, which brushgs did not write as moments"
        raise SceneError(folder, f"{fact}; choose a new folder")


def write_moments(moments: Iterable[Gaussians], folder: Path, **about: Any) -> int:
    """Write the strokes of each moment, all files or none; earlier moments in the folder are removed.

    Args:
        moments: the strokes at each moment, in order; consumed one at a time.
        folder: created if missing; see `check_moments_folder`.
        about: passed to `write_scene`. Raises as that does.

    Returns:
        Total bytes of the files.
    """
    with filling(folder, _may_go) as temporary:
        for index, strokes in enumerate(moments):
            write_scene(strokes, temporary / (NAME % index), is_strokes=True, **about)
        return sum(path.stat().st_size for path in temporary.iterdir())


def _may_go(path: Path) -> bool:
    """Whether a file is a moment of strokes written by brushgs."""
    if not _OURS.fullmatch(path.name) or not is_plain(path):
        return False
    try:
        with path.open("rb") as file:
            return f"\ncomment {STROKES}\n".encode() in file.read(_BEGIN)
    except OSError:
        return False
