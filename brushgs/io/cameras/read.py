"""A camera file of any format becomes a list of `Camera`."""

from importlib import import_module
from pathlib import Path

import msgspec

from brushgs.errors import SceneError
from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.formats import CAMERA_FORMATS, CAMERAS_READ, UNREAD_CAMERAS, CameraFormat
from brushgs.io.files import read_whole
from brushgs.io.json_file import MAX_BYTES, check_memory, parse_checked, shown


def read_cameras(path: str | Path) -> CameraFile:
    """Read a camera file: its views as `brushgs.load_cameras` returns them, and what else a path states.

    Raises:
        SceneError: if the file is of no known format, or a field of a frame is missing or unusable.
    """
    path = Path(path)
    camera_format, content = _identify(path)
    module, _, function = camera_format.reader.partition(":")
    reader = getattr(import_module(f"brushgs.io.cameras.{module}"), function or "read")
    file: CameraFile = reader(path, content)
    return file


def _identify(path: Path) -> tuple[CameraFormat, bytes | None]:
    """The format of a file, and its bytes; None where the path shows the format."""
    for camera_format in CAMERA_FORMATS:
        if camera_format.matches_path is not None and camera_format.matches_path(path):
            return camera_format, None
    if (what := UNREAD_CAMERAS.get(path.suffix.lower())) is not None:
        raise SceneError(path, f"is {what}, which is not read; export its cameras as glTF (.glb) or USD")
    cure = f"give {CAMERAS_READ}"
    content = read_whole(path, MAX_BYTES)
    check_memory(path, content)
    try:
        value = msgspec.json.decode(content, type=list[msgspec.Raw] | dict[str, msgspec.Raw])
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        value = parse_checked(path, content, cure)
    for camera_format in CAMERA_FORMATS:
        key = camera_format.key
        if (key in value) if key and isinstance(value, dict) else (key == "" and isinstance(value, list)):
            return camera_format, content
    raise SceneError(path, f"is no camera file of a known format, got {shown(value)}; {cure}")
