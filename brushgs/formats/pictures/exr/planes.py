"""The channels of a frame in an OpenEXR file, and the attributes of its header.

Names, signs and precision are those that compositing programs expect. Names have at most one dot, at which
Nuke splits them into layer and channel. Axes are those of compositing programs: x right, y up, z toward the
camera; brushgs has y down and z forward. Matrices are stored transposed, for row vectors multiplied from the
left.
Source: OpenEXR, Standard Attributes (openexr.com); ASWF Color Interop Forum for `colorInteropID`.
"""

from collections.abc import Callable, Mapping
from math import atan, degrees
from typing import Any, Literal, NamedTuple

import numpy as np

from brushgs.formats.pictures.encoding import frame_rate
from brushgs.formats.pictures.metadata import metadata_text
from brushgs.formats.pictures.oiio import Background
from brushgs.options.choices import FileSpace
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import Camera
from brushgs.values.colors import linear_from_srgb
from brushgs.values.frame import Frame
from brushgs.values.layers import Matte
from brushgs.values.shot import Shot
from brushgs.version import __version__

Kind = Literal["string", "int", "float", "rational", "chromaticities", "m44f"]


class Attribute(NamedTuple):
    """An attribute of the header."""

    kind: Kind  # name of its type in OpenEXR
    value: Any  # a str, a number, or a tuple of numbers


# OpenImageIO cannot write attributes of type "envmap"; a string of one letter is as long in the file.
LATLONG_MARK = "L"


def mark_latlong(header: bytes) -> bytes:
    """Replace the `LATLONG_MARK` at the start of a file by an "envmap" attribute (latitude-longitude)."""
    text, envmap = (b"envmap\0%s\0\1\0\0\0%s" % pair for pair in ((b"string", b"L"), (b"envmap", b"\0")))
    return header.replace(text, envmap, 1)


def attributes_of(shot: Shot, notes: Mapping[str, str], space: FileSpace) -> dict[str, Attribute]:
    """The attributes of a file by name; `notes` explain the numbers of each layer."""
    found = {
        "Software": Attribute("string", f"brushgs {__version__}"),
        "chromaticities": Attribute("chromaticities", SPACES[space].chromaticities),
        "colorInteropID": Attribute("string", SPACES[space].interop_id),
    }
    found |= {f"brushgs/{layer}": Attribute("string", note) for layer, note in notes.items()}
    if text := metadata_text(shot):
        found["comments"] = Attribute("string", text)  # the image description of other formats
    if shot.number is not None:
        found["imageCounter"] = Attribute("int", shot.number)
    if shot.fps is not None:
        rate = frame_rate(shot.fps)
        found["framesPerSecond"] = Attribute("rational", (rate.numerator, rate.denominator))
    if shot.dpi is not None:
        found["xDensity"] = Attribute("float", shot.dpi)  # pixels per inch
    if shot.panorama is not None and shot.panorama.is_photo_sphere:
        found["envmap"] = Attribute("string", LATLONG_MARK)
    return found | ({} if shot.camera is None else _camera(shot.camera))


def _camera(camera: Camera) -> dict[str, Attribute]:
    fov = degrees(2 * atan(0.5 * camera.width / camera.K[0, 0]))
    return {
        "worldToCamera": Attribute("m44f", _in_rows(camera_from_world(camera))),
        "worldToNDC": Attribute("m44f", _in_rows(ndc_from_world(camera))),
        "cameraFov": Attribute("float", fov),  # horizontal, degrees; a name of V-Ray
    }


def camera_from_world(camera: Camera) -> F64:
    """[4, 4] world to camera for column vectors, with the axes of OpenEXR: x right, y up, z forward."""
    return np.asarray(np.diag([1.0, -1.0, 1.0, 1.0]) @ camera.viewmat)


