"""A camera path painted frame by frame: to numbered picture files or to a video.

`paint_sequence` runs the stages; `Painter` paints a `Shot`, in whatever process; `outputs` knows what a name
on the command line stands for, `identity` what makes two paintings one.
"""

from brushgs.sequence.painter import Painter, Shot
from brushgs.sequence.stages import paint_sequence

__all__ = ["Painter", "Shot", "paint_sequence"]
