"""A frame becomes an OpenEXR file: the picture with the layers that the frame has.

`planes.py` makes channels of a frame, `cryptomatte.py` those of a matte, `attributes.py` says what stands in
the header; `flat.py` writes the file.
"""

from pathlib import Path

from brushgs.io.pictures.exr.flat import write_flat
from brushgs.io.pictures.oiio import Background
from brushgs.io.pictures.shot import Shot
from brushgs.scene import Frame


def write(frame: Frame, path: str | Path, background: Background, shot: Shot | None = None) -> None:
    """See `write_frame`."""
    write_flat(frame, path, background, Shot() if shot is None else shot)
