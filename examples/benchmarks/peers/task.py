"""What every peer is asked for: a scene, its views, a number of strokes and a style."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

import brushgs as bg
from brushgs.options.painting import CleanConfig, PaintConfig, ViewConfig
from brushgs.options.scene_source import SceneSource
from brushgs.options.sequence import PathConfig
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.values.arrays import F32, Array
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame

ORBIT = 480  # frames of a turn: 0.75 degrees a frame
WHITE = (1.0, 1.0, 1.0)  # the canvas of painters that know only the picture


@dataclass(frozen=True)
class Task:
    """One job of a peer.

    Attributes:
        source: the scene's files.
        view: of the first picture.
        cameras: one of a still; neighbors on an orbit of `ORBIT` frames of a film.
        strokes: the most strokes.
        style: a painting, the file of a picture.
    """

    source: SceneSource
    view: ViewConfig
    cameras: tuple[Camera, ...]
    strokes: int
    style: str

    @property
    def views(self) -> Camera | PathConfig:
        """What `prepare` makes strokes for."""
        return self.cameras[0] if len(self.cameras) == 1 else PathConfig(orbit=ORBIT)

    @cached_property
    def scene(self) -> bg.Gaussians:
        """The scene as loaded."""
        config = PaintConfig(view=self.view, clean=CleanConfig("off"))
        found = prepare(self.source, config, Report(), views=self.cameras[0], asks=("scene",)).scene
        assert found is not None
        return found

    def plain_frame(self, index: int) -> Frame:
        """The whole scene as it was trained, with depth."""
        return bg.render(self.scene, self.cameras[index], "gaussian")

    def plain(self, index: int) -> F32:
        """[H, W, 3] the same on white, 0 to 1: all that a painter of pictures gets."""
        return on_white(self.plain_frame(index))


class Painter(Protocol):
    """A peer at work."""

    @property
    def strokes(self) -> int | None:
        """Strokes of its first picture; None if it lays none. Valid once that is painted."""

    def paint(self, index: int) -> Array:
        """[H, W, 3] the picture of a camera of the task, 0 to 1."""

    def boxes(self, index: int) -> Sequence[tuple[Boxes, Boxes]] | None:
        """Of each coat its boxes and the ellipses behind them, as `orientation_events` takes them.

        None for a painter whose strokes are others in each picture, so that none can flip.
        """


def on_white(frame: Frame) -> F32:
    """[H, W, 3] a frame on white, 0 to 1."""
    return np.clip(frame.over(WHITE), 0, 1).astype(np.float32)
