"""A frame becomes a TIFF: 16 or 8 bit, display-encoded, straight alpha."""

from pathlib import Path

from brushgs.io.pictures.oiio import Background, pixels_of, write_pixels
from brushgs.scene import Frame

# Without a date OpenImageIO writes the time of day, and equal frames would give different bytes.
_ATTRIBUTES = {"oiio:UnassociatedAlpha": 1, "DateTime": "0000:00:00 00:00:00", "tiff:zipquality": 2}


def write(frame: Frame, path: str | Path, background: Background, *, bits: int = 16) -> None:
    """See `write_frame`."""
    pixels = pixels_of(frame, background, bits)
    names = ("R", "G", "B", "A")[: pixels.shape[-1]]
    write_pixels(path, "tiff", pixels, names, _ATTRIBUTES)
