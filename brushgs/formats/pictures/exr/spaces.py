"""Color spaces of OpenEXR files: names, primaries, and conversion from the colors of paintings.

Converted by OpenImageIO with its built-in configuration, ignoring $OCIO, so that equal frames give equal
files. That configuration adapts white points by the Bradford method.
Sources: ITU-R BT.709, BT.2020; SMPTE EG 432-1 (P3-D65); AMPAS S-2014-004 (ACEScg), ST 2065-1; ASWF Color
Interop Forum for the names in files.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from brushgs.options.choices import FileSpace
from brushgs.values.arrays import F32, Array
from brushgs.values.colors import linear_from_srgb

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
