"""Read the camera of the photograph from which a scene was predicted, from the elements of its PLY file.

SHARP (Mescheder et al. 2025) and similar programs write, after `vertex`, the elements `extrinsic` (16
numbers, a world-to-camera matrix in row order), `intrinsic` (9, pixels) and `image_size` (2: width, height),
each with one property. Axes are x right, y down, z forward.
"""

from pathlib import Path

import numpy as np
from msgspec import Struct

from brushgs.errors import SceneError
from brushgs.formats.cameras.read import CameraFile
from brushgs.formats.cameras.views import Entry
from brushgs.formats.scenes.ply_header import Header, check_size, open_header, read_columns
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera

COUNTS = {"extrinsic": 16, "intrinsic": 9, "image_size": 2}


def read(path: Path, content: bytes | None) -> CameraFile:
    """Read the camera in a scene file. Raises SceneError if the file is damaged or has no camera."""
    header, size = open_header(path)
    camera = camera_in(path, header, size)
    if camera is None:
        listed = ", ".join(element.name for element in header.elements) or "none"
        fact = f"has no camera of a photograph among its elements ({listed})"
        raise SceneError(path, f"{fact}; give a file of cameras")
    return CameraFile([camera])


def camera_in(path: Path, header: Header, size: int) -> Camera | None:
    """The camera of a PLY file of `size` bytes; None if it lacks the element `extrinsic` or `intrinsic`.

    Raises SceneError if `image_size` is missing, or the camera is unusable.
    """
    found = {name: header.find(name) for name in COUNTS}
    missing = [name for name, element in found.items() if element is None]
    if "extrinsic" in missing or "intrinsic" in missing:
        return None
    if missing:
        raise SceneError(path, f"no element {missing[0]!r} of its camera; export the scene again")
    extrinsic, intrinsic, image_size = (_numbers(path, header, name, size) for name in COUNTS)
    matrix, K = extrinsic.reshape(4, 4), intrinsic.reshape(3, 3)
    if not (np.isfinite(matrix).all() and np.isfinite(K).all()):
        raise SceneError(path, "the elements of its camera must be finite; export the scene again")
    if np.abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6 or np.abs(K[[1, 2, 2], [0, 0, 1]]).max() > 1e-6:
        what = "the last row of element 'extrinsic' must be 0 0 0 1, and element 'intrinsic' a pinhole's"
        raise SceneError(path, f"{what}; export the scene again")
    rotation = matrix[:3, :3].T
    lens = float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2])
    width, height = float(image_size[0]), float(image_size[1])
    entry = Entry(path, "element 'extrinsic'", Struct())
    return entry.camera(rotation, -rotation @ matrix[:3, 3], lens, (width, height))


def _numbers(path: Path, header: Header, name: str, size: int) -> F64:
    element = header.find(name)
    assert element is not None
    if element.count != COUNTS[name] or len(element.names) != 1 or element.lists:
        rule = f"{COUNTS[name]} rows of one property"
        got = f"{element.count} of {len(element.names) + len(element.lists)}"
        raise SceneError(path, f"element {name!r} must have {rule}, got {got}; export the scene again")
    check_size(path, header, element, size)
    return np.asarray(read_columns(path, header, element, element.names, np.float64)[0])
