"""A camera file of any format becomes a list of `Camera`."""

from importlib import import_module
from pathlib import Path

from brushgs.errors import SceneError
from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.formats import CAMERA_FORMATS, CAMERAS_READ, UNREAD_CAMERAS, CameraFormat
from brushgs.io.json_file import read_json, shown


def read_cameras(path: str | Path) -> CameraFile:
    """Read a camera file: its views as `brushgs.load_cameras` returns them, and what else a path states.

    Raises:
        SceneError: if the file is of no known format, or a field of a frame is missing or unusable.
    """
    path = Path(path)
    camera_format, content = _identify(path)
    reader = import_module(f"brushgs.io.cameras.{camera_format.reader}")
    file: CameraFile = reader.read(path, content)
    return file


def _identify(path: Path) -> tuple[CameraFormat, object]:
    """The format of a file, and its JSON value; None where the path shows the format."""
    for camera_format in CAMERA_FORMATS:
        if camera_format.matches_path is not None and camera_format.matches_path(path):
            return camera_format, None
    if (what := UNREAD_CAMERAS.get(path.suffix.lower())) is not None:
        raise SceneError(path, f"is {what}, which is not read; export its cameras as glTF (.glb) or USD")
    cure = f"give {CAMERAS_READ}"
    content = read_json(path, cure)
    for camera_format in CAMERA_FORMATS:
        if camera_format.matches_json is not None and camera_format.matches_json(content):
            return camera_format, content
    raise SceneError(path, f"is no camera file of a known format, got {shown(content)}; {cure}")
