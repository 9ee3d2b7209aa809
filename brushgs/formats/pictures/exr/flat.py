"""The channels of a frame go to a single-part OpenEXR file, a band of rows at a time to save memory."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.core.signals import defer_stop
from brushgs.formats.files import replacing
from brushgs.formats.pictures.exr.attributes import attributes_of
from brushgs.formats.pictures.exr.cryptomatte import cryptomattes_of
from brushgs.formats.pictures.exr.planes import LARGEST_HALF, NOTES, Plane, planes_of
from brushgs.formats.pictures.oiio import NO_DATE, Background, not_written
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame

if TYPE_CHECKING:
    import OpenImageIO

_NUM_ROWS = 16  # written at a time: a block of the ZIP compression, small enough for caches
_TYPES = {"chromaticities": "float[8]", "m44f": "matrix"}  # where OpenImageIO has another name


def write_flat(frame: Frame, path: str | Path, background: Background, shot: Shot) -> None:
    """Write a frame with its layers. See `write_frame`."""
    import OpenImageIO

    planes = planes_of(frame, background)
    notes = {plane.layer: NOTES[plane.layer] for plane in planes}
    attributes = attributes_of(shot, notes, is_linear=True)
    for planes_of_matte, attributes_of_matte in cryptomattes_of(frame, shot):
        planes += planes_of_matte
        attributes |= attributes_of_matte
    height, width = frame.alpha.shape
    spec = OpenImageIO.ImageSpec(width, height, len(planes), "half")
    spec.channelnames = tuple(plane.name for plane in planes)
    spec.channelformats = tuple(plane.kind for plane in planes)
    spec.alpha_channel = spec.channelnames.index("A")
    spec.z_channel = spec.channelnames.index("Z") if "Z" in spec.channelnames else -1
    spec.attribute("DateTime", NO_DATE)
    spec.attribute("compression", "zip")
    for name, (kind, value) in attributes.items():
        spec.attribute(name, _TYPES.get(kind, kind), value)
    out = OpenImageIO.ImageOutput.create("openexr")
    assert out is not None, "the formats of the table are part of every build of OpenImageIO"
    # An encoder that is interrupted midway complains to the terminal.
    with defer_stop(), replacing(path) as temporary:
        is_written = out.open(str(temporary), spec) and _write_bands(out, planes, width, height)
        if not (out.close() and is_written):
            raise not_written(path, temporary, out)


def _write_bands(out: "OpenImageIO.ImageOutput", planes: Sequence[Plane], width: int, height: int) -> bool:
    """Write all rows; whether that succeeded."""
    band = np.empty((min(_NUM_ROWS, height), width, len(planes)), np.float32)
    for start in range(0, height, _NUM_ROWS):
        stop = min(start + _NUM_ROWS, height)
        pixels = band[: stop - start]
        for i, plane in enumerate(planes):
            values = plane.rows(slice(start, stop))
            if plane.kind == "half":
                np.clip(values, -LARGEST_HALF, LARGEST_HALF, out=pixels[..., i])
            else:
                pixels[..., i] = values
        if not out.write_scanlines(start, stop, 0, pixels):
            return False
    return True
