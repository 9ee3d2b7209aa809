"""Files that hold how each Gaussian moves become moving scenes."""

import warnings
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import numpy as np

from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.files import is_plain
from brushgs.formats.moving.formats import MovingFormat, find_moving
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
    if row.reader is None:
        raise SceneError(path, f"is a {row.name}, {row.cure}")
    if len(source.paths) > 1:
        raise SceneError(path, f"is a {row.name}, which moves by itself; name it alone")
    if source.lod is not None:
        raise SceneError(path, f"is a {row.name}, which has no levels of detail; omit the level (lod)")
    if source.moments_per_second is not None:
        what = f"is a {row.name}, one file that moves, not numbered moments"
        raise SceneError(path, f"{what}; omit their rate (--moments-per-second)")
    reader = import_module(f"brushgs.formats.moving.{row.reader}")
    # Values beyond float32 become infinite and NaN stays NaN: the readers drop both.
    with np.errstate(all="ignore"):
        moving: MovingScene = reader.open_moving(path)
    return moving


def _find(paths: Sequence[Path]) -> tuple[Path, MovingFormat] | None:
    """The first path that is a moving scene of itself."""
    for path in paths[:_NUM_INSPECTED]:
        if (row := find_moving(path)) is not None:
            return path, row
    return None


def _warn_of_networks(paths: Sequence[Path]) -> None:
    """Warn of Gaussians that lie beside the network that moves them: alone they are no moment of the clip."""
    for path in paths[:_NUM_INSPECTED]:
        if path.name == "point_cloud.ply" and is_plain(path.with_name("deformation.pth")):
            what = "are moved by the network beside them (deformation.pth), and show no moment without it"
            cure = f"name the folder {path.parent} for what to do"
            warnings.warn(SceneWarning(f"{path}: its Gaussians {what}; {cure}"), stacklevel=4)
