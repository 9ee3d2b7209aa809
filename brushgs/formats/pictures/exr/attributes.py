"""What the header of an OpenEXR file says beside the channels: camera, time, colour, and our conventions.

Matrices stand in rows, for vectors that are multiplied from the left, as OpenEXR has them.
Source: OpenEXR, Standard Attributes (openexr.com); ASWF Color Interop Forum for `colorInteropID`.
"""

from collections.abc import Mapping
from math import atan, degrees
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from brushgs.formats.pictures.metadata import metadata_text
from brushgs.formats.pictures.rate import frame_rate
from brushgs.formats.pictures.shot import Shot
from brushgs.values.camera import Camera
from brushgs.version import __version__

# x and y of red, green, blue and white. Source: ITU-R BT.709.
REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
_LINEAR, _ENCODED = "lin_rec709_scene", "srgb_rec709_scene"

Kind = Literal["string", "int", "float", "rational", "chromaticities", "m44f"]


class Attribute(NamedTuple):
    """A value of the header.

    Attributes:
        kind: its type, as OpenEXR names it.
        value: a str, a number, or a tuple of numbers.
    """

    kind: Kind
    value: Any


def attributes_of(shot: Shot, notes: Mapping[str, str], *, is_linear: bool) -> dict[str, Attribute]:
    """The attributes of a file by name.

    Args:
        shot: what is known of the picture.
        notes: layer -> what its numbers mean.
        is_linear: whether colours are linear light; else they are display-encoded.
    """
    found = {
        "Software": Attribute("string", f"brushgs {__version__}"),
        "chromaticities": Attribute("chromaticities", REC709),
        "colorInteropID": Attribute("string", _LINEAR if is_linear else _ENCODED),
    }
    found |= {f"brushgs/{layer}": Attribute("string", note) for layer, note in notes.items()}
    if text := metadata_text(shot):
        found["comments"] = Attribute("string", text)  # the image description of other formats
    if shot.number is not None:
        found["imageCounter"] = Attribute("int", shot.number)
    if shot.fps is not None:
        rate = frame_rate(shot.fps)
        found["framesPerSecond"] = Attribute("rational", (rate.numerator, rate.denominator))
    return found | ({} if shot.camera is None else _camera(shot.camera))


def _camera(camera: Camera) -> dict[str, Attribute]:
    fov = degrees(2 * atan(0.5 * camera.width / camera.K[0, 0]))
    return {
        "worldToCamera": Attribute("m44f", _in_rows(camera_from_world(camera))),
        "worldToNDC": Attribute("m44f", _in_rows(ndc_from_world(camera))),
        "cameraFov": Attribute("float", fov),  # horizontal, degrees: the name that V-Ray gave it
    }


def camera_from_world(camera: Camera) -> NDArray[np.float64]:
    """[4, 4] on column vectors: to axes x right, y up, z forward, those that OpenEXR prescribes."""
    return np.asarray(np.diag([1.0, -1.0, 1.0, 1.0]) @ camera.viewmat)


def ndc_from_world(camera: Camera) -> NDArray[np.float64]:
    """[4, 4] on column vectors: to the picture, from (0, 0) upper left to (1, 1) lower right, after the
    division by w.

    z, which OpenEXR leaves open, is 0 at the near plane and 1 far away.
    """
    (fx, _, cx), (_, fy, cy) = camera.K[0], camera.K[1]
    width, height = camera.width, camera.height
    projection = [
        [fx / width, 0.0, cx / width, 0.0],
        [0.0, fy / height, cy / height, 0.0],
        [0.0, 0.0, 1.0, -camera.near],
        [0.0, 0.0, 1.0, 0.0],
    ]
    return np.asarray(projection @ camera.viewmat)


def _in_rows(matrix: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(matrix.T.ravel().tolist())
