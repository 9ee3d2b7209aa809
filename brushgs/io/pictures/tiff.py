"""A frame becomes a TIFF: 16 bit, display-encoded, straight alpha."""

from pathlib import Path

import numpy as np

from brushgs.io.pictures.oiio import Background, quantise, with_alpha, write_pixels
from brushgs.scene import Frame

# Without a date OpenImageIO writes the time of day, and equal frames would give different bytes.
_ATTRIBUTES = {"oiio:UnassociatedAlpha": 1, "DateTime": "0000:00:00 00:00:00", "tiff:zipquality": 2}


def write(frame: Frame, path: str | Path, background: Background) -> None:
    """See `write_frame`."""
    values = with_alpha(frame) if background is None else frame.over(background)
    names = ("R", "G", "B", "A")[: values.shape[-1]]
    write_pixels(path, "tiff", quantise(values, np.uint16), names, _ATTRIBUTES)
