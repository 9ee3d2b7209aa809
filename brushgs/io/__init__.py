"""Files become Gaussians, cameras and stroke images; Gaussians and frames become files."""

from pathlib import Path

from brushgs.io.cameras.read import load_cameras
from brushgs.io.scenes.encoding import STANDARD, Encoding
from brushgs.io.scenes.notes import LoadNotes
from brushgs.io.scenes.ply import read_ply
from brushgs.scene import Frame, Gaussians

__all__ = ["LoadNotes", "Reading", "load", "load_cameras", "read_ply", "save"]


def load(path: str | Path, encoding: Encoding = STANDARD) -> Gaussians:
    """Read a trained 3D Gaussian scene; `read_ply` is the same and tells what it found.

    Args:
        path: a .ply file.
        encoding: what its numbers mean, where the file does not follow the usual layout; `bg.examine`
            and `brushgs doctor` find that out.

    Raises:
        SceneError: if the file cannot be used; says why and what to do.
    """
    return read_ply(path, encoding)[0]


def save(value: Gaussians | Frame, path: str | Path) -> None:
    """Write Gaussians (.ply) or a frame (.png, .tif, .exr); the suffix decides.

    The file appears when it is complete. A frame keeps its transparency.

    Raises:
        TypeError: if `value` is something else.
        ValueError: if the suffix does not suit the value.
        SceneError: if the file cannot be written.
    """
    if isinstance(value, Gaussians):
        if Path(path).suffix.lower() != ".ply":
            raise ValueError(f"save: Gaussians must go to a .ply file, got {str(path)!r}; change the suffix")
        from brushgs.io.scenes.ply_write import write_ply

        write_ply(value, path)
    elif isinstance(value, Frame):
        from brushgs.io.pictures.images import write_frame

        write_frame(value, path)
    else:
        raise TypeError(f"save: value must be Gaussians or a Frame, got {type(value).__name__}")
