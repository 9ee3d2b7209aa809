"""A scene file of any format becomes Gaussians."""

from pathlib import Path

from brushgs.io.scenes.encoding import STANDARD, Encoding
from brushgs.io.scenes.notes import LoadNotes
from brushgs.io.scenes.ply import read_ply
from brushgs.scene import Gaussians


def read_scene(path: str | Path, encoding: Encoding | None = None) -> tuple[Gaussians, LoadNotes]:
    """Read a trained 3D Gaussian scene. See `read_ply`."""
    return read_ply(path, encoding or STANDARD)
