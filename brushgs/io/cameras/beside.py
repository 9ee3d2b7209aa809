"""Cameras that lie beside a scene: where trainers and captures keep them, and nothing else."""

import warnings
from collections.abc import Iterable
from pathlib import Path

from brushgs.errors import SceneError, SceneWarning
from brushgs.io.cameras.formats import FILES_BESIDE, MODEL_BESIDE
from brushgs.io.cameras.read import read_cameras
from brushgs.io.files import is_dir, is_plain
from brushgs.values.camera import Camera


def find_beside(folders: Iterable[Path]) -> list[Path]:
    """The camera files in some folders, those of the first folder first; none is opened."""
    found = []
    for folder in folders:
        found += [path for name in FILES_BESIDE if is_plain(path := folder / name)]
        found += [path for path in (folder / MODEL_BESIDE,) if is_dir(path)]
    return found


def read_beside(path: Path) -> list[Camera]:
    """The cameras of such a file; what they are used for needs no lens, so its distortion is not told.

    Raises:
        SceneError: if it cannot be read, is too large, or is no camera file.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        return read_cameras(path).cameras


def name_beside(path: Path) -> str:
    """What such a file is called in messages."""
    return MODEL_BESIDE if path.name == "0" else path.name


def reason_of(error: SceneError) -> str:
    """Why a file cannot be used, without its path and the cure."""
    return str(error).removeprefix(f"{error.path}: ").split("; ")[0]
