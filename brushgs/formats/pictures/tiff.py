"""A frame becomes a TIFF: 16 or 8 bit, display-encoded, straight alpha."""

from pathlib import Path

from brushgs.formats.pictures.metadata import described
from brushgs.formats.pictures.oiio import NO_DATE, Background, pixels_of, write_pixels
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame

_ATTRIBUTES = {"oiio:UnassociatedAlpha": 1, "DateTime": NO_DATE, "tiff:zipquality": 2}


def write(
    frame: Frame, path: str | Path, background: Background, *, bits: int = 16, shot: Shot | None = None
) -> None:
    """See `write_frame`."""
    pixels = pixels_of(frame, background, bits)
    names = ("R", "G", "B", "A")[: pixels.shape[-1]]
    write_pixels(path, "tiff", pixels, names, _ATTRIBUTES | described(shot))
