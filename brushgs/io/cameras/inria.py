"""The `cameras.json` that 3DGS training writes: a list of camera-to-world poses.

Axes are x right, y down, z forward, as here.
"""

from pathlib import Path

from brushgs.io.cameras.camera_file import CameraFile
from brushgs.io.cameras.frame import CameraFrame, names_in, read_frames
from brushgs.values.camera import Camera


def read(path: Path, content: object) -> CameraFile:
    """The cameras of a list. Raises SceneError, see `read_cameras`."""
    cameras = read_frames(path, content, {}, _read_frame)
    return CameraFile(cameras, names=names_in(content, "img_name"))


def _read_frame(frame: CameraFrame) -> Camera:
    """One entry; the principal point is the middle of the picture."""
    width, height = frame.positive("width"), frame.positive("height")
    K = frame.positive("fx"), frame.positive("fy"), width / 2, height / 2
    return frame.camera(frame.array("rotation", 3, 3), frame.array("position", 3), K, (width, height))
