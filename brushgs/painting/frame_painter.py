"""What paints the frames of a sequence: picklable, so that it can do so in any process of any machine."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.painting.background import Ground
from brushgs.rendering.project import Directions
from brushgs.scene import Camera, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.rendering.options import RenderOptions

WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Shot:
    """One frame to paint: all that differs from frame to frame.

    Attributes:
        index: which frame of the path, from 0.
        camera: the view.
        directions: the directions of the strokes where they are tracked, else None.
    """

    index: int
    camera: Camera
    directions: Directions | None = None


@dataclass(frozen=True, eq=False)
class Painter:
    """All that is the same in every frame. It goes to each process once.

    Attributes:
        strokes: the strokes in space.
        texture: the mark of a stroke.
        background: what lies behind the strokes, see `open_background`; None keeps pictures transparent.
        options: how strokes become a frame, but for tracked directions and depth; `num_threads` are those of
            one process.
        suffix: ".png", ".tif", ".tiff" or ".exr" for the bytes of such a file, None for pixels.
    """

    strokes: Gaussians
    texture: "StrokeTexture"
    background: Ground
    options: "RenderOptions"
    suffix: str | None

    def frame(self, shot: Shot) -> Frame:
        """The picture; with depth if it is for an EXR, the one kind of file that holds it."""
        from brushgs.rendering.options import render_with

        options = replace(self.options, depth=self.suffix == ".exr")
        if shot.directions is not None:
            options = options.in_direction(shot.directions)
        return render_with(self.strokes, shot.camera, self.texture, options)

    def __call__(self, shot: Shot) -> bytes | NDArray[np.uint8]:
        """The content of the finished picture file, or uint8 [H, W, 3] on the background (white if None).

        Pictures are encoded here, so that as many processes as paint share that work too.
        """
        from brushgs.io.pictures.images import encode_frame

        frame = self.frame(shot)
        if self.suffix is not None:
            return encode_frame(frame, self.suffix, background=self.background)
        return frame.bytes_over(WHITE if self.background is None else self.background)
