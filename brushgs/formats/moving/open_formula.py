"""Files that hold how each Gaussian moves become moving scenes."""

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import is_dir, is_plain
from brushgs.formats.format import NUM_FIRST_BYTES, Format
from brushgs.formats.registry import SCENE_FORMATS, added, formats_of, function_of
from brushgs.options.scene_source import SceneSource
from brushgs.values.moving import MovingScene

_NUM_INSPECTED = 16  # of many paths: a clip of 100,000 files is not opened file by file


def open_formula(source: SceneSource) -> MovingScene | None:
    """A scene in one file that moves by itself; None for still scenes and those in a file a moment."""
    found = _find(source.paths)
    if found is None:
        _warn_of_networks(source.paths)
        return None
    path, row = found
    if row.read is None:
        raise SceneError(path, f"is a {row.name}, {row.cure}")
    if len(source.paths) > 1:
        raise SceneError(path, f"is a {row.name}, which moves by itself; name it alone")
    if source.lod is not None:
        raise SceneError(path, f"is a {row.name}, which has no levels of detail; omit the level (lod)")
    if source.moments_per_second is not None:
        what = f"is a {row.name}, one file that moves, not numbered moments"
        raise SceneError(path, f"{what}; omit their rate (--moments-per-second)")
    open_moving = function_of(row.read)
    # Values beyond float32 become infinite and NaN stays NaN: the readers drop both.
    with np.errstate(all="ignore"):
        moving: MovingScene = open_moving(path)
    return moving


def _find(paths: Sequence[Path]) -> tuple[Path, Format] | None:
    """The first path that is a moving scene of itself."""
    for path in paths[:_NUM_INSPECTED]:
        if (row := find_moving(path)) is not None:
            return path, row
    return None


def find_moving(path: Path) -> Format | None:
    """The format of a moving scene that a path is of, also of one that is not read; None if of none.

    None too for what is not there or may not be read: the reader of still scenes says so. Formats of other
    packages are asked of files that are no still scene either.
    """
    begin = b""
    if not is_dir(path):
        try:
            if not is_plain(path):
                return None
            with path.open("rb", buffering=0) as file:
                begin = file.read(NUM_FIRST_BYTES)
        except OSError:
            return None
        if not begin:
            return None
    own = next((row for row in formats_of("clip") if row.matches(path, begin)), None)
    if own is not None or not begin or any(row.matches(path, begin) for row in SCENE_FORMATS):
        return own
    return next((row for row in added("clip") if row.matches(path, begin)), None)


def _warn_of_networks(paths: Sequence[Path]) -> None:
    """Warn of Gaussians that lie beside the network that moves them: alone they are no moment of the clip."""
    for path in paths[:_NUM_INSPECTED]:
        if path.name == "point_cloud.ply" and is_plain(path.with_name("deformation.pth")):
            what = "are moved by the network beside them (deformation.pth), and show no moment without it"
            cure = f"name the folder {path.parent} for what to do"
            warnings.warn(SceneWarning(f"{path}: its Gaussians {what}; {cure}"), stacklevel=4)
