"""A frame becomes an OpenEXR file: float, linear light, premultiplied as EXR demands, with its depth as Z."""

from pathlib import Path

import numpy as np

from brushgs.colors import linear_from_srgb
from brushgs.io.pictures.oiio import Background, straight_colors, write_pixels
from brushgs.scene import Frame

# Without a date OpenImageIO writes the time of day, and equal frames would give different bytes.
_ATTRIBUTES = {"DateTime": "0000:00:00 00:00:00"}


def write(frame: Frame, path: str | Path, background: Background) -> None:
    """See `write_frame`."""
    if background is None:
        alpha = frame.alpha[..., None]
        channels, names = [linear_from_srgb(straight_colors(frame)) * alpha, alpha], ["R", "G", "B", "A"]
    else:
        channels, names = [linear_from_srgb(frame.over(background))], ["R", "G", "B"]
    if frame.depth is not None:
        channels.append(frame.depth[..., None])
        names.append("Z")
    pixels = np.concatenate(channels, axis=-1).astype(np.float32)
    write_pixels(path, "openexr", pixels, tuple(names), _ATTRIBUTES)
