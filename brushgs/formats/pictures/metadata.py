"""The metadata of a picture: one line of JSON in its file that describes how it was painted.

PNG, JPEG, TIFF and OpenEXR store it as image description, WebP in the description of its Exif data, videos as
comment. AVIF and GIF have none, as libav does not write it. It contains no folder, user or date, so equal
pictures give equal files.
"""

import json
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from brushgs.errors import SceneError
from brushgs.formats.files import check_plain, exists, on_disk, read_whole, replacing
from brushgs.formats.pictures.encoding import INSTALL_PYAV
from brushgs.formats.pictures.images import MAX_PIXELS, find_format, suffixed
from brushgs.formats.registry import VIDEO_FORMATS, by_suffix, find_written, is_drawing
from brushgs.values.camera import Camera
from brushgs.values.shot import Origin, Shot
from brushgs.version import __version__

DESCRIPTION = "ImageDescription"  # key in OpenImageIO
COMMENT = "comment"  # key in libav
SIDECAR = ".json"  # appended to the name of a picture
_MAX_LENGTH = 60_000  # characters: a segment of a JPEG holds 65,533


class CameraMetadata(msgspec.Struct, frozen=True):
    """Camera of a picture, or of the first frame of a video, see `Camera`; matrices are row by row."""

    width: int
    height: int
    K: list[float]
    viewmat: list[float]
    near: float


class Metadata(msgspec.Struct, frozen=True):
    """Content of the metadata."""

    brushgs: str  # version of the program
    command: str  # see `Origin`
    inputs: str = ""  # digest of the inputs, see `Origin`
    camera: CameraMetadata | None = None  # None if the picture has no single view

    def is_of(self, origin: Origin) -> bool:
        """Whether this version of the program would paint the same picture from `origin`."""
        return (self.brushgs, self.command, self.inputs) == (__version__, origin.command, origin.inputs)


def metadata_text(shot: Shot | None) -> str:
    """The metadata as ASCII text; "" without an origin, or if it is too long."""
    if shot is None or shot.origin is None:
        return ""
    camera = None if shot.camera is None else _camera(shot.camera)
    found = Metadata(__version__, shot.origin.command, shot.origin.inputs, camera)
    text = json.dumps(msgspec.to_builtins(found))
    return text if len(text) <= _MAX_LENGTH else ""


def described(shot: Shot | None) -> dict[str, Any]:
    """The metadata, and pixels per inch, as attributes of OpenImageIO."""
    text = metadata_text(shot)
    found: dict[str, Any] = {DESCRIPTION: text} if text else {}
    if shot is not None and shot.dpi is not None:
        found |= {"XResolution": shot.dpi, "YResolution": shot.dpi, "ResolutionUnit": "in"}
    return found


def read_metadata(path: Path) -> Metadata | None:
    """Read the metadata of a picture or video; None if it has none.

    Raises SceneError if the file does not exist, or cannot be read as a picture or video.
    """
    if is_drawing(path):
        from brushgs.formats.pictures.svg import read_description

        text = read_description(path)
    elif (layered := find_written("layered", path)) is not None:
        if not layered.holds_metadata:
            return None
        from brushgs.formats.pictures.layered import merged_picture

        with on_disk(path, merged_picture(path), "merged.png", "its merged picture") as merged:
            text = _description(merged)
    else:
        film = by_suffix(VIDEO_FORMATS, path)
        text = _description(path) if film is None else _comment(path, film.container)
    try:
        return msgspec.json.decode(text, type=Metadata)
    except (msgspec.DecodeError, RecursionError):
        return None


def metadata_of(path: Path) -> Metadata | None:
    """The metadata of a picture; if it states no camera, that of its sidecar file, if there is one.

    Raises SceneError if the picture does not exist, or the sidecar is damaged.
    """
    found = read_metadata(path)
    beside = sidecar_of(path)
    if (found is None or found.camera is None) and exists(beside):
        try:
            found = msgspec.json.decode(read_whole(beside, _MAX_LENGTH), type=Metadata)
        except (msgspec.DecodeError, RecursionError) as error:
            cure = "write it again with `brushgs render --sidecar`"
            raise SceneError(beside, f"states no camera ({error}); {cure}") from None
    return found


def camera_of(path: Path) -> Camera | None:
    """The camera stated by a picture or its sidecar; None if neither does.

    Raises SceneError if the picture does not exist, the sidecar is damaged, or the camera is invalid.
    """
    found = metadata_of(path)
    if found is None or (camera := found.camera) is None:
        return None
    try:
        matrices = np.reshape(camera.viewmat, (4, 4)), np.reshape(camera.K, (3, 3))
        return Camera(*matrices, camera.width, camera.height, camera.near)
    except ValueError as error:
        raise SceneError(path, f"states a camera that cannot be used ({error}); paint it again") from None


def sidecar_of(path: Path) -> Path:
    """Path of the sidecar of a picture: frame.png.json."""
    return path.with_name(path.name + SIDECAR)


def write_sidecar(path: Path, shot: Shot) -> Path:
    """Write the metadata of a picture to a sidecar, for programs that strip it from files; returns its path.

    Raises SceneError if it cannot be written.
    """
    beside = sidecar_of(path)
    with replacing(beside) as temporary:
        temporary.write_text(metadata_text(shot) + "\n", encoding="utf-8")
    return beside


def is_painted_by(path: Path, origin: Origin) -> bool:
    """Whether a file already holds the picture of `origin`; False if it cannot be read."""
    try:
        found = read_metadata(path) if exists(path) else None
    except SceneError:
        return False
    return found is not None and found.is_of(origin)


def _camera(camera: Camera) -> CameraMetadata:
    K, viewmat = ([float(f"{one:.9g}") for one in matrix.ravel()] for matrix in (camera.K, camera.viewmat))
    return CameraMetadata(camera.width, camera.height, K, viewmat, float(camera.near))


def _comment(path: Path, container: str) -> str:
    try:
        import av
    except ImportError:
        raise SceneError(path, f"is a film, which PyAV reads; {INSTALL_PYAV}") from None

    check_plain(path, "video")
    try:
        with av.open(str(path), format=container) as opened:
            found = {name.lower(): value for name, value in opened.metadata.items()}
    except (av.FFmpegError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or "a text in it is not UTF-8"
        raise SceneError(path, f"cannot be read as a video ({why}); get it again") from None
    return str(found.get(COMMENT, ""))


def _description(path: Path) -> str:
    import OpenImageIO

    picture_format = find_format(path, MAX_PIXELS)
    if picture_format.name == "WebP":  # OpenImageIO ignores its Exif data
        from brushgs.formats.pictures.still import read_description

        return read_description(path)
    with suffixed(path, picture_format) as named:
        source = OpenImageIO.ImageInput.open(str(named))
        if source is None:
            raise SceneError(path, f"cannot be read as a picture ({OpenImageIO.geterror()}); get it again")
        try:
            return str(source.spec().get_string_attribute(DESCRIPTION))
        except UnicodeDecodeError:
            return ""
        finally:
            source.close()
