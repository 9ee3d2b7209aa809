"""A frame becomes an OpenEXR file: flat with the layers that the frame has, or deep if it has deep samples.

`planes.py` makes channels of a frame, `cryptomatte.py` those of a matte, `attributes.py` says what stands in
the header; `flat.py` and `deep.py` write the file.
"""

from pathlib import Path

from brushgs.formats.pictures.exr.deep import write_deep
from brushgs.formats.pictures.exr.flat import write_flat
from brushgs.formats.pictures.oiio import Background
from brushgs.formats.pictures.shot import Shot
from brushgs.values.frame import Frame


def write(frame: Frame, path: str | Path, background: Background, shot: Shot | None = None) -> None:
    """See `write_frame`."""
    shot = Shot() if shot is None else shot
    if frame.deep is None:
        write_flat(frame, path, background, shot)
    else:
        write_deep(frame.deep, path, shot)
