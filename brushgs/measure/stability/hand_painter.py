"""The hand-made configuration of the temporal report: `track`, held, boiled and redrawn.

Figures of boxes refer to boxes before hand-made changes: flips and spins that were not requested.
"""

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from brushgs.measure.stability.look_painters import LookPainter, in_threads
from brushgs.pipeline.frame_painter import FrameKind, FramePainter, FrameView
from brushgs.rendering.canvas import Painting
from brushgs.rendering.hand import Hand
from brushgs.rendering.options import RenderOptions
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame

if TYPE_CHECKING:
    from brushgs.measure.stability.painters import Comparison

NAME = "hand"


@dataclass
class HandPainter(LookPainter):
    """Paints whole frames as `brushgs render` does.

    Attributes:
        hand: settings of hand-made animation.
    """

    hand: Hand = field(kw_only=True)

    def paint(self, index: int, plain: Array | None = None) -> Frame:
        """One frame; it does not depend on the plain picture."""
        index = self.hand.shown(index % self.hand.num_frames)  # a closed path ends with its first frame again
        held = {other: self._view(other) for other in self.hand.needed(index)}
        view = replace(self._view(index), held=held)
        takes_light = self.moving is None or self.moving.takes_light
        painter = FramePainter(self.painting, None, FrameKind(None), takes_light=takes_light, hand=self.hand)
        with self.timer.draw.running():
            frame = painter.frame(view)
        self.timer.frames += 1
        return frame

    def _view(self, index: int) -> FrameView:
        pose = None if self.moving is None else self.moving.pose(index)
        return FrameView(index, self.cameras[index], tuple(self._directions(index)), pose=pose)


def hand_painter(
    comparison: "Comparison", hand: Hand, painting: Painting, options: RenderOptions, num_threads: int | None
) -> HandPainter:
    """The configuration of a comparison; `options` are those of its `track`."""
    return HandPainter(
        NAME,
        "track, made by hand",
        comparison.strokes,
        comparison.cameras,
        comparison.texture,
        replace(options, num_threads=num_threads),
        moving=comparison.moving,
        is_loop=comparison.is_loop,
        painting=in_threads(painting.with_depth(False), num_threads),
        hand=hand,
    )
