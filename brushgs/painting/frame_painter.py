"""What paints the frames of a sequence: picklable, so that it can do so in any process of any machine."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from brushgs.options.choices import ViewLock
from brushgs.options.painting import DrawConfig
from brushgs.painting.background import Ground
from brushgs.painting.stages import box_sigmas
from brushgs.rendering.project import Directions
from brushgs.scene import Camera, Frame, Gaussians

if TYPE_CHECKING:
    from brushgs.brushes.texture import StrokeTexture

WHITE = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Shot:
    """One frame to paint: all that differs from frame to frame.

    Attributes:
        index: which frame of the path, from 0.
        camera: the view.
        lock: how the directions of the strokes are chosen, or the directions, see `project`.
    """

    index: int
    camera: Camera
    lock: ViewLock | Directions


@dataclass(frozen=True, eq=False)
class Painter:
    """All that is the same in every frame. It goes to each process once.

    Attributes:
        strokes: the strokes in space.
        texture: the mark of a stroke.
        ground: what lies behind the strokes, see `open_background`; None keeps pictures transparent.
        draw: how strokes are drawn; `threads` are those of one process.
        suffix: ".png", ".tif", ".tiff" or ".exr" for the bytes of such a file, None for pixels.
    """

    strokes: Gaussians
    texture: "StrokeTexture"
    ground: Ground
    draw: DrawConfig
    suffix: str | None

    def frame(self, shot: Shot) -> Frame:
        """The picture; with depth if it is for an EXR, the one kind of file that holds it."""
        from brushgs.rendering.render import render

        return render(
            self.strokes,
            shot.camera,
            self.texture,
            lock=shot.lock,
            order=self.draw.order or "soft",
            filter=self.draw.filter,
            num_sigmas=box_sigmas(self.texture, self.draw),
            depth=self.suffix == ".exr",
            num_threads=self.draw.threads,
        )

    def __call__(self, shot: Shot) -> bytes | NDArray[np.uint8]:
        """The content of the finished picture file, or uint8 [H, W, 3] on the ground (white if None).

        Pictures are encoded here, so that as many processes as paint share that work too.
        """
        from brushgs.io.pictures.images import encode_frame

        frame = self.frame(shot)
        if self.suffix is not None:
            return encode_frame(frame, self.suffix, background=self.ground)
        return frame.bytes_over(WHITE if self.ground is None else self.ground)
