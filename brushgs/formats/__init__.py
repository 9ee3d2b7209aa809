"""Read and write files: Gaussians, cameras, stroke images and frames.

`table.py` lists the formats; `registry.py` finds the format of a file. This package imports nothing heavy
before a file is read or written, so help texts can use the table.
"""

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from brushgs.formats.scenes.columns import Encoding
    from brushgs.options.scene_source import SceneFiles
    from brushgs.values.camera import Camera
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians
    from brushgs.values.notes import LoadNotes

__all__ = ["load", "load_cameras", "read_scene", "save"]


def load(path: "SceneFiles", encoding: "Encoding | None" = None, *, lod: int | None = None) -> "Gaussians":
    """Read a trained 3D Gaussian scene; `read_scene` also returns notes on its files.

    Args:
        path: a scene file, such as .ply (its content decides the format, not its suffix); a folder that is a
            scene or holds scene files; or several of these, which are joined in order. If the scene moves,
            as files frame_000.ply, frame_001.ply, ... do, its first moment is read: see
            `brushgs.load_moving`.
        encoding: what the numbers mean; None for the standard layout. `brushgs.examine` and `brushgs doctor`
            detect the encoding of files from other exporters.
        lod: level of detail of a scene that has several, from 0, the finest; None for the default of its
            format.

    Raises:
        SceneError: if the file cannot be used; the message says why and what to do.

    Example:
        >>> bg.save(gaussians, "scene.ply")
        >>> scene = bg.load("scene.ply")
        >>> scene
        Gaussians(4,..., SH 3)
        >>> scene.means.shape == (len(scene), 3)
        True
    """
    return read_scene(path, encoding, lod)[0]


def read_scene(
    path: "SceneFiles", encoding: "Encoding | None" = None, lod: int | None = None
) -> "tuple[Gaussians, LoadNotes]":
    """Read a scene as `load` does, with the same arguments and errors.

    Returns:
        The Gaussians as float32 in the order of the files, and notes on the content of the files.
    """
    from brushgs.formats.scenes import read

    return read.read_scene(path, encoding, lod)


def load_cameras(path: str | Path) -> "list[Camera]":
    """Read cameras: `cameras.json`, `transforms.json`, a nerfstudio path, COLMAP, glTF or USD.

    An animated camera of a glTF or USD file gives one camera per frame, at 24 frames a second or at the rate
    of the stage; if no camera is animated, each gives one view. A node `brushgs_scene`, which exported files
    have, states where the scene is.

    Lens distortion is ignored with one SceneWarning. If `transforms.json` gives no size (`w`, `h`), pictures
    are 800 x 800, the size of the NeRF-synthetic scenes, whose files omit it.

    Args:
        path: a JSON, glTF or USD file (the last needs the package usd-core); or a COLMAP sparse model:
            its folder, one of its files (`images.bin`, `cameras.txt` ...), or a folder with it in `sparse/0`.

    Returns:
        The cameras in the order of the file (COLMAP cameras sorted by image name), with the default near
        plane.

    Raises:
        SceneError: if the format is unknown, or a field of a frame is missing or unusable; the message names
            the frame and the field.

    Example:
        >>> from pathlib import Path
        >>> text = '''{"fl_x": 300, "w": 320, "h": 240, "frames": [{"transform_matrix":
        ... [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}]}'''
        >>> _ = Path("transforms.json").write_text(text)
        >>> bg.load_cameras("transforms.json")
        [Camera(320x240, 43.6 degrees high, at 0, 0, 4)]
    """
    from brushgs.formats.cameras.read import read_cameras

    return read_cameras(path).cameras


def save(value: "Gaussians | Frame", path: str | Path, *, background: str | None = None) -> None:
    """Write Gaussians or a frame; the suffix decides the format, and the file appears when it is complete.

    Args:
        value: the Gaussians or the frame.
        path: the file, see `brushgs.save`.
        background: color behind a frame, by name or as "#rrggbb"; None or "transparent" keeps transparency,
            or puts the frame on white if the format has no transparency.

    Raises:
        TypeError: if `value` is neither Gaussians nor a Frame.
        ValueError: if the suffix does not suit the value, or the background is no color.
        SceneError: if the file cannot be written.
    """
    from brushgs.values.frame import Frame
    from brushgs.values.gaussians import Gaussians

    if isinstance(value, Gaussians):
        from brushgs.formats.scenes.write import write_scene

        write_scene(value, path)
    elif isinstance(value, Frame):
        from brushgs.formats.pictures.images import write_frame
        from brushgs.formats.registry import holds_alpha
        from brushgs.values.colors import rgb_of

        if background is None or background == "transparent":
            write_frame(value, path, background=None if holds_alpha(path) else (1.0, 1.0, 1.0))
        else:
            write_frame(value, path, background=rgb_of(background))
    else:
        raise TypeError(f"save: value must be Gaussians or a Frame, got {type(value).__name__}")