def ndc_from_world(camera: Camera) -> F64:
    """[4, 4] world to picture for column vectors: after division by w, (0, 0) is the upper left corner and
    (1, 1) the lower right.

    z, which OpenEXR does not specify, is 0 at the near plane and 1 at infinity.
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


def _in_rows(matrix: F64) -> tuple[float, ...]:
    return tuple(matrix.T.ravel().tolist())


LARGEST_HALF = 65504.0  # larger numbers become infinite
# Layer of the file -> meaning of its numbers, stored in the header as "brushgs/LAYER".
NOTES: Mapping[str, str] = {
    "RGBA": "{space}, premultiplied; strokes were blended display-encoded (sRGB), so layers that are laid "
    "over each other in linear light differ from this picture",
    "Z": "camera z in world units, the mean of the strokes by what each shows; 0 where nothing is painted",
    "N": "direction that the strokes face, unit vectors; camera axes x right, y up, z toward the camera",
    "forward": "motion to the next frame in pixels, u right, v up; not premultiplied",
    "stroke": "place on the stroke that shows most: u along it, v across it from its upper edge, 0 to 1",
    "height": "how high the paint stands, pixels",
    "unlit": "the picture before the lamp shines on it, otherwise like R G B A",
    "paint": "how much of the pixel is painted; the background takes the rest",
}


Rows = Callable[[slice], Array]  # slice of rows -> values of these rows


class Plane(NamedTuple):
    """One channel."""

    name: str  # in the file
    kind: Literal["half", "float"]  # "half" if 11 bits are enough
    rows: Rows  # returns [rows, W], or an array that broadcasts to it; called while writing

    @property
    def layer(self) -> str:
        """The key of its note in `NOTES`."""
        return self.name.split(".")[0] if "." in self.name or self.name == "Z" else "RGBA"


def planes_of(frame: Frame, background: Background, space: FileSpace) -> list[Plane]:
    """The channels of a frame on a background (see `write_frame`), the picture first; mattes are excluded."""
    planes = _planes("{}", "RGBA", "half", _colors(frame, background, space))
    depth = _values(frame, "depth") if frame.depth is None else frame.depth
    if depth is not None:
        planes += _planes("{}", "Z", "float", depth[..., None])
    if (normal := _values(frame, "normal")) is not None:
        planes += _planes("N.{}", "XYZ", "half", normal * np.array((1, -1, -1), np.float32))
    if (motion := _values(frame, "motion")) is not None:
        planes += _planes("forward.{}", "uv", "float", motion * np.array((1, -1), np.float32))
    if (uv := _values(frame, "uv")) is not None:
        planes += _planes("stroke.{}", "uv", "half", uv)
    if (height := _values(frame, "height")) is not None:
        planes += _planes("height.{}", "Y", "half", height[..., None])
    if (unlit := _values(frame, "unlit")) is not None:
        bare = Frame(unlit[..., :3], unlit[..., 3])
        planes += _planes("unlit.{}", "RGBA", "half", _colors(bare, background, space))
    paint = _values(frame, "paint")
    if paint is None and frame.layers and background is not None:
        paint = frame.alpha
    if paint is not None:
        planes += _planes("paint.{}", "A", "half", paint[..., None])
    return planes


def _values(frame: Frame, name: str) -> Array | None:
    layer = frame.layers.get(name)
    return None if layer is None or isinstance(layer, Matte) else layer


def _colors(frame: Frame, background: Background, space: FileSpace) -> F32:
    """[H, W, 4] premultiplied color and alpha; alpha is 1 on a background."""
    if background is not None:
        colors = colors_in(frame.over(background), space)
        return np.concatenate([colors, np.ones_like(colors[..., :1])], axis=-1, dtype=np.float32)
    alpha = frame.alpha[..., None]
    straight = colors_in(frame.straight_colors(), space)
    return np.concatenate([straight * alpha, alpha], axis=-1, dtype=np.float32)


def _planes(pattern: str, letters: str, kind: Literal["half", "float"], values: Array) -> list[Plane]:
    """A plane for each channel of [H, W, channels]."""
    return [
        Plane(pattern.format(letter), kind, lambda rows, i=i: values[rows, :, i])  # type: ignore[misc]
        for i, letter in enumerate(letters)
    ]


# Color spaces of OpenEXR files: names, primaries, and conversion from the colors of paintings.
#
# Converted by OpenImageIO with its built-in configuration, ignoring $OCIO, so that equal frames give equal
# files. That configuration adapts white points by the Bradford method. Sources: ITU-R BT.709, BT.2020; SMPTE
# EG 432-1 (P3-D65); AMPAS S-2014-004 (ACEScg), ST 2065-1; ASWF Color Interop Forum for the names in files.


_CONFIG = "ocio://default"
_D65, _D60 = (0.3127, 0.329), (0.32168, 0.33767)
_REC709, _REC2020 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06), (0.708, 0.292, 0.17, 0.797, 0.131, 0.046)
_AP1, _AP0 = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044), (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077)
_P3 = (0.68, 0.32, 0.265, 0.69, 0.15, 0.06)


class Space(NamedTuple):
    """A color space of a file."""

    words: str  # for the note in the header
    interop_id: str  # its Color Interop Forum name, also known to OpenImageIO
    chromaticities: tuple[float, ...]  # x and y of red, green, blue and white


SPACES: Mapping[FileSpace, Space] = {
    "lin_srgb": Space("linear light, Rec. 709 primaries", "lin_rec709_scene", (*_REC709, *_D65)),
    "srgb": Space("display-encoded (sRGB)", "srgb_rec709_scene", (*_REC709, *_D65)),
    "acescg": Space("linear light, ACEScg (AP1 primaries)", "lin_ap1_scene", (*_AP1, *_D60)),
    "aces2065_1": Space("linear light, ACES2065-1 (AP0 primaries)", "lin_ap0_scene", (*_AP0, *_D60)),
    "lin_rec2020": Space("linear light, Rec. 2020 primaries", "lin_rec2020_scene", (*_REC2020, *_D65)),
    "lin_p3d65": Space("linear light, P3 primaries, D65", "lin_p3d65_scene", (*_P3, *_D65)),
}
DEFAULT: FileSpace = "lin_srgb"


def colors_in(encoded: Array, space: FileSpace) -> F32:
    """Convert display-encoded colors [H, W, 3] of a painting to the space of a file."""
    if space == "srgb":
        return np.asarray(encoded, np.float32)
    light = np.asarray(linear_from_srgb(encoded), np.float32)
    return _converted(light, SPACES[DEFAULT].interop_id, SPACES[space].interop_id)


def rec709_of(light: F32, interop_id: str) -> F32:
    """Convert linear light [H, W, 3] from the space `interop_id` of `SPACES` to Rec. 709 primaries."""
    return _converted(light, interop_id, SPACES[DEFAULT].interop_id)


def _converted(light: F32, source: str, target: str) -> F32:
    """Convert colors [H, W, 3] between spaces given by Color Interop Forum names."""
    if source == target or light.size == 0:
        return light
    from OpenImageIO import FLOAT, ImageBuf, ImageBufAlgo

    pixels = ImageBuf(np.ascontiguousarray(light))
    found = ImageBufAlgo.colorconvert(pixels, source, target, colorconfig=_CONFIG)
    assert not found.has_error, found.geterror()
    return np.asarray(found.get_pixels(FLOAT), np.float32)
