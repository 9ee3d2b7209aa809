"""The painter of single frames of a sequence: picklable, so that it runs in any process of any machine."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.io.pictures.formats import holds_depth
from brushgs.painting.background import Background
from brushgs.rendering.project import Directions
from brushgs.scene import Camera, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.brush_set import Brushes
    from brushgs.rendering.options import RenderOptions

WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class FrameView:
    """One frame to paint: everything that differs from frame to frame.

    Attributes:
        index: which frame of the path, from 0.
        camera: the view.
        directions: the directions of the strokes where they are tracked, else None.
    """

    index: int
    camera: Camera
    directions: Directions | None = None


@dataclass(frozen=True, eq=False)
class FramePainter:
    """Everything that is equal in all frames; it is sent to each process once.

    Attributes:
        strokes: the strokes in space.
        texture: the mark of a stroke.
        background: what lies behind the strokes, see `open_background`; None keeps pictures transparent.
        options: how strokes become a frame, but for tracked directions and depth; `num_threads` are those of
            one process.
        suffix: one of `PICTURE_SUFFIXES` for the bytes of such a file, None for pixels.
    """

    strokes: Gaussians
    texture: "Brushes"
    background: Background
    options: "RenderOptions"
    suffix: str | None

    def frame(self, view: FrameView) -> Frame:
        """Paint the frame, with depth if its file holds it."""
        from brushgs.rendering.options import render_with

        options = replace(self.options, depth=self.suffix is not None and holds_depth(f"a{self.suffix}"))
        if view.directions is not None:
            options = options.in_direction(view.directions)
        return render_with(self.strokes, view.camera, self.texture, options)

    def __call__(self, view: FrameView) -> bytes | NDArray[np.uint8]:
        """The content of the finished picture file, or uint8 [H, W, 3] on the background (white if None).

        Pictures are encoded here, so that as many processes as paint share that work too.
        """
        from brushgs.io.pictures.images import encode_frame

        frame = self.frame(view)
        if self.suffix is not None:
            return encode_frame(frame, self.suffix, background=self.background)
        return frame.bytes_over(WHITE if self.background is None else self.background)
